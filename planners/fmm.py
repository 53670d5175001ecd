"""Fast marching on a grid (scikit-fmm), the classical solver of the Eikonal equation."""

from __future__ import annotations

import numpy as np
import skfmm

from envs import Environment, InputError, Problem
from envs.problem import Array
from planners.base import Budget, Planner, PlannerResult, Status
from planners.grid_field import GridField

_MAX_NODES = 20_000_000  # of a grid that scikit-fmm solves within a few GB


class FastMarching(Planner):
    """Arrival times from the goal on a regular grid, then steepest descent from the start.

    The speed field (equation 3) is fixed per environment and computed offline; every problem has
    its own goal, so the field of arrival times is solved online.

    Args:
        resolution: grid nodes per axis.
        order: of the finite differences, 1 or 2.

    Raises:
        InputError: an argument is out of range.
    """

    def __init__(self, resolution: int = 100, order: int = 2) -> None:
        if not 5 <= resolution <= 10_000:
            raise InputError(f"fmm: resolution must be between 5 and 10000, not {resolution}")
        if order not in (1, 2):
            raise InputError(f"fmm: order must be 1 or 2, not {order}")
        self._resolution = resolution
        self._order = order

    def unsupported(self, env: Environment) -> str | None:
        nodes = self._resolution**env.dimension
        if nodes > _MAX_NODES:
            return f"a grid of {self._resolution}^{env.dimension} nodes is too large"
        return None

    def setup(self, env: Environment, *, seed: int) -> None:
        self._axes = [
            np.linspace(low, high, self._resolution)
            for low, high in zip(env.lower, env.upper, strict=True)
        ]
        self._spacing = (env.upper - env.lower) / (self._resolution - 1)
        self._lower = env.lower
        nodes = np.stack(np.meshgrid(*self._axes, indexing="ij"), axis=-1)
        speed = env.speed(nodes.reshape(-1, env.dimension))
        self._speed = speed.reshape((self._resolution,) * env.dimension)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        radius = 1.5 * float(self._spacing.max())
        times = skfmm.travel_time(
            self._distance_to(problem.goal) - radius,
            self._speed,
            dx=self._spacing,
            order=self._order,
        )
        field = GridField(np.asarray(times), self._lower, self._spacing)
        path = field.descend(problem.start, problem.goal, radius)
        if path is None:
            return PlannerResult(Status.APPROXIMATE_SOLUTION)
        return PlannerResult(Status.EXACT_SOLUTION, path)

    def _distance_to(self, goal: Array) -> Array:
        """Distances from every node to `goal`: its level set of `radius` is where fronts start,
        a sphere about the exact goal rather than a cell."""
        squares = [(axis - x) ** 2 for axis, x in zip(self._axes, goal, strict=True)]
        total = squares[0]
        for square in squares[1:]:
            total = total[..., None] + square
        distance: Array = np.sqrt(total)
        return distance
