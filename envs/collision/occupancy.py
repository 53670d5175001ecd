"""Occupancy grids as solids: exact signed distances to their cells, and few boxes that cover them.

A cell is a solid square, or cube, of side 1 here, the first with its corner at the origin. Squares
are cubes of a single layer, which extends for ever: nothing is between them and a plane's points.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_cached, parallel_for
from envs.problem import Array

_BLOCK = 50_000
"""Points that a thread looks at at a time."""


class CellTree(NamedTuple):
    """Some cells of a grid, and at each further level which cubes of two by two by two of the level
    below hold any, up to one that holds them all.

    Attributes:
        marks: of uint8, level after level, the last axis running fastest.
        begins: (levels,) where each level begins.
        shapes: (levels, 3) cubes of each level along the axes.
    """

    marks: NDArray[np.uint8]
    begins: NDArray[np.int64]
    shapes: NDArray[np.int64]

    @staticmethod
    def of(cells: NDArray[np.bool_]) -> CellTree:
        """That of the cells (nx, ny) or (nx, ny, nz) that are marked; one is, at least."""
        level = _layered(cells)
        levels = [level]
        while level.size > 1:
            level = _halved(level)
            levels.append(level)
        sizes = [one.size for one in levels]
        return CellTree(
            np.concatenate([one.reshape(-1) for one in levels]).astype(np.uint8),
            np.cumsum([0, *sizes[:-1]]),
            np.array([one.shape for one in levels]),
        )


def _layered(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(nx, ny, nz), of which a plane is one layer."""
    return cells[:, :, None] if cells.ndim == 2 else cells


def _halved(level: NDArray[np.bool_]) -> NDArray[np.bool_]:
    for axis in range(3):
        if level.shape[axis] > 1:
            pairs = np.add.reduceat(level, np.arange(0, level.shape[axis], 2), axis=axis)
            level = pairs > 0
    return level


class CellDistances:
    """Signed distances from points to the cells of a grid that are occupied.

    Args:
        occupied: (nx, ny) or (nx, ny, nz); some are, and some are not.

    Attributes:
        occupied: the tree of those.
    """

    def __init__(self, occupied: NDArray[np.bool_]) -> None:
        self._dimension = occupied.ndim
        self.occupied, self._free = CellTree.of(occupied), CellTree.of(~occupied)

    def __call__(self, points: Array) -> Array:
        """Distances (n,) from points (n, d): exact outside, and within minus the distance to the
        nearest cell that is free, as the outside of the grid is not; 0 where free cells meet
        others. A point that is no number gives NaN."""
        in_space = np.full((len(points), 3), 0.5)
        in_space[:, : self._dimension] = points
        found = np.empty(len(points))

        def work(part: slice) -> None:
            _signed_distances(in_space[part], self.occupied, self._free, found[part])

        parallel_for(work, len(points), _BLOCK)
        return found


@njit_cached
def _signed_distances(points: Any, occupied: Any, free: Any, found: Any) -> None:
    stack = stack_for(occupied)
    for n in range(len(points)):
        x, y, z = points[n]
        if math.isnan(x) or math.isnan(y) or math.isnan(z):
            found[n] = np.nan
            continue
        distance = math.sqrt(nearest_cell(x, y, z, occupied, stack))
        found[n] = distance if distance > 0 else -math.sqrt(nearest_cell(x, y, z, free, stack))


@njit_cached
def stack_for(tree: Any) -> Any:
    """Room for a search of a tree: of each level up to seven wait while the eighth is looked
    into."""
    return np.empty((8 * len(tree.begins) + 1, 4), dtype=np.int64)


