"""Arrival times on a grid of the speed field, by fast marching."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from envs import Environment
from envs.grid import node_axes, node_positions
from envs.problem import Array
from planners.fronts import SKFMM, FrontSolver, Medium, Source

_BY_DIMENSION = {4: 21, 5: 11}
"""Nodes along a side by default, where 100 are too many: a few seconds a problem."""


def default_resolution(dimension: int) -> int | None:
    """Nodes along a side, if a grid of that dimension is worth solving."""
    return 100 if dimension <= 3 else _BY_DIMENSION.get(dimension)


class SpeedGrid:
    """An environment's speeds (equation 3) on the nodes of a regular grid over its free space.

    Lengths are Euclidean in the coordinates times their weights, also where the space adds up the
    lengths of several parts. Along a coordinate that wraps, the last node is the first, and fronts
    go on there.

    Args:
        env: whose space has no rotations.
        resolution: nodes along the longest side of the environment's bounds. Where free space is
            known to be smaller (`Environment.free_bounds`) there are fewer, as far apart.
        order: of the finite differences, 1 or 2.
        solver: of the arrival times; it must go round where the space wraps.

    Attributes:
        lower, upper: (d,) the first node and the last.
        spacing: (d,) between nodes, in lengths.
        radius: of the sphere about the exact goal on which fronts start.
        fastest: the highest speed on the nodes.
    """

    def __init__(
        self, env: Environment, resolution: int, order: int, solver: FrontSolver = SKFMM
    ) -> None:
        self._space = env.sampling_space
        self._weights = self._space.weights
        longest = float(((env.upper - env.lower) * self._weights).max())
        self.lower, self.upper = self._space.lower, self._space.upper
        sides = (self.upper - self.lower) * self._weights
        cells = np.maximum(np.ceil(sides / longest * (resolution - 1) - 1e-6).astype(int), 4)
        self._axes = node_axes(self.lower, self.upper, cells + 1)
        self._once = [
            axis[:-1] if wraps else axis
            for axis, wraps in zip(self._axes, self._space.wraps, strict=True)
        ]
        self._env = env
        self._solver = solver
        self.spacing: Array = sides / cells
        self.radius = 1.5 * float(self.spacing.max())
        # A slice of nodes at a time: in many dimensions all of them take more room than the speeds.
        speed = np.stack([self._speeds(x) for x in self._once[0]])
        self._medium = Medium(speed, self.spacing, tuple(self._space.wraps), order)
        self.fastest = float(speed.max())

    def _speeds(self, first: float) -> Array:
        """Speeds on the nodes with a first coordinate, one axis for each of the others."""
        nodes = node_positions([np.array([first]), *self._once[1:]])
        speed = self._env.speed_on_grid(nodes.reshape(-1, self._env.dimension))
        return speed.reshape(nodes.shape[1:-1])

    def arrival_times(self, goal: Array, until: float = np.inf) -> Array:
        """Times on the nodes, one axis a dimension, at which a front that leaves the sphere of
        `radius` about `goal` (d,) arrives; negative within.

        They may be NaN on nodes at which it arrives later than `until`, if the solver follows the
        front no farther. The others do not depend on that.
        """
        [speed] = self._env.speed(goal[None])
        place = (goal - self.lower) * self._weights / self.spacing
        outside = self._distance_to(goal) - self.radius
        source = Source(place, float(speed), self.radius, outside)
        whole = self._solver.arrival_times(self._medium, source, until)
        return np.pad(whole, [(0, int(wraps)) for wraps in self._space.wraps], mode="wrap")

    def least_time(self, start: Array, goal: Array) -> float:
        """What a front takes at least from its sphere about `goal` (d,) to `start` (d,)."""
        distance = np.linalg.norm(self._weights * self._space.difference(start, goal))
        return max(float(distance) - self.radius, self.radius) / self.fastest

    def times_at(self, times: Array, goal: Array, q: Array) -> Array:
        """Arrival times (n,) at configurations (n, d) within the bounds, from those on the nodes,
        with the time that the front takes within its sphere about `goal` (d,)."""
        [speed] = self._env.speed(goal[None])
        at_q: Array = self._interpolated(times, q) + self.radius / speed
        return at_q

    def steepness_at(self, times: Array, q: Array) -> Array:
        """|grad T| (n,) at configurations (n, d): central differences on the nodes."""
        by_axis = [
            np.asarray(np.gradient(times, h, axis=axis)) for axis, h in enumerate(self.spacing)
        ]
        slopes = [self._interpolated(slope, q) for slope in by_axis]
        steepness: Array = np.linalg.norm(slopes, axis=0)
        return steepness

    def _interpolated(self, values: Array, q: Array) -> Array:
        """`values` on the nodes, multilinearly at configurations (n, d)."""
        from scipy.interpolate import (
            RegularGridInterpolator,  # half a second; planning does without
        )

        upper = [axis[-1] for axis in self._axes]
        found: Array = RegularGridInterpolator(self._axes, values)(np.clip(q, self.lower, upper))
        return found

    def _distance_to(self, goal: Array) -> Array:
        """Distances from every node to `goal`: fronts start from the exact one, rather than
        from a cell."""
        places = zip(self._once, goal, self._weights, self._space.wraps, strict=True)
        total = _outer_sum([(w * _apart(axis, x, wraps)) ** 2 for axis, x, w, wraps in places])
        distance: Array = np.sqrt(total)
        return distance


def _apart(axis: Array, x: float, wraps: bool) -> Array:
    """The differences of the nodes of an axis from a coordinate, the short way where it wraps."""
    apart: Array = axis - x
    if wraps:
        apart -= 2 * np.pi * np.rint(apart / (2 * np.pi))
    return apart


def _outer_sum(terms: Sequence[Array]) -> Array:
    total = terms[0]
    for term in terms[1:]:
        total = total[..., None] + term
    return total
