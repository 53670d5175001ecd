"""Training points: configurations and their speeds, never a path or a travel time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.problem import Array


@dataclass(frozen=True)
class Scale:
    """Between an environment's configurations and the networks' space, where the longest side of
    the bounds is 1 and their middle is the origin.

    `middle` is (d,), `extent` the length of the longest side, in the environment's unit.
    """

    middle: Array
    extent: float

    @staticmethod
    def of(env: Environment) -> Scale:
        """The scale of an environment's bounds."""
        return Scale((env.lower + env.upper) / 2, float((env.upper - env.lower).max()))

    def shrink(self, q: Array) -> Array:
        """Configurations (..., d) in the networks' space."""
        scaled: Array = (q - self.middle) / self.extent
        return scaled

    def grow(self, x: Array) -> Array:
        """Configurations (..., d) in the environment's unit."""
        grown: Array = x * self.extent + self.middle
        return grown


@dataclass(frozen=True)
class GroupPlan:
    """How groups of points are drawn.

    A group is trained on all pairs of its starts and goals. Half of the groups are balls of
    log-uniform radius round a point, so that near and far pairs count alike; the others spread
    over the whole space. Lengths are in the networks' space.
    """

    groups: int = 32
    starts: int = 12
    goals: int = 12
    local_share: float = 0.5
    least_radius: float = 0.01
    greatest_radius: float = 0.5
    near_share: float = 0.3
    """Share of the points that are drawn near the surface of obstacles."""
    nearest: float = -0.01
    farthest: float = 0.09
    candidates: int = 3
    """Further points drawn for each, among which those near a surface are sought."""

    @property
    def points(self) -> int:
        """In a group."""
        return self.starts + self.goals


class PointSampler:
    """Draws configurations, some of them near surfaces.

    Args:
        lower, upper: (d,) bounds in the networks' space.
        clearance: (n, d) -> (n,), in the networks' space and unit.
        near_share: share of the points that lie near the surface of obstacles.
        nearest, farthest: what near means.
    """

    _CANDIDATES = 8  # drawn for each near point, among which near ones are sought

    def __init__(
        self,
        lower: Array,
        upper: Array,
        clearance: Callable[[Array], Array],
        near_share: float = 0.3,
        nearest: float = -0.01,
        farthest: float = 0.09,
    ) -> None:
        self._lower = lower
        self._upper = upper
        self._clearance = clearance
        self._near_share = near_share
        self._nearest = nearest
        self._farthest = farthest

    @staticmethod
    def of(env: Environment) -> PointSampler:
        """A sampler of an environment's configurations."""
        scale = Scale.of(env)
        return PointSampler(
            scale.shrink(env.lower),
            scale.shrink(env.upper),
            lambda x: env.clearance(scale.grow(x)) / scale.extent,
        )

    def draw(self, rng: np.random.Generator, n: int) -> Array:
        """Points (n, d) in random order, in the networks' space."""
        wanted = round(self._near_share * n)
        candidates = rng.uniform(
            self._lower, self._upper, (self._CANDIDATES * wanted, len(self._lower))
        )
        clearance = self._clearance(candidates)
        near = candidates[(clearance > self._nearest) & (clearance < self._farthest)][:wanted]
        spread = rng.uniform(self._lower, self._upper, (n - len(near), len(self._lower)))
        return rng.permutation(np.concatenate([near, spread]))


class GroupSampler:
    """Draws groups of configurations with the speed at each.

    Args:
        lower, upper: (d,) bounds in the networks' space.
        clearance: (n, d) -> (n,), in the networks' space and unit.
        speed: clearances of any shape to speeds in 0..1.
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        clearance: Callable[[Array], Array],
        speed: Callable[[Array], Array],
        plan: GroupPlan,
    ) -> None:
        self._lower = lower
        self._upper = upper
        self._clearance = clearance
        self._speed = speed
        self._plan = plan

    @staticmethod
    def of(env: Environment, plan: GroupPlan) -> GroupSampler:
        """A sampler of an environment's configurations and speeds."""
        scale = Scale.of(env)
        return GroupSampler(
            scale.shrink(env.lower),
            scale.shrink(env.upper),
            lambda x: env.clearance(scale.grow(x)) / scale.extent,
            lambda clearance: env.speed_model(clearance * scale.extent),
            plan,
        )

    def draw(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Points (groups, starts + goals, d) and their log speeds (groups, starts + goals)."""
        plan = self._plan
        drawn = self._candidates(rng, plan.points * (1 + plan.candidates))
        flat = drawn.reshape(-1, drawn.shape[-1])
        clearance = self._clearance(flat).reshape(drawn.shape[:2])
        chosen = self._choose(rng, clearance)
        points = np.take_along_axis(drawn, chosen[..., None], axis=1)
        speeds = self._speed(np.take_along_axis(clearance, chosen, axis=1))
        return points, np.log(speeds)

    def _candidates(self, rng: np.random.Generator, n: int) -> Array:
        plan, d = self._plan, len(self._lower)
        local = round(plan.local_share * plan.groups)
        centers = rng.uniform(self._lower, self._upper, (local, 1, d))
        ends = math.log(plan.least_radius), math.log(plan.greatest_radius)
        radii = np.exp(rng.uniform(*ends, (local, 1, 1)))
        direction = rng.normal(size=(local, n, d))
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        balls = centers + radii * direction * rng.random((local, n, 1)) ** (1 / d)
        spread = rng.uniform(self._lower, self._upper, (plan.groups - local, n, d))
        return np.concatenate([np.clip(balls, self._lower, self._upper), spread])

    def _choose(self, rng: np.random.Generator, clearance: Array) -> NDArray[np.int64]:
        """Indices (groups, points): the first candidates, some replaced by ones near a surface."""
        plan = self._plan
        spare = clearance[:, plan.points :]
        near = (spare > plan.nearest) & (spare < plan.farthest)
        order = np.argsort(np.where(near, rng.random(near.shape), 2.0), axis=1)[:, : plan.points]
        order = rng.permuted(order, axis=1)  # else starts would get more of the near ones
        replace = rng.random(order.shape) < plan.near_share
        replace &= np.take_along_axis(near, order, axis=1)
        own = np.broadcast_to(np.arange(plan.points), order.shape)
        replaced: NDArray[np.int64] = np.where(replace, order + plan.points, own)
        return replaced
