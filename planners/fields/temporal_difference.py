"""What NTRL's field is trained on: speeds and surfaces' normals at configurations, no path and no
travel time.

Ni, Pan and Qureshi, ICLR 2025. The paper's are the four terms; the grouping of pairs, how the
normals come about, and the weights are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from envs import Environment
from envs.problem import Array
from planners.fields.metric_field import MetricField
from planners.fields.physics import GroupPlan, GroupSampler, Space
from planners.learning.training_loop import Batch, as_float32

_ASIDE = 1e-3
"""How far to both sides clearances are asked for normals, in the networks' space."""


@dataclass
class TemporalDifference:
    """(L_E + L_TD + L_N) exp(-l_C T), as means over pairs and both of their ends.

    - L_E = (sqrt(S* |grad T|) - 1)^2, the Eikonal equation.
    - L_TD: T at a place is the time of a step along S* grad T, plus T where it leads to, which is
      held fixed: information comes from nearer to the goal, as in value iteration. By the time of
      the step, squared.
    - L_N: where it is slow, the fastest way leads straight away from what is near: S* grad T is
      held against the normal of the surface, by how slow it is.
    - exp(-l_C T), held fixed: near pairs first, as those that are far build on them.

    Attributes:
        step: the time of a step, in the networks' space at the highest speed.
        difference_weight, normal_weight: l_TD and l_N; that of L_E is 1.
        causality: l_C.
    """

    plan: GroupPlan = field(default_factory=GroupPlan)
    step: float = 0.02
    difference_weight: float = 1.0
    normal_weight: float = 0.1
    causality: float = 0.5

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._space = Space.of(env)
        self._sampler = GroupSampler(self._space, self.plan)
        return 0.0

    def draw(self, rng: np.random.Generator) -> Batch:
        """Points (g, s + t, d), their log speeds (g, s + t), and the normals there (g, s + t, d):
        which way clearance grows."""
        points, log_speed = self._sampler.draw(rng)
        return as_float32(points, log_speed, normals(self._space, points))

    def loss(self, net: MetricField, batch: Batch, share: float) -> Tensor:
        points, log_speed, normal = batch
        n = self.plan.starts
        starts, goals = points[:, :n], points[:, n:]
        time, by_start, by_goal = net.times(starts, goals)
        weight = torch.exp(-self.causality * time.detach())
        at_starts = starts[:, :, None], log_speed[:, :n, None], normal[:, :n, None]
        at_goals = goals[:, None], log_speed[:, None, n:], normal[:, None, n:]
        ends = self._at_end(net, time, by_start, *at_starts, goals[:, None]) + self._at_end(
            net, time, by_goal, *at_goals, starts[:, :, None]
        )
        return (weight * ends).mean() / 2

    def _at_end(
        self,
        net: MetricField,
        time: Tensor,
        slope: Tensor,
        here: Tensor,
        log_speed: Tensor,
        normal: Tensor,
        other: Tensor,
    ) -> Tensor:
        """The three terms (g, s, t) at one end of all pairs."""
        speed = log_speed.exp()[..., None]
        flow = speed * slope  # a unit vector where the Eikonal equation holds
        steepness = flow.norm(dim=-1)
        eikonal = (steepness.clamp_min(1e-12).sqrt() - 1) ** 2
        with torch.no_grad():
            direction = flow / steepness[..., None].clamp_min(1e-6)
            step = torch.minimum(time / 2, time.new_tensor(self.step))
            there = here - step[..., None] * speed * direction
            rest = net.time(there, other)
        difference = ((time - step - rest) / self.step) ** 2
        against = (1 - speed.squeeze(-1)) * ((flow + normal) ** 2).sum(-1)
        return eikonal + self.difference_weight * difference + self.normal_weight * against


def normals(space: Space, points: Array) -> Array:
    """Unit vectors (..., d) along which clearance grows fastest at points (..., d), by differences
    along the axes; 0 where it does not change."""
    d = points.shape[-1]
    steps = _ASIDE * np.eye(d)
    beside = points[..., None, None, :] + np.stack([steps, -steps])
    clearance = space.clearance(beside.reshape(-1, d)).reshape(beside.shape[:-1])
    rise = clearance[..., 0, :] - clearance[..., 1, :]
    length = np.linalg.norm(rise, axis=-1, keepdims=True)
    found: Array = np.divide(rise, length, out=np.zeros_like(rise), where=length > 0)
    return found
