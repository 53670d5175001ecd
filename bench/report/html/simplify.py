"""Paths and surfaces with fewer points than they came with, for display."""

from __future__ import annotations

import math

import numpy as np
import trimesh
from numpy.typing import NDArray

from envs.problem import Array

_FIRST_CELL, _GROWTH = 0.5, 1.2
"""The first grid's cells, by the side of a square with two of the faces that are wanted; and how
much larger those of the next one are."""


def thinned(path: Array, tolerance: float) -> Array:
    """Some points (m, 3) of a curve (k, 3), its ends among them, from whose lines no other is
    farther than `tolerance`.

    D. H. Douglas and T. K. Peucker, "Algorithms for the reduction of the number of points required
    to represent a digitized line", Cartographica 1973.
    """
    kept = {0, len(path) - 1}
    waiting = [(0, len(path) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        off = _distances(path[first + 1 : last], path[first], path[last])
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            kept.add(middle)
            waiting += [(first, middle), (middle, last)]
    return path[sorted(kept)]


def _distances(points: Array, a: Array, b: Array) -> Array:
    """From points (n, 3) to the segment between a and b (3,)."""
    step = b - a
    shares = ((points - a) @ step / max(float(step @ step), 1e-300)).clip(0, 1)
    distances: Array = np.linalg.norm(points - (a + shares[:, None] * step), axis=1)
    return distances


def simplified(triangles: Array, most: int) -> trimesh.Trimesh:
    """The surface of triangles (n, 3, 3) with at most so many faces: as it is if it has no more,
    or with all corners within a cell of a grid put together in their middle. That works for any
    triangles, those of a scan that no edge collapse could begin with included.

    J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes",
    1993.
    """
    corners, numbers = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = numbers.reshape(-1, 3).astype(np.int64)
    mesh = trimesh.Trimesh(corners, faces, process=False)
    cell = _FIRST_CELL * math.sqrt(2 * mesh.area / most)
    while len(mesh.faces) > most:
        mesh = _clustered(corners, faces, cell)
        cell *= _GROWTH
    return mesh


def _clustered(corners: Array, faces: NDArray[np.int64], cell: float) -> trimesh.Trimesh:
    """`faces` (n, 3) between the middles of the corners (k, 3) in each cell of a grid, where they
    are still triangles."""
    cells = np.floor((corners - corners.min(axis=0)) / cell).astype(np.int64)
    _, of, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    of = of.reshape(-1)
    middles = np.stack([np.bincount(of, axis) for axis in corners.T], axis=1) / counts[:, None]
    left = of[faces]
    left = left[(left != np.roll(left, 1, axis=1)).all(axis=1)]
    _, once = np.unique(np.sort(left, axis=1), axis=0, return_index=True)
    return trimesh.Trimesh(middles, left[np.sort(once)], process=False)
