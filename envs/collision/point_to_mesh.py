"""Distances of balls from triangle meshes in compiled code, never above the truth: in closed form
throughout."""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.shapes import ROW, TRIANGLE
from envs.collision.triangles import point_to_triangle
from envs.compiled import njit_cached, njit_hot

DEEPEST = 64
"""Nodes that wait at most: halving leaves fewer than 2^32 triangles one each in 32 steps."""


@njit_cached
def ball_to_mesh(
    trees: Any, root: int, x: float, y: float, z: float, radius: float, most: float, hint: int
) -> tuple[float, int]:
    """A lower bound of the distance of a ball from the surface of the mesh at a root, in its frame,
    or `most`, if it is no less; and the leaf of the triangle that is so near, or the hint.

    Args:
        hint: a leaf that may be near, which spares most others; -1 for none.
    """
    triangle = np.zeros(ROW)
    nodes, bounds = np.empty(DEEPEST, dtype=np.int64), np.empty(DEEPEST)
    least, nearest = most + radius, hint
    if hint >= 0:
        least = min(least, _to_leaf(trees, hint, triangle, x, y, z))
    nodes[0], bounds[0], waiting = root, 0.0, 1
    while waiting and least > radius:
        waiting -= 1
        if bounds[waiting] >= least * least:
            continue
        node = nodes[waiting]
        first = trees.child[node]
        if first < 0:
            found = _to_leaf(trees, node, triangle, x, y, z)
            if found < least:
                least, nearest = found, node
            continue
        second = first + 1
        to_first = _squared_to_box(trees, first, x, y, z)
        to_second = _squared_to_box(trees, second, x, y, z)
        if to_first < to_second:  # the nearer one last, which is the next that is looked at
            first, second, to_first, to_second = second, first, to_second, to_first
        nodes[waiting], bounds[waiting] = first, to_first
        nodes[waiting + 1], bounds[waiting + 1] = second, to_second
        waiting += 2
    return (most if least >= most + radius else max(least - radius, 0.0)), nearest


@njit_hot
def _squared_to_box(trees: Any, node: int, x: float, y: float, z: float) -> float:
    """The square of what a node's box keeps from a point."""
    x, y, z = x - trees.middles[node, 0], y - trees.middles[node, 1], z - trees.middles[node, 2]
    squared = 0.0
    for i in range(3):
        along = trees.axes[node, i, 0] * x + trees.axes[node, i, 1] * y + trees.axes[node, i, 2] * z
        gap = max(abs(along) - trees.halves[node, i], 0.0)
        squared += gap * gap
    return squared


@njit_hot
def _to_leaf(trees: Any, leaf: int, triangle: Any, x: float, y: float, z: float) -> float:
    take_triangle(trees, leaf, triangle)
    return float(point_to_triangle(triangle, x, y, z))


@njit_hot
def take_triangle(trees: Any, leaf: int, row: Any) -> None:
    """Writes the row (ROW,) of a leaf's triangle, in the mesh's frame."""
    for k in range(9):
        row[k] = trees.triangles[-1 - trees.child[leaf], k]
    for i in range(3):
        row[9 + i] = trees.middles[leaf, i]
    row[15], row[16] = trees.radii[leaf], TRIANGLE
