"""Values on the nodes of regular grids: where the nodes are, which is nearest to a place, and what
is between them.

Places are (n, d) or, in compiled code, x, y and z. Beyond a grid, its border goes on.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_inline
from envs.problem import Array


class RegularGrid(NamedTuple):
    """Values on the nodes of a regular grid, as Python and compiled code see them.

    Attributes:
        values: (n0, n1, ...) on the nodes, an axis a dimension.
        lower: (d,) the first node.
        spacing: (d,) from a node to the next.
        per_unit: (d,) nodes by length, with which millions of look-ups spare a division.
    """

    values: NDArray[Any]
    lower: Array
    spacing: Array
    per_unit: Array

    @staticmethod
    def between(values: NDArray[Any], lower: Array, upper: Array) -> RegularGrid:
        """That whose first and last nodes are two corners (d,)."""
        cells = np.array(values.shape) - 1
        return RegularGrid(values, lower, (upper - lower) / cells, cells / (upper - lower))

    @staticmethod
    def sampled(
        function: Callable[[Array], Array], lower: Array, upper: Array, spacing: float
    ) -> RegularGrid:
        """The values of a function (n, d) -> (n,) in single precision, with nodes at most `spacing`
        apart from one corner (d,) to the other.

        Interpolated, one that changes no faster than its argument moves is off by at most
        sqrt(d) / 2 spacings: the corners of a cell, weighted as they are, lie no farther than that
        from a point of it in the root mean square.
        """
        nodes = node_positions(node_axes(lower, upper, node_counts(lower, upper, spacing)))
        values = function(nodes.reshape(-1, nodes.shape[-1])).reshape(nodes.shape[:-1])
        return RegularGrid.between(values.astype(np.float32), lower, upper)

    @property
    def upper(self) -> Array:
        """The last node (d,)."""
        last: Array = self.lower + self.spacing * (np.array(self.values.shape) - 1)
        return last

    def nearest(self, q: Array) -> NDArray[np.int64]:
        """The numbers (n, d) of the nodes nearest to places (n, d), if the grid went on."""
        numbers: NDArray[np.int64] = np.rint((q - self.lower) / self.spacing).astype(np.int64)
        return numbers

    def at_nearest(self, q: Array) -> NDArray[Any]:
        """The values (n,) of the nodes nearest to places (n, d)."""
        numbers = tuple(self.nearest(q).T)
        places = np.ravel_multi_index(numbers, self.values.shape, mode="clip")
        found: NDArray[Any] = self.values.reshape(-1)[places]
        return found

    def interpolate(self, q: Array) -> Array:
        """Values (n,) at places (n, d), multilinearly between the nodes."""
        from scipy import ndimage  # a third of a second, which most workers can save

        at = ((q - self.lower) * self.per_unit).T
        found: Array = ndimage.map_coordinates(
            self.values, at, output=np.float64, order=1, mode="nearest"
        )
        return found

    def gradient(self, q: Array) -> Array:
        """The gradient (d,) at a place (d,): central differences at the corners of its cell,
        multilinearly between them."""
        corners, axes = _corners(self.values.ndim)
        last = np.array(self.values.shape) - 1
        position = (q - self.lower) / self.spacing
        cell = np.clip(position.astype(int), 0, last - 1)
        share = position - cell
        weights = np.prod(np.where(corners == 1, share, 1 - share), axis=1)
        nodes = (cell + corners)[:, None]
        above, below = np.minimum(nodes + axes, last), np.maximum(nodes - axes, 0)
        rise = self._at(above) - self._at(below)
        run = np.diagonal(above - below, axis1=1, axis2=2) * self.spacing
        gradient: Array = weights @ (rise / run)
        return gradient

    def _at(self, nodes: NDArray[np.int64]) -> Array:
        values: Array = self.values[tuple(np.moveaxis(nodes, -1, 0))]
        return values


@cache
def _corners(dimension: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The corners (2^d, d) of a cell from its first one, and a step (d, d) along each axis."""
    corners = np.array(list(itertools.product((0, 1), repeat=dimension)))
    return corners, np.eye(dimension, dtype=np.int64)


def node_counts(lower: Array, upper: Array, spacing: float) -> NDArray[np.int64]:
    """How many nodes (d,) lie along each axis between two corners (d,), at most `spacing` apart."""
    counts: NDArray[np.int64] = np.ceil((upper - lower) / spacing).astype(np.int64) + 1
    return counts


def node_axes(lower: Array, upper: Array, counts: Sequence[int] | NDArray[np.int64]) -> list[Array]:
    """Where `counts` (d,) nodes are along each axis, from one corner (d,) to the other."""
    return [np.linspace(a, b, n) for a, b, n in zip(lower, upper, counts, strict=True)]


def node_positions(axes: Sequence[Array]) -> Array:
    """Where the nodes are, (n0, n1, ..., d), the last axis running fastest."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def cells_of(points: Array, lower: Array, side: float) -> NDArray[np.int64]:
    """The numbers (n, d) of the cubes of a side, the first with its corner at `lower` (d,), that
    points (n, d) are in."""
    cells: NDArray[np.int64] = np.floor((points - lower) / side).astype(np.int64)
    return cells


# Compiled, in three dimensions. They become part of their callers, and round as these are compiled.


@njit_inline
def trilinear(grid: Any, x: float, y: float, z: float) -> float:
    """The value of a `RegularGrid` at a place, between its nodes."""
    values = grid.values
    nx, ny, nz = values.shape
    x = min(max((x - grid.lower[0]) * grid.per_unit[0], 0.0), nx - 1.0)
    y = min(max((y - grid.lower[1]) * grid.per_unit[1], 0.0), ny - 1.0)
    z = min(max((z - grid.lower[2]) * grid.per_unit[2], 0.0), nz - 1.0)
    i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
    u, v, w = x - i, y - j, z - k
    total = 0.0
    for a in range(2):
        for b in range(2):
            along_z = values[i + a, j + b, k] * (1 - w) + values[i + a, j + b, k + 1] * w
            total += (u if a else 1 - u) * (v if b else 1 - v) * along_z
    return total


@njit_inline
def distance_beyond(grid: Any, x: float, y: float, z: float) -> float:
    """How far a place is from what is between a grid's nodes, 0 within."""
    nx, ny, nz = grid.values.shape
    u, v, w = x - grid.lower[0], y - grid.lower[1], z - grid.lower[2]
    u -= min(max(u * grid.per_unit[0], 0.0), nx - 1.0) / grid.per_unit[0]
    v -= min(max(v * grid.per_unit[1], 0.0), ny - 1.0) / grid.per_unit[1]
    w -= min(max(w * grid.per_unit[2], 0.0), nz - 1.0) / grid.per_unit[2]
    return math.sqrt(u * u + v * v + w * w)


@njit_inline
def central_differences(
    look_up: Any, field: Any, per_unit: Any, x: float, y: float, z: float, slope: Any
) -> None:
    """Writes the gradient (3,) of `look_up(field, x, y, z)` at a place: from a node's spacing on
    either side of it along each axis, of which there are `per_unit` (3,)."""
    for axis in range(3):
        h = 1 / per_unit[axis]
        dx, dy, dz = h * (axis == 0), h * (axis == 1), h * (axis == 2)
        above = look_up(field, x + dx, y + dy, z + dz)
        below = look_up(field, x - dx, y - dy, z - dz)
        slope[axis] = (above - below) / (2 * h)
