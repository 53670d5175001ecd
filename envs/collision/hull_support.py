"""The corner of a convex hull that is furthest along a direction, compiled.

Searches for distances ask for it in each of their steps, of hulls of hundreds of corners. So
directions are parted into cells, the squares of a grid on each side of a cube, and it is found out
once which corners are the furthest along any direction in each: a few.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_hot
from envs.problem import Array

_SIDE = 8
"""Cells along each edge of the cube."""

CELLS = 6 * _SIDE * _SIDE

_ROUNDING = 1e-9
"""By how much directions in a cell may be farther from its middle than computed; and how much
nearer than the furthest corner, by the size of the hull, another one may be for rounding."""


def corners_by_cell(corners: Array) -> tuple[Array, NDArray[np.int64]]:
    """Those of a hull, (k, 3), that may be the furthest along directions in each cell: cell by cell
    (m, 3), in the order that they have, and where each cell's begin (`CELLS` + 1,).

    A corner v that is less far than the furthest, u, along the middle c of a cell by a gap is less
    far along any unit vector d of the cell, as (u - v).d >= gap - |u - v| |d - c|, if the gap is
    more than |u - v| times the cell's radius.
    """
    rounding = _ROUNDING * np.ptp(corners, axis=0).max()
    found = []
    for middle, radius in zip(*_cells(), strict=True):  # all at once takes much memory
        along = corners @ middle
        most = int(along.argmax())
        off = np.linalg.norm(corners - corners[most], axis=1)
        found.append(np.flatnonzero(along[most] - along <= off * radius + rounding))
    return corners[np.concatenate(found)], np.cumsum([0, *map(len, found)])


@cache
def _cells() -> tuple[Array, Array]:
    """Unit vectors (`CELLS`, 3), and how far from them those of their cells may be: as far as
    those at its corners."""
    side, sign, i, j = np.unravel_index(np.arange(CELLS), (3, 2, _SIDE, _SIDE))

    def directions(u: float, v: float) -> Array:
        # Of places in all cells, from 0 to 1 along both sides.
        found, each = np.empty((CELLS, 3)), np.arange(CELLS)
        found[each, side] = 1.0 - 2.0 * sign
        found[each, (side + 1) % 3] = 2 * (i + u) / _SIDE - 1
        found[each, (side + 2) % 3] = 2 * (j + v) / _SIDE - 1
        unit: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
        return unit

    middles = directions(0.5, 0.5)
    ends = [directions(u, v) for u in (0, 1) for v in (0, 1)]
    radii = np.max([np.linalg.norm(end - middles, axis=1) for end in ends], axis=0)
    return middles, radii + _ROUNDING


@njit_hot
def furthest(corners: Any, p: float, q: float, r: float) -> tuple[float, float, float]:
    """Of the corners of a hull, `corners_by_cell`, the one furthest along a direction."""
    places, firsts = corners
    cell = _cell(p, q, r)
    which = firsts[cell]
    best = places[which, 0] * p + places[which, 1] * q + places[which, 2] * r
    for n in range(which + 1, firsts[cell + 1]):
        along = places[n, 0] * p + places[n, 1] * q + places[n, 2] * r
        if along > best:
            best, which = along, n
    return places[which, 0], places[which, 1], places[which, 2]


@njit_hot
def _cell(p: float, q: float, r: float) -> int:
    """The number of the cell that a direction is in; 0 of none."""
    x, y, z = abs(p), abs(q), abs(r)
    if x >= y and x >= z:
        side, most, first, second = (0 if p > 0.0 else 1), x, q, r
    elif y >= z:
        side, most, first, second = (2 if q > 0.0 else 3), y, r, p
    else:
        side, most, first, second = (4 if r > 0.0 else 5), z, p, q
    if most == 0.0:
        return 0
    scale = 0.5 * _SIDE / most
    i = min(int(first * scale + 0.5 * _SIDE), _SIDE - 1)
    j = min(int(second * scale + 0.5 * _SIDE), _SIDE - 1)
    return (side * _SIDE + i) * _SIDE + j
