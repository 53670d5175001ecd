"""Signed distances for many points at once, for learning, grids and sampling of problems: in closed
form, and at all nodes of a regular grid for the cost of a few.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Box, Mesh
from envs.compiled import njit_cached, njit_hot
from envs.grid import RegularGrid
from envs.problem import Array


def signed_distance_to_boxes(points: Array, boxes: Sequence[Box]) -> Array:
    """Signed distance (n,) from points (n, 3) to the surface of a union of solid boxes.

    Exact outside the union. Inside it is negative and at most the true depth in size, exact where
    boxes do not overlap. No boxes give +inf, and a point that is no number gives NaN.
    """
    return distance_to_boxes(points, *box_arrays(boxes))


def box_arrays(boxes: Sequence[Box]) -> tuple[Array, Array]:
    """Centres and halves of the sides of boxes, (m, 3) each."""
    centers = np.array([box.center for box in boxes]).reshape(-1, 3)
    return centers, np.array([box.sides / 2 for box in boxes]).reshape(-1, 3)


def distance_to_boxes(points: Array, centers: Array, halves: Array) -> Array:
    """`signed_distance_to_boxes`, given `box_arrays`: for who asks about few points, for which
    these take most of the time."""
    found = np.full(len(points), np.inf)
    if len(centers):
        _to_nearest_box(np.asarray(points, dtype=np.float64), centers, halves, found)
    return found


@njit_hot
def _to_nearest_box(points: Any, centers: Any, halves: Any, found: Any) -> None:
    """Writes the distances of points (n, 3) to boxes (m, 3)."""
    for i in range(len(points)):
        found[i] = to_boxes(points[i, 0], points[i, 1], points[i, 2], centers, halves)


@njit_hot
def to_boxes(x: float, y: float, z: float, centers: Any, halves: Any) -> float:
    """The signed distance of a point to boxes (m, 3). Not in quick arithmetic: its rounding, hence
    every sampled problem, shall be the same on every machine, and it is FCL's to the last bit."""
    if math.isnan(x) or math.isnan(y) or math.isnan(z):
        return math.nan  # comparisons would leave it infinitely far
    least = math.inf
    for box in range(len(centers)):
        dx = abs(x - centers[box, 0]) - halves[box, 0]
        dy = abs(y - centers[box, 1]) - halves[box, 1]
        dz = abs(z - centers[box, 2]) - halves[box, 2]
        inside = min(max(dx, dy, dz), 0.0)
        dx, dy, dz = max(dx, 0.0), max(dy, 0.0), max(dz, 0.0)
        least = min(least, math.sqrt(dx * dx + dy * dy + dz * dz) + inside)
    return least


_BLOCK = 1_000_000  # points at a time


def distance_transform(
    surface: Mesh,
    closest: Callable[[Array], Array],
    is_negative: Callable[[Array], NDArray[np.bool_]],
    axes: Sequence[Array],
) -> Array:
    """Signed distances (nx, ny, nz) on the nodes of three evenly spaced axes.

    They are exact at nodes beside the surface. Each other node takes the nearest of the points of
    the surface that are closest to the nodes beside it which are nearest to itself and to its
    neighbours: a distance transform (Danielsson 1980) with points of the surface for cells. That
    is never too small, and hardly ever by more than half a spacing too great.

    Args:
        closest: points (n, 3) to the closest ones of the surface, (n, 3).
        is_negative: points (n, 3) to whether distances there are negative, (n,).
    """
    from scipy import ndimage  # a third of a second, which most workers can save

    lower = np.array([axis[0] for axis in axes])
    spacing = np.array([axis[1] - axis[0] for axis in axes])
    beside = _beside(surface, lower, spacing, tuple(len(axis) for axis in axes))
    nodes: Array = lower + spacing * np.argwhere(beside)
    row = np.cumsum(beside, dtype=np.int32).reshape(beside.shape) - 1
    nearest = ndimage.distance_transform_edt(
        ~beside, sampling=spacing, return_distances=False, return_indices=True
    )
    rows = row[tuple(nearest)]
    sign = np.where(is_negative(nodes), -1.0, 1.0)
    found: Array = _nearest_points(rows, closest(nodes), sign, lower, spacing)
    return found


def _beside(
    surface: Mesh, lower: Array, spacing: Array, shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """The nodes next to a surface, and their neighbours."""
    beside = np.zeros(shape, dtype=np.bool_)
    grid = RegularGrid(beside, lower, spacing, 1 / spacing)
    for points in _covering(surface, float(spacing.min())):
        index = grid.nearest(points)
        index = index[((index >= 0) & (index < shape)).all(axis=1)]
        beside[tuple(index.T)] = True
    from scipy import ndimage

    wider: NDArray[np.bool_] = ndimage.binary_dilation(beside, np.ones((3, 3, 3)))
    return wider


def _covering(surface: Mesh, spacing: float) -> Iterator[Array]:
    """Points (n, 3) of a surface, such that none of it is farther than `spacing` from one."""
    corners = surface.vertices[surface.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(longest / spacing), 1).astype(int)
    for n in np.unique(parts):
        some = corners[parts == n]
        steps = [(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]
        weights = np.array(steps) / n
        for block in np.array_split(some, 1 + len(some) * len(weights) // _BLOCK):
            yield np.einsum("wc,fcd->fwd", weights, block).reshape(-1, 3)


@njit_cached
def _nearest_points(rows: Any, points: Any, sign: Any, lower: Any, spacing: Any) -> Any:
    """Signed distances on the nodes to the nearest among the points (m, 3) that are named by
    `rows` (nx, ny, nz) at a node and its six neighbours."""
    nx, ny, nz = rows.shape
    found = np.empty(rows.shape)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                x = lower[0] + i * spacing[0]
                y = lower[1] + j * spacing[1]
                z = lower[2] + k * spacing[2]
                least = np.inf
                for n in range(7):
                    a = i + (n == 1) - (n == 2)
                    b = j + (n == 3) - (n == 4)
                    c = k + (n == 5) - (n == 6)
                    if 0 <= a < nx and 0 <= b < ny and 0 <= c < nz:
                        p = points[rows[a, b, c]]
                        squared = (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2
                        least = min(least, squared)
                found[i, j, k] = sign[rows[i, j, k]] * np.sqrt(least)
    return found
