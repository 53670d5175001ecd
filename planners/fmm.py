"""Fast marching on a grid, the classical solver of the Eikonal equation, and steepest descent in
its field of arrival times.
"""

from __future__ import annotations

import math

import numpy as np

from envs import Environment, InputError, Problem
from envs.grid import RegularGrid
from envs.problem import Array
from envs.spaces import Kind, Space
from planners.base import Budget, Planner, PlannerResult, Status
from planners.fast_marching import SpeedGrid, default_resolution
from planners.fronts import solver_named

_MAX_NODES = 20_000_000  # of a grid that scikit-fmm solves within a few GB


class FastMarching(Planner):
    """Arrival times from the goal on a regular grid, then steepest descent from the start.

    The speed field (equation 3) is fixed per environment and computed offline; every problem has
    its own goal, so the field of arrival times is solved online.

    Args:
        resolution: grid nodes along the longest side of the bounds, see `SpeedGrid`. By default
            100 up to three dimensions, 21 in four, 11 in five, and none in more.
        order: of the finite differences, 1 or 2.
        solver: of the field: "skfmm" (scikit-fmm), or "eikonalfm", whose times are nearer the true
            ones, but which follows each front over the whole grid, in spaces that do not wrap. It
            needs the extra `eikonalfm`.

    Raises:
        InputError: an argument is out of range, or the solver's package is not installed.
    """

    improves = False

    def __init__(
        self, resolution: int | None = None, order: int = 2, solver: str = "skfmm"
    ) -> None:
        if resolution is not None and not 5 <= resolution <= 10_000:
            raise InputError(f"fmm: resolution must be between 5 and 10000, not {resolution}")
        if order not in (1, 2):
            raise InputError(f"fmm: order must be 1 or 2, not {order}")
        self._resolution = resolution
        self._order = order
        self._solver = solver_named(solver)

    def unsupported(self, env: Environment) -> str | None:
        if Kind.ROTATIONS in env.space.kinds:
            return f"no regular grid covers the rotations of {env.space}"
        if any(env.space.wraps) and not self._solver.goes_round:
            return "its solver's fronts do not go round where coordinates wrap"
        resolution = self._resolution or default_resolution(env.dimension)
        if resolution is None:
            return f"no grid of {env.dimension} dimensions is fine enough to help; set resolution"
        if resolution**env.dimension > _MAX_NODES:
            return f"a grid of {resolution}^{env.dimension} nodes is too large"
        return None

    def setup(self, env: Environment, *, seed: int) -> None:
        resolution = self._resolution or default_resolution(env.dimension)
        assert resolution is not None
        self._env = env
        self._grid = SpeedGrid(env, resolution, self._order, self._solver)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        path = self._path(problem.start, problem.goal)
        if path is None:
            return PlannerResult(Status.APPROXIMATE_SOLUTION)
        # The speed is not 0 within obstacles: what has no way round has a path through them.
        [free] = self._env.paths_are_free([path], self._env.planning_tolerance)
        return PlannerResult(Status.EXACT_SOLUTION if free else Status.APPROXIMATE_SOLUTION, path)

    def _path(self, start: Array, goal: Array) -> Array | None:
        """The path (k, d) between two configurations (d,), or None, as `descend` finds it in the
        whole field: the front is followed no farther than it needs."""
        grid = self._grid
        for most in _HORIZONS:
            times = grid.arrival_times(goal, most * grid.least_time(start, goal))
            field = RegularGrid.between(times, grid.lower, grid.upper)
            try:
                return descend(field, self._env.space, start, goal, grid.radius, grid.fastest)
            except _UnknownTimeError:
                continue
        raise AssertionError("all times are known")

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """See `planners.base.TimeFieldPlanner`."""
        times = self._grid.arrival_times(source)
        return self._grid.times_at(times, source, q), 1 / self._grid.steepness_at(times, q)


_HORIZONS = (1.5, 3.0, math.inf)
"""How far a front is followed, by the least time that it may take to the start: mostly once."""

_STEP = 0.5  # length of a step, in grid spacings
_STEP_LIMIT = 2  # by the steps that the time to a place allows at the highest speed


class _UnknownTimeError(Exception):
    """A path comes to where the front was not followed to."""


def descend(
    field: RegularGrid, space: Space, start: Array, goal: Array, radius: float, fastest: float
) -> Array | None:
    """The path (k, d) of steepest descent in a field from `start` to `goal`, or None if it gets
    stuck: if it is twice as long as a way at the speed `fastest` comes in the time at `start`.

    Goes on until `goal` is within `radius`, then straight; each step is half a spacing long, in the
    direction of the gradient half a step ahead (midpoint rule). Lengths are Euclidean in the
    coordinates times the space's weights.

    Raises:
        _UnknownTimeError: the field is NaN about a place on the way.
    """
    weights = space.weights
    length = _STEP * float((field.spacing * weights).min())
    q = np.array(start)
    path = [q]
    [time] = field.at_nearest(q[None])
    if math.isnan(time):
        raise _UnknownTimeError
    for _ in range(math.ceil(_STEP_LIMIT * (max(time, 0.0) * fastest + radius) / length)):
        if np.linalg.norm(weights * space.difference(q, goal)) <= radius:
            return np.array([*path, goal])
        direction = _downhill(field, q, weights)
        if direction is None:
            return None
        ahead = _downhill(field, _within(field, space, q + 0.5 * length * direction), weights)
        direction = direction if ahead is None else ahead
        q = _within(field, space, q + length * direction)
        path.append(q)
    return None


def _within(field: RegularGrid, space: Space, q: Array) -> Array:
    """The place within a field's bounds: the same one where a coordinate wraps, else the next."""
    inside: Array = np.clip(space.wrapped(q), field.lower, field.upper)
    return inside


def _downhill(field: RegularGrid, q: Array, weights: Array) -> Array | None:
    """The velocity (d,) of steepest descent at `q`, whose length is 1, or None where the field is
    flat."""
    gradient = field.gradient(q) / weights
    norm = float(np.sqrt(gradient @ gradient))
    if math.isnan(norm):
        raise _UnknownTimeError
    return None if norm == 0 else -gradient / norm / weights
