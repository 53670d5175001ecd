"""Where surfaces are not closed: what touches nothing comes to their other side nowhere else than
beside edges that are open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Mesh
from envs.compiled import njit_hot
from envs.problem import Array


class CellsBesideEdges(NamedTuple):
    """The cells of a grid that may be near open edges.

    Attributes:
        beside: (nx, ny, nz) of bool.
        origin: (3,) where the first cell begins.
        side: of a cell.
    """

    beside: NDArray[np.bool_]
    origin: Array
    side: float


_MOST = 256
"""Cells along an axis."""

NO_CELLS = CellsBesideEdges(np.zeros((1, 1, 1), dtype=np.bool_), np.zeros(3), 1.0)


def cells_beside(surfaces: Sequence[Mesh], reach: float) -> CellsBesideEdges:
    """Those in which a place is as near as `reach` to an open edge of a surface, or up to half a
    cell's side farther away; their sides are of half of `reach`, or a `_MOST`th of the grid's."""
    from scipy.ndimage import distance_transform_edt  # which processes without such can save

    edges = np.concatenate([np.zeros((0, 2, 3)), *map(open_edges, surfaces)])
    if len(edges) == 0:
        return NO_CELLS
    side = max(reach / 2, float(np.ptp(edges, axis=(0, 1)).max()) / _MOST)
    more = math.ceil(reach / side) + 3
    origin = edges.min(axis=(0, 1)) - more * side
    counts = np.ceil((edges.max(axis=(0, 1)) - origin) / side).astype(int) + more
    away = np.ones(counts, dtype=np.bool_)
    away[tuple(((_along(edges, side) - origin) / side).astype(int).T)] = False
    # Of places in two cells each may be half a diagonal from its middle, and of what is between two
    # places that are asked half a side from one.
    near = distance_transform_edt(away) * side <= reach + (math.sqrt(3) + 0.5) * side
    return CellsBesideEdges(np.asarray(near), origin, float(side))


def open_edges(surface: Mesh) -> Array:
    """The ends (n, 2, 3) of edges that are not run through as often one way as the other, by the
    faces as they are wound."""
    _, number = np.unique(surface.vertices, axis=0, return_inverse=True)
    faces = number.reshape(-1)[surface.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    way = np.where(edges[:, 0] < edges[:, 1], 1, -1) * (edges[:, 0] != edges[:, 1])
    key = edges.min(axis=1) * len(surface.vertices) + edges.max(axis=1)
    _, first, of = np.unique(key, return_index=True, return_inverse=True)
    is_open = np.bincount(of.reshape(-1), way) != 0
    corner = np.concatenate(
        [surface.faces[:, [0, 1]], surface.faces[:, [1, 2]], surface.faces[:, [2, 0]]]
    )
    ends: Array = surface.vertices[corner[first[is_open]]]
    return ends


def _along(edges: Array, step: float) -> Array:
    """Points (m, 3) on edges (n, 2, 3), no farther apart than a step."""
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    parts = np.ceil(lengths / step).astype(int) + 1
    edge = np.repeat(np.arange(len(edges)), parts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)
    t = (number / np.maximum(parts - 1, 1)[edge])[:, None]
    points: Array = (1 - t) * edges[edge, 0] + t * edges[edge, 1]
    return points


@njit_hot
def is_beside(cells: Any, x: float, y: float, z: float) -> bool:
    """Whether a place is in one of the cells."""
    i = math.floor((x - cells.origin[0]) / cells.side)
    j = math.floor((y - cells.origin[1]) / cells.side)
    k = math.floor((z - cells.origin[2]) / cells.side)
    counts = cells.beside.shape
    if not (0 <= i < counts[0] and 0 <= j < counts[1] and 0 <= k < counts[2]):
        return False
    return bool(cells.beside[i, j, k])
