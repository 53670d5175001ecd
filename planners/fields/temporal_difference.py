"""What NTRL's field is trained on: speeds and surfaces' normals at configurations, no path and no
travel time.

Ni, Pan and Qureshi, ICLR 2025. The paper's are the four terms; the grouping of pairs, how the
normals come about, and the weights are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from envs import Environment
from envs.problem import Array
from planners.fields.physics import GroupPlan, Space, in_balls
from planners.learning.normalizer import Normalizer
from planners.learning.training_loop import Batch, as_float32

_ASIDE = 1e-3
"""How far to both sides clearances are asked for normals, in the networks' space."""


class Times(Protocol):
    """What is asked of a network, as a `MetricField` has it."""

    def times(self, starts: Tensor, goals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """T (g, s, t) between starts (g, s, d) and goals (g, t, d) of groups, and its gradients
        (g, s, t, d) by both."""

    def time(self, a: Tensor, b: Tensor) -> Tensor:
        """T alone (...,) between configurations (..., d)."""


@dataclass
class TemporalDifference:
    """(L_E + l_TD L_TD + l_N L_N) exp(-l_C T), as means over pairs and both of their ends.

    - L_E = (sqrt(S* |grad T|) - 1)^2, the Eikonal equation.
    - L_TD: T at a place is the time of a step along S* grad T, plus T where it leads to, which is
      held fixed: information comes from nearer to the goal, as in value iteration. By the time of
      the step, squared.
    - L_N: where it is slow, the fastest way leads straight away from what is near: S* grad T is
      held against the normal of the surface, by how slow it is.
    - exp(-l_C T), held fixed, T by its mean: near pairs first, as those that are far build on them.

    Attributes:
        reach: how far a step goes at the highest speed, by d_max of the speed model.
        difference_weight, normal_weight: l_TD and l_N.
        eikonal_weight: l_E.
        causality: l_C.
    """

    plan: GroupPlan = field(default_factory=GroupPlan)
    reach: float = 0.1
    eikonal_weight: float = 1.0
    difference_weight: float = 1.0
    normal_weight: float = 0.01
    causality: float = 2.5

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._space = replace(Space.of(env), least_clearance=0.0)
        self._step = self.reach * env.speed_model.d_max / Normalizer.of(env).extent
        return 0.0

    def draw(self, rng: np.random.Generator) -> Batch:
        """Points (g, s + t, d), their log speeds (g, s + t), the gradients of these there, and the
        normals (g, s + t, d): which way clearance grows."""
        points, clearance = free_groups(self._space, self.plan, rng)
        log_speed = np.log(self._space.speed(clearance))
        return as_float32(points, log_speed, *surroundings(self._space, points))

    def loss(self, net: Times, batch: Batch, share: float) -> Tensor:
        n = self.plan.starts
        at_starts = tuple(part[:, :n, None] for part in batch)
        at_goals = tuple(part[:, None, n:] for part in batch)
        time, by_start, by_goal = net.times(batch[0][:, :n], batch[0][:, n:])
        weight = torch.exp(-self.causality * time.detach() / time.detach().mean())
        ends = self._at_end(net, time, by_start, at_starts, at_goals[0]) + self._at_end(
            net, time, by_goal, at_goals, at_starts[0]
        )
        loss: Tensor = (weight * ends).mean() / 2
        return loss

    def _at_end(
        self, net: Times, time: Tensor, slope: Tensor, here: Batch, other: Tensor
    ) -> Tensor:
        """The three terms (g, s, t) at one end of all pairs."""
        _, log_speed, _, normal = here
        speed = log_speed.exp()[..., None]
        flow = speed * slope  # a unit vector where the Eikonal equation holds
        steepness = flow.norm(dim=-1)
        eikonal = (steepness.clamp_min(1e-12).sqrt() - 1) ** 2
        direction = (flow / steepness[..., None].clamp_min(1e-6)).detach()
        step = (time.detach() / 2).clamp_max(self._step)
        with torch.no_grad():
            there, spent = after(step, direction, here)
            rest = net.time(there, other)
        difference = ((time - spent - rest) / step.clamp_min(1e-6)) ** 2
        against = (1 - speed.squeeze(-1)) * ((flow + normal) ** 2).sum(-1)
        terms: Tensor = (
            self.eikonal_weight * eikonal
            + self.difference_weight * difference
            + self.normal_weight * against
        )
        return terms


def after(step: Tensor, direction: Tensor, here: Batch) -> tuple[Tensor, Tensor]:
    """Where (..., d) a step against unit vectors (..., d) leads to that would take a time `step`
    (...) if the speed stayed what it is `here`, and what it does take: the log speed changes along
    it as its gradient says."""
    point, log_speed, by_place, _ = here
    way = -(step * log_speed.exp())[..., None] * direction
    growth = (by_place * way).sum(-1).clamp(-1, 1)
    small = growth.abs() < 1e-3
    safe = torch.where(small, torch.ones_like(growth), growth)
    share = torch.where(small, 1 - growth / 2, -torch.expm1(-safe) / safe)
    return point + way, step * share


def free_groups(space: Space, plan: GroupPlan, rng: np.random.Generator) -> tuple[Array, Array]:
    """Free points (g, s + t, d) in groups as a plan has them, and their clearances (g, s + t):
    where nothing can be, T need not be right, and across thin walls it could not be."""
    local = round(plan.local_share * plan.groups)
    n = plan.points
    centers = space.uniform(rng, local, 1)
    balls = in_balls(rng, centers, plan, n * (1 + plan.candidates))
    spread = space.uniform(rng, plan.groups - local, n * (1 + plan.candidates))
    drawn = np.concatenate([np.clip(balls, *space.limits), spread])
    drawn[:local, -n:] = centers  # which are free, if nothing else is
    clearance = space.clearance(drawn.reshape(-1, drawn.shape[-1])).reshape(drawn.shape[:2])
    near = plan.near.holds(clearance) & (rng.random(clearance.shape) < plan.near.share)
    rank = rng.random(clearance.shape) - near + 4 * (clearance <= 0)
    rank[:local, -n:] += 2  # after all that are free, before those that are not
    chosen = np.argsort(rank, axis=1)[:, :n]
    return (
        np.take_along_axis(drawn, chosen[..., None], axis=1),
        np.take_along_axis(clearance, chosen, axis=1),
    )


def surroundings(space: Space, points: Array) -> tuple[Array, Array]:
    """By differences along the axes at points (..., d): the gradients (..., d) of the log speed,
    and unit vectors (..., d) along which clearance grows fastest, 0 where it does not change."""
    d = points.shape[-1]
    steps = _ASIDE * np.eye(d)
    beside = points[..., None, None, :] + np.stack([steps, -steps])
    clearance = space.clearance(beside.reshape(-1, d)).reshape(beside.shape[:-1])
    log_speed = np.log(space.speed(clearance))
    slope: Array = (log_speed[..., 0, :] - log_speed[..., 1, :]) / (2 * _ASIDE)
    rise = clearance[..., 0, :] - clearance[..., 1, :]
    length = np.linalg.norm(rise, axis=-1, keepdims=True)
    normal: Array = np.divide(rise, length, out=np.zeros_like(rise), where=length > 0)
    return slope, normal
