"""NTFields' physics where walls are thin: the Eikonal equation along straight lines, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from envs import Environment
from envs.problem import Array
from planners.fields.networks import TimeField
from planners.fields.objectives import LargestSubsolution
from planners.fields.physics import steepness_along, subsolution_loss
from planners.fields.sampling import GroupPlan, NearSurfaces, Space, in_balls
from planners.fields.surroundings import surroundings_of
from planners.training import Batch, as_float32


@dataclass
class LargestSubsolutionInRooms(LargestSubsolution):
    """`LargestSubsolution` among points that are free, bounded along straight lines as well.

    A network's T may jump between two places and still have the right slope wherever that is
    asked, as long as the jump is narrow; and to jump pays, since T is pulled up. But no field with
    |grad T| S* <= 1 can rise by more between two places than what it takes to go straight from one
    to the other. That holds however far apart they are if nothing is in the way, and it takes
    speeds only. So a group has starts close to each other, and goals.

    Pairs with something in between are pulled up with their full weight, however close they are.

    Attributes:
        straight_weight: of these bounds.
        slope_weight: of the Eikonal equation at points.
        same_ball: share of groups with starts and goals in one place.
    """

    plan: GroupPlan = field(
        default_factory=lambda: GroupPlan(
            groups=64, starts=4, goals=4, near=NearSurfaces(0.5, nearest=0.0, farthest=1.1)
        )
    )
    pull: tuple[float, float] = (0.3, 0.05)
    straight_weight: float = 1.0
    slope_weight: float = 0.3
    same_ball: float = 0.3

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._space = Space.of(env)
        self._about = surroundings_of(env)
        return 0.0

    def draw(self, rng: np.random.Generator) -> Batch:
        """Points (g, s + t, d), their log speeds (g, s + t), and the times on straight lines
        between all points of a group (g, s + t, s + t)."""
        plan = self.plan
        one = self._one_ball(rng, round(self.same_ball * plan.groups), plan.points)
        apart = plan.groups - len(one[0])
        starts, goals = (
            self._one_ball(rng, apart, plan.starts),
            self._one_ball(rng, apart, plan.goals),
        )
        points, clearance = (
            np.concatenate([a, np.concatenate([b, c], axis=1)])
            for a, b, c in zip(one, starts, goals, strict=True)
        )
        times = self._about.straight_times(points[:, :, None], points[:, None])
        return as_float32(points, np.log(self._space.speed(clearance)), times)

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        points, log_speed, times = batch
        n = self.plan.starts
        errors, _, stretch, distance = self._errors(net, (points, log_speed))
        direct = times[:, :n, n:]
        pull, slack_weight = self.weights(share)
        reach = torch.where(direct.isinf(), torch.inf, distance)
        sloped = subsolution_loss(
            errors.clamp(-4, 8),
            stretch,
            reach,
            pull=pull / self.slope_weight,
            pull_distance=self.pull_distance,
            slack_weight=slack_weight,
        )
        arrival = stretch.exp() * distance
        rises = (
            (arrival[:, :, None] - arrival[:, None], times[:, :n, :n, None]),
            (arrival[:, :, :, None] - arrival[:, :, None], times[:, None, n:, n:]),
            (arrival, direct),
        )
        straight = sum((steepness_along(*rise) for rise in rises), torch.zeros(()))
        return self.slope_weight * sloped + self.straight_weight * straight

    def _one_ball(self, rng: np.random.Generator, groups: int, n: int) -> tuple[Array, Array]:
        """Free points (groups, n, d) in balls, some near surfaces, and their clearances."""
        plan, space = self.plan, self._space
        centers = space.uniform(rng, groups, 1)
        drawn = in_balls(rng, centers, plan, n * (1 + plan.candidates))
        drawn = np.clip(drawn, space.lower, space.upper)
        clearance = space.clearance(drawn.reshape(-1, drawn.shape[-1])).reshape(drawn.shape[:2])
        near = plan.near.holds(clearance) & (rng.random(clearance.shape) < plan.near.share)
        rank = rng.random(clearance.shape) - near + 2 * (clearance <= space.least_clearance)
        chosen = np.argsort(rank, axis=1)[:, :n]
        points = np.take_along_axis(drawn, chosen[..., None], axis=1)
        found = np.take_along_axis(clearance, chosen, axis=1)
        walled = found <= space.least_clearance  # too few free ones: the center is
        points = np.where(walled[..., None], centers, points)
        at_center = space.clearance(centers[:, 0])[:, None]
        return points, np.where(walled, at_center, found)
