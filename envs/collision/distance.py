"""Batched signed distances in closed form, for learning, grids and sampling of problems."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from envs.collision.shapes import Box
from envs.problem import Array

_CHUNK = 32_768  # points handled at once: keeps the working arrays in cache


def signed_distance_to_boxes(points: Array, boxes: Sequence[Box]) -> Array:
    """Signed distance (n,) from points (n, 3) to the surface of a union of solid boxes.

    Exact outside the union. Inside it is negative and at most the true depth in size, exact where
    boxes do not overlap. No boxes give +inf.
    """
    distance = np.full(len(points), np.inf)
    for begin in range(0, len(points), _CHUNK):
        part = points[begin : begin + _CHUNK]
        out = distance[begin : begin + _CHUNK]
        for box in boxes:
            np.minimum(out, _to_box(part, box), out=out)
    return distance


def _to_box(points: Array, box: Box) -> Array:
    dx, dy, dz = (np.abs(points - box.center) - box.sides / 2).T
    inside = np.minimum(np.maximum(np.maximum(dx, dy), dz), 0.0)
    for axis in (dx, dy, dz):
        np.maximum(axis, 0.0, out=axis)
    # Written out so that the rounding, hence every sampled problem, is the same on every machine.
    distance: Array = np.sqrt(dx * dx + dy * dy + dz * dz) + inside
    return distance
