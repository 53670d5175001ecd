"""Training points: configurations and their speeds, never a path or a travel time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.problem import Array
from planners.scale import Scale


@dataclass(frozen=True)
class NearSurfaces:
    """Which points count as near the surface of obstacles, and how many are drawn there.

    Attributes:
        share: of all points.
        nearest, farthest: clearances, by d_max of the speed model.
    """

    share: float = 0.3
    nearest: float = -0.1
    farthest: float = 0.9

    def holds(self, clearance: Array) -> NDArray[np.bool_]:
        """Which clearances, by d_max, are near, in their shape."""
        near: NDArray[np.bool_] = (clearance > self.nearest) & (clearance < self.farthest)
        return near


@dataclass(frozen=True)
class Space:
    """What samplers see of an environment.

    Attributes:
        lower, upper: (d,) corners of what holds all of free space, in the networks' space.
        clearance: (n, d) in the networks' space -> (n,), by d_max of the speed model.
        speed: clearances of any shape, by d_max, to speeds in 0..1.
        least_clearance: by d_max, of points that are drawn at all. In rooms 0: what a field would
            be within walls matters to no path, and is hard to learn.
    """

    lower: Array
    upper: Array
    clearance: Callable[[Array], Array]
    speed: Callable[[Array], Array]
    least_clearance: float = -math.inf

    @staticmethod
    def of(env: Environment) -> Space:
        """That of an environment."""
        scale = Scale.of(env)
        d_max = env.speed_model.d_max
        lower, upper = (scale.shrink(corner) for corner in env.free_bounds)
        return Space(
            lower,
            upper,
            lambda x: env.rough_clearance(scale.grow(x)) / d_max,
            lambda clearance: env.speed_model(clearance * d_max),
            0.0 if env.enclosed else -math.inf,
        )

    def uniform(self, rng: np.random.Generator, *shape: int) -> Array:
        """Points (*shape, d) anywhere between the corners where they may be drawn."""
        points = rng.uniform(self.lower, self.upper, (math.prod(shape), len(self.lower)))
        if self.least_clearance > -math.inf:
            left = np.flatnonzero(self.clearance(points) <= self.least_clearance)
            while len(left) > 0:
                points[left] = rng.uniform(self.lower, self.upper, (len(left), len(self.lower)))
                left = left[self.clearance(points[left]) <= self.least_clearance]
        return points.reshape(*shape, len(self.lower))


@dataclass(frozen=True)
class GroupPlan:
    """How groups of points are drawn.

    A group is trained on all pairs of its starts and goals: more pairs for nearly the same cost, as
    long as groups are small. Half of the groups lie in balls of log-uniform radius round a point,
    so that near and far pairs count alike; the others spread over the whole space. Lengths are in
    the networks' space.
    """

    groups: int = 128
    starts: int = 3
    goals: int = 3
    local_share: float = 0.5
    least_radius: float = 0.01
    greatest_radius: float = 0.5
    near: NearSurfaces = NearSurfaces(0.5, farthest=1.1)
    candidates: int = 3
    """Further points drawn for each, among which those near a surface are sought."""

    @property
    def points(self) -> int:
        """In a group."""
        return self.starts + self.goals


class PointSampler:
    """Draws configurations, some of them near surfaces."""

    _CANDIDATES = 8  # drawn for each near point, among which near ones are sought

    def __init__(self, space: Space, near: NearSurfaces = NearSurfaces()) -> None:
        self._space = space
        self._near = near

    def draw(self, rng: np.random.Generator, n: int) -> Array:
        """Points (n, d) in random order, in the networks' space."""
        wanted = round(self._near.share * n)
        candidates = self._space.uniform(rng, self._CANDIDATES * wanted)
        near = candidates[self._near.holds(self._space.clearance(candidates))][:wanted]
        return rng.permutation(np.concatenate([near, self._space.uniform(rng, n - len(near))]))


def in_balls(rng: np.random.Generator, centers: Array, plan: GroupPlan, n: int) -> Array:
    """Points (g, n, d), uniform in balls of log-uniform radius about `centers` (g, 1, d)."""
    groups, _, d = centers.shape
    ends = math.log(plan.least_radius), math.log(plan.greatest_radius)
    radii = np.exp(rng.uniform(*ends, (groups, 1, 1)))
    direction = rng.normal(size=(groups, n, d))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    points: Array = centers + radii * direction * rng.random((groups, n, 1)) ** (1 / d)
    return points


class GroupSampler:
    """Draws groups of configurations with the speed at each."""

    def __init__(self, space: Space, plan: GroupPlan) -> None:
        self._space = space
        self._plan = plan

    def draw(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Points (groups, starts + goals, d) and their log speeds (groups, starts + goals)."""
        plan = self._plan
        drawn = self._candidates(rng, plan.points * (1 + plan.candidates))
        flat = drawn.reshape(-1, drawn.shape[-1])
        clearance = self._space.clearance(flat).reshape(drawn.shape[:2])
        chosen = self._choose(rng, clearance)
        points = np.take_along_axis(drawn, chosen[..., None], axis=1)
        speeds = self._space.speed(np.take_along_axis(clearance, chosen, axis=1))
        return points, np.log(speeds)

    def _candidates(self, rng: np.random.Generator, n: int) -> Array:
        plan, space = self._plan, self._space
        local = round(plan.local_share * plan.groups)
        centers = space.uniform(rng, local, 1)
        balls = in_balls(rng, centers, plan, n)
        spread = space.uniform(rng, plan.groups - local, n)
        return np.concatenate([np.clip(balls, space.lower, space.upper), spread])

    def _choose(self, rng: np.random.Generator, clearance: Array) -> NDArray[np.int64]:
        """Indices (groups, points): the first candidates, some replaced by ones near a surface."""
        plan = self._plan
        spare = clearance[:, plan.points :]
        near = plan.near.holds(spare)
        order = np.argsort(np.where(near, rng.random(near.shape), 2.0), axis=1)[:, : plan.points]
        order = rng.permuted(order, axis=1)  # else starts would get more of the near ones
        replace = rng.random(order.shape) < plan.near.share
        replace &= np.take_along_axis(near, order, axis=1)
        own = np.broadcast_to(np.arange(plan.points), order.shape)
        replaced: NDArray[np.int64] = np.where(replace, order + plan.points, own)
        return replaced