@njit_cached
def nearest_cell(x: float, y: float, z: float, tree: Any, stack: Any) -> float:
    """The square of the distance from a point to the nearest cell of a tree: the search goes into
    nearer cubes first, and leaves out those that are no nearer than what it has."""
    best = np.inf
    top = len(tree.begins) - 1
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = top, 0, 0, 0
    waiting = 1
    while waiting:
        waiting -= 1
        level, i, j, k = stack[waiting]
        square = _squared_distance(x, y, z, level, i, j, k)
        if square >= best:
            continue
        if level == 0:
            best = square
            continue
        # Which of the halves along each axis the point is in, or nearer to.
        half = float(1 << (level - 1))
        a = 1 if x > (2 * i + 1) * half else 0
        b = 1 if y > (2 * j + 1) * half else 0
        c = 1 if z > (2 * k + 1) * half else 0
        shape, begin = tree.shapes[level - 1], tree.begins[level - 1]
        for other in range(7, -1, -1):  # the last that is put there is looked at first
            u = 2 * i + (a ^ (other & 1))
            v = 2 * j + (b ^ (other >> 1 & 1))
            w = 2 * k + (c ^ (other >> 2))
            inside = u < shape[0] and v < shape[1] and w < shape[2]
            if inside and tree.marks[begin + (u * shape[1] + v) * shape[2] + w]:
                stack[waiting, 0], stack[waiting, 1] = level - 1, u
                stack[waiting, 2], stack[waiting, 3] = v, w
                waiting += 1
    return best


@njit_cached
def _squared_distance(x: float, y: float, z: float, level: int, i: int, j: int, k: int) -> float:
    side = float(1 << level)
    dx = max(i * side - x, x - (i + 1) * side, 0.0)
    dy = max(j * side - y, y - (j + 1) * side, 0.0)
    dz = max(k * side - z, z - (k + 1) * side, 0.0)
    return dx * dx + dy * dy + dz * dz


def covering_boxes(cells: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Boxes (n, 2, d) that cover the marked cells (nx, ny) or (nx, ny, nz) and no others, from a
    first cell up to, and without, a last one. They may overlap.

    Each begins at the first cell that none covers yet and grows along one axis after the other as
    far as all cells are marked: along x first, or along x last, whichever becomes larger. That
    makes no least number of boxes, which is hard to find, but few.
    """
    layered = np.ascontiguousarray(_layered(cells), dtype=np.uint8)
    found: NDArray[np.int64] = _greedy_boxes(layered)[:, :, : cells.ndim]
    return found


@njit_cached
def _greedy_boxes(cells: Any) -> Any:
    nx, ny, nz = cells.shape
    covered = np.zeros_like(cells)
    boxes = np.empty((16, 2, 3), dtype=np.int64)
    count = 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if not cells[i, j, k] or covered[i, j, k]:
                    continue
                if count == len(boxes):
                    more = np.empty((2 * count, 2, 3), dtype=np.int64)
                    more[:count] = boxes
                    boxes = more
                ahead = _grown(cells, i, j, k, False)
                other = _grown(cells, i, j, k, True)
                end = ahead if _volume(i, j, k, ahead) >= _volume(i, j, k, other) else other
                boxes[count, 0, 0], boxes[count, 0, 1], boxes[count, 0, 2] = i, j, k
                boxes[count, 1, 0], boxes[count, 1, 1], boxes[count, 1, 2] = end
                count += 1
                covered[i : end[0], j : end[1], k : end[2]] = 1
    return boxes[:count]


@njit_cached
def _grown(cells: Any, i: int, j: int, k: int, x_last: bool) -> tuple[int, int, int]:
    """Where a box ends that begins at a cell."""
    nx, ny, nz = cells.shape
    u, v, w = i + 1, j + 1, k + 1
    if x_last:
        while w < nz and cells[i, j, w]:
            w += 1
        while v < ny and _full(cells, i, u, v, v + 1, k, w):
            v += 1
        while u < nx and _full(cells, u, u + 1, j, v, k, w):
            u += 1
    else:
        while u < nx and cells[u, j, k]:
            u += 1
        while v < ny and _full(cells, i, u, v, v + 1, k, w):
            v += 1
        while w < nz and _full(cells, i, u, j, v, w, w + 1):
            w += 1
    return u, v, w


@njit_cached
def _full(cells: Any, i: int, u: int, j: int, v: int, k: int, w: int) -> bool:
    """Whether all cells are marked from (i, j, k) up to (u, v, w)."""
    for a in range(i, u):
        for b in range(j, v):
            for c in range(k, w):
                if not cells[a, b, c]:
                    return False
    return True


@njit_cached
def _volume(i: int, j: int, k: int, end: tuple[int, int, int]) -> int:
    return (end[0] - i) * (end[1] - j) * (end[2] - k)
