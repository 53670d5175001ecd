"""Distances of triangles in closed form, compiled.

Triangles are rows (ROW,) as in `shapes.solid`. Results are lowered by `_PRECISION`, which is
far more than rounding can add to them.
"""

from __future__ import annotations

import math
from typing import Any

from envs.compiled import njit_hot

_PRECISION = 1e-7
"""In metres, or by the distance where that is over a metre."""

_FLAT = 1e-20
"""Of the product of two edges' squared lengths: a triangle whose squared area is less is none, and
has edges only."""


@njit_hot
def point_to_triangle(row: Any, x: float, y: float, z: float) -> float:
    """The distance of a point from a triangle."""
    x, y, z = x - row[9], y - row[10], z - row[11]
    squared = _above(row, x, y, z)
    for k in range(3):
        a, b = 3 * k, 3 * ((k + 1) % 3)
        squared = min(
            squared,
            _segments(
                (x, y, z),
                (0.0, 0.0, 0.0),
                (row[a], row[a + 1], row[a + 2]),
                (row[b] - row[a], row[b + 1] - row[a + 1], row[b + 2] - row[a + 2]),
            ),
        )
    return _lowered(squared)


@njit_hot
def triangle_to_triangle(one: Any, other: Any) -> float:
    """The distance between two triangles, 0 where they touch.

    Where they do not meet it is between two edges, or between a corner of one and what lies right
    below it of the other.
    """
    way = (other[9] - one[9], other[10] - one[10], other[11] - one[11])
    if _pierces(one, other, -way[0], -way[1], -way[2]) or _pierces(other, one, *way):
        return 0.0
    squared = math.inf
    for k in range(3):
        a, b = 3 * k, 3 * ((k + 1) % 3)
        p = (one[a] - way[0], one[a + 1] - way[1], one[a + 2] - way[2])
        d = (one[b] - one[a], one[b + 1] - one[a + 1], one[b + 2] - one[a + 2])
        squared = min(squared, _above(other, *p))
        squared = min(
            squared, _above(one, other[a] + way[0], other[a + 1] + way[1], other[a + 2] + way[2])
        )
        for j in range(3):
            c, e = 3 * j, 3 * ((j + 1) % 3)
            q = (other[c], other[c + 1], other[c + 2])
            f = (other[e] - other[c], other[e + 1] - other[c + 1], other[e + 2] - other[c + 2])
            squared = min(squared, _segments(p, d, q, f))
    return _lowered(squared)


@njit_hot
def _lowered(squared: float) -> float:
    length = math.sqrt(squared)
    return max(length - _PRECISION * max(1.0, length), 0.0)


@njit_hot
def _cross(a: Any, b: Any) -> tuple[float, float, float]:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit_hot
def _dot(a: Any, b: Any) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit_hot
def _within(row: Any, x: float, y: float, z: float) -> tuple[bool, float, float]:
    """Whether a point, from the triangle's middle, lies right above or below it; and how high, by
    the length of the normal, and that length squared."""
    e = (row[3] - row[0], row[4] - row[1], row[5] - row[2])
    f = (row[6] - row[0], row[7] - row[1], row[8] - row[2])
    p = (x - row[0], y - row[1], z - row[2])
    normal = _cross(e, f)
    area = _dot(normal, normal)
    if area <= _FLAT * _dot(e, e) * _dot(f, f):
        return False, 0.0, 0.0
    by_f = _dot(_cross(e, p), normal)
    by_e = _dot(_cross(p, f), normal)
    return by_e >= 0.0 and by_f >= 0.0 and by_e + by_f <= area, _dot(p, normal), area


@njit_hot
def _above(row: Any, x: float, y: float, z: float) -> float:
    """Squared distance of a point from what lies right below it of a triangle; else infinite."""
    within, high, area = _within(row, x, y, z)
    return high * high / area if within else math.inf


@njit_hot
def _pierces(one: Any, other: Any, x: float, y: float, z: float) -> bool:
    """Whether an edge of a triangle goes through another, at (x, y, z) from whose middle the
    first's is."""
    for k in range(3):
        a, b = 3 * k, 3 * ((k + 1) % 3)
        p = (one[a] + x, one[a + 1] + y, one[a + 2] + z)
        q = (one[b] + x, one[b + 1] + y, one[b + 2] + z)
        _, begin, area = _within(other, *p)
        _, end, _ = _within(other, *q)
        if area == 0.0 or (begin > 0.0) == (end > 0.0) or begin == end:
            continue
        t = begin / (begin - end)
        px, py, pz = p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])
        if _within(other, px, py, pz)[0]:
            return True
    return False


@njit_hot
def _segments(p: Any, d: Any, q: Any, f: Any) -> float:
    """Squared distance between two segments, from p along d and from q along f (Ericson,
    "Real-Time Collision Detection", 2005, section 5.1.9)."""
    r = (p[0] - q[0], p[1] - q[1], p[2] - q[2])
    dd, ff = _dot(d, d), _dot(f, f)
    fr, dr, df = _dot(f, r), _dot(d, r), _dot(d, f)
    s, t = 0.0, 0.0
    if dd > 0.0 and ff > 0.0:
        cross = dd * ff - df * df
        s = min(max((df * fr - dr * ff) / cross, 0.0), 1.0) if cross > 0.0 else 0.0
        t = (df * s + fr) / ff
        if t < 0.0 or t > 1.0:
            t = min(max(t, 0.0), 1.0)
            s = min(max((df * t - dr) / dd, 0.0), 1.0)
    elif ff > 0.0:
        t = min(max(fr / ff, 0.0), 1.0)
    elif dd > 0.0:
        s = min(max(-dr / dd, 0.0), 1.0)
    x = r[0] + s * d[0] - t * f[0]
    y = r[1] + s * d[1] - t * f[1]
    z = r[2] + s * d[2] - t * f[2]
    squared: float = x * x + y * y + z * z
    return squared
