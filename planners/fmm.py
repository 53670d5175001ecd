"""Fast marching on a grid (scikit-fmm), the classical solver of the Eikonal equation."""

from __future__ import annotations

from envs import Environment, InputError, Problem
from envs.problem import Array
from planners.base import Budget, Planner, PlannerResult, Status
from planners.fast_marching import SpeedGrid, default_resolution
from planners.grid_field import GridField

_MAX_NODES = 20_000_000  # of a grid that scikit-fmm solves within a few GB


class FastMarching(Planner):
    """Arrival times from the goal on a regular grid, then steepest descent from the start.

    The speed field (equation 3) is fixed per environment and computed offline; every problem has
    its own goal, so the field of arrival times is solved online.

    Args:
        resolution: grid nodes along the longest side of the bounds, see `SpeedGrid`. By default
            100 up to three dimensions, 21 in four, 11 in five, and none in more.
        order: of the finite differences, 1 or 2.

    Raises:
        InputError: an argument is out of range.
    """

    improves = False

    def __init__(self, resolution: int | None = None, order: int = 2) -> None:
        if resolution is not None and not 5 <= resolution <= 10_000:
            raise InputError(f"fmm: resolution must be between 5 and 10000, not {resolution}")
        if order not in (1, 2):
            raise InputError(f"fmm: order must be 1 or 2, not {order}")
        self._resolution = resolution
        self._order = order

    def unsupported(self, env: Environment) -> str | None:
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
        self._grid = SpeedGrid(env, resolution, self._order)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        grid = self._grid
        field = GridField(grid.arrival_times(problem.goal), grid.lower, grid.spacing)
        path = field.descend(problem.start, problem.goal, grid.radius)
        if path is None:
            return PlannerResult(Status.APPROXIMATE_SOLUTION)
        # The speed is not 0 within obstacles: what has no way round has a path through them.
        [free] = self._env.paths_are_free([path], self._env.planning_tolerance)
        return PlannerResult(Status.EXACT_SOLUTION if free else Status.APPROXIMATE_SOLUTION, path)

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """See `planners.time_field.TimeFieldPlanner`."""
        times = self._grid.arrival_times(source)
        return self._grid.times_at(times, source, q), 1 / self._grid.steepness_at(times, q)
