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
    return lowered(squared)


@njit_hot
def triangle_to_triangle(one: Any, other: Any) -> float:
    """The distance between two triangles, 0 where they touch."""
    return lowered(nearest_of_triangles(one, other)[0])


@njit_hot
def nearest_of_triangles(one: Any, other: Any) -> tuple[float, float, float, float]:
    """The squared distance between two triangles, and a way (3,) along which they are so far apart,
    of any length; all 0 where they touch.

    Where they do not meet it is between two edges, or between a corner of one and what lies right
    below it of the other.
    """
    x, y, z = other[9] - one[9], other[10] - one[10], other[11] - one[11]
    p0, p1, p2 = _corners(one, -x, -y, -z)
    q0, q1, q2 = _corners(other, 0.0, 0.0, 0.0)
    pierces, squared, way = _from_corners(q0, q1, q2, p0, p1, p2)
    if pierces:
        return 0.0, 0.0, 0.0, 0.0
    pierces, found, across = _from_corners(p0, p1, p2, q0, q1, q2)
    if pierces:
        return 0.0, 0.0, 0.0, 0.0
    if found < squared:
        squared, way = found, across
    f0, f1, f2 = _less(q1, q0), _less(q2, q1), _less(q0, q2)
    for p, d in ((p0, _less(p1, p0)), (p1, _less(p2, p1)), (p2, _less(p0, p2))):
        dd = _dot(d, d)
        for q, f in ((q0, f0), (q1, f1), (q2, f2)):
            across = _between_segments(p, d, dd, q, f, _dot(f, f))
            found = _dot(across, across)
            if found < squared:
                squared, way = found, across
    return squared, way[0], way[1], way[2]


@njit_hot
def gap_along(one: Any, other: Any, x: float, y: float, z: float) -> float:
    """How far two triangles are apart along a way at least, negative where they overlap."""
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return 0.0
    a0, a1, a2 = _along(one, 0, x, y, z), _along(one, 3, x, y, z), _along(one, 6, x, y, z)
    b0, b1, b2 = _along(other, 0, x, y, z), _along(other, 3, x, y, z), _along(other, 6, x, y, z)
    far = (other[9] - one[9]) * x + (other[10] - one[10]) * y + (other[11] - one[11]) * z
    before = min(b0, b1, b2) + far - max(a0, a1, a2)
    behind = min(a0, a1, a2) - far - max(b0, b1, b2)
    return float(max(before, behind) / length)


@njit_hot
def _along(row: Any, corner: int, x: float, y: float, z: float) -> float:
    return float(row[corner] * x + row[corner + 1] * y + row[corner + 2] * z)


@njit_hot
def _corners(row: Any, x: float, y: float, z: float) -> Any:
    """Of a triangle, moved from where its middle is the origin."""
    return (
        (row[0] + x, row[1] + y, row[2] + z),
        (row[3] + x, row[4] + y, row[5] + z),
        (row[6] + x, row[7] + y, row[8] + z),
    )


@njit_hot
def _less(a: Any, b: Any) -> tuple[float, float, float]:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit_hot
def _from_corners(a: Any, b: Any, c: Any, p: Any, q: Any, r: Any) -> Any:
    """Whether an edge of a triangle with corners p, q, r goes through one with corners a, b, c;
    the least squared distance of those of its corners that lie right above or below the latter,
    infinite if none does; and the normal (3,) of that."""
    e, f = _less(b, a), _less(c, a)
    normal = _cross(e, f)
    area = _dot(normal, normal)
    if area <= _FLAT * _dot(e, e) * _dot(f, f):
        return False, math.inf, normal
    p, q, r = _less(p, a), _less(q, a), _less(r, a)
    at_p, at_q, at_r = _dot(p, normal), _dot(q, normal), _dot(r, normal)
    squared = math.inf
    for place, high in ((p, at_p), (q, at_q), (r, at_r)):
        if high * high / area < squared and _is_within(e, f, normal, area, place):
            squared = high * high / area
    if (at_p > 0.0) == (at_q > 0.0) == (at_r > 0.0):
        return False, squared, normal
    for begin, end, there, beyond in ((at_p, at_q, p, q), (at_q, at_r, q, r), (at_r, at_p, r, p)):
        if (begin > 0.0) == (end > 0.0) or begin == end:
            continue
        t, way = begin / (begin - end), _less(beyond, there)
        crossing = there[0] + t * way[0], there[1] + t * way[1], there[2] + t * way[2]
        if _is_within(e, f, normal, area, crossing):
            return True, 0.0, normal
    return False, squared, normal


@njit_hot
def _is_within(e: Any, f: Any, normal: Any, area: float, p: Any) -> bool:
    """Whether a point lies right above or below a triangle with edges e and f, from the corner
    between these."""
    by_f = _dot(_cross(e, p), normal)
    by_e = _dot(_cross(p, f), normal)
    return bool(by_e >= 0.0 and by_f >= 0.0 and by_e + by_f <= area)


@njit_hot
def lowered(squared: float) -> float:
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
def _segments(p: Any, d: Any, q: Any, f: Any) -> float:
    """Squared distance between two segments, from p along d and from q along f."""
    way = _between_segments(p, d, _dot(d, d), q, f, _dot(f, f))
    return _dot(way, way)


@njit_hot
def _between_segments(p: Any, d: Any, dd: float, q: Any, f: Any, ff: float) -> Any:
    """The shortest way (3,) from the second of two segments, from p along d and from q along f, to
    the first (Ericson, "Real-Time Collision Detection", 2005, section 5.1.9); dd and ff are their
    lengths squared."""
    r = _less(p, q)
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
    return (
        r[0] + s * d[0] - t * f[0],
        r[1] + s * d[1] - t * f[1],
        r[2] + s * d[2] - t * f[2],
    )
