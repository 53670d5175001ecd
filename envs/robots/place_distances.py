"""How far points are from solids, and from each other, at many places of a motion at once, and at
which of these they are near: masks, of which each bit is a place. Compiled, see `motion_places`.
"""

from __future__ import annotations

import math
from typing import Any

from envs.compiled import njit_simd
from envs.robots.motion_places import PLACES

_LEAST = 1e-300
"""Instead of no length, where something is divided by it."""


@njit_simd
def below(values: Any, least: float) -> int:
    """The mask of places whose values (PLACES,) are no more than something."""
    mask = 0
    for n in range(PLACES):
        mask |= int(values[n] <= least) << n
    return mask


@njit_simd
def unproved(apart: Any, nearing: Any, least: float) -> int:
    """The mask of places where a distance may become no more than something."""
    mask = 0
    for n in range(PLACES):
        mask |= int(apart[n] - nearing[n] <= least) << n
    return mask


@njit_simd
def fast(apart: Any, nearing: Any, bend: float, least: float) -> int:
    """The mask of places where a distance of more than something may go to nothing."""
    mask = 0
    for n in range(PLACES):
        mask |= int((apart[n] > least) & (nearing[n] + bend > apart[n])) << n
    return mask


@njit_simd
def reaches(point: Any, half: float, reach: float, out: Any) -> None:
    """Writes how far about a point (POINT,) what is within a reach of it comes in half a share."""
    for n in range(PLACES):
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        out[n] = reach + half * math.sqrt(u * u + v * v + w * w)


@njit_simd
def near_ball(point: Any, reaches: Any, row: Any, room: Any) -> int:
    """The mask of places where the sphere that holds a solid is within reach of a point."""
    x, y, z, radius = row[9], row[10], row[11], row[15]
    for n in range(PLACES):
        dx, dy, dz = point[n] - x, point[PLACES + n] - y, point[2 * PLACES + n] - z
        reach = reaches[n] + radius
        room[n] = dx * dx + dy * dy + dz * dz - reach * reach
    return below(room, 0.0)


@njit_simd
def to_box(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
    """Writes how far a point (POINT,) is from a solid, a row of `Shapes.rows`, and how much nearer
    its velocity brings it in half a share; see `sphere_proofs`."""
    r0, r1, r2, r3, r4, r5 = row[0], row[1], row[2], row[3], row[4], row[5]
    r6, r7, r8, ox, oy, oz = row[6], row[7], row[8], row[9], row[10], row[11]
    ha, hb, hc, rounding = row[12], row[13], row[14], row[17]
    for n in range(PLACES):
        x, y, z = point[n] - ox, point[PLACES + n] - oy, point[2 * PLACES + n] - oz
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        a, b, c = r0 * x + r1 * y + r2 * z, r3 * x + r4 * y + r5 * z, r6 * x + r7 * y + r8 * z
        va, vb, vc = r0 * u + r1 * v + r2 * w, r3 * u + r4 * v + r5 * w, r6 * u + r7 * v + r8 * w
        da, db, dc = abs(a) - ha, abs(b) - hb, abs(c) - hc
        deep = min(max(da, max(db, dc)), 0.0)
        a, b = math.copysign(max(da, 0.0), a), math.copysign(max(db, 0.0), b)
        c = math.copysign(max(dc, 0.0), c)
        away = math.sqrt(a * a + b * b + c * c)
        apart[n] = away + deep - rounding
        nearing[n] = half * abs(a * va + b * vb + c * vc) / max(away, _LEAST)


@njit_simd
def to_cylinder(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
    """As `to_box`."""
    r0, r1, r2, r3, r4, r5 = row[0], row[1], row[2], row[3], row[4], row[5]
    r6, r7, r8, ox, oy, oz = row[6], row[7], row[8], row[9], row[10], row[11]
    radius, height, rounding = row[12], row[13], row[17]
    for n in range(PLACES):
        x, y, z = point[n] - ox, point[PLACES + n] - oy, point[2 * PLACES + n] - oz
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        a, b, c = r0 * x + r1 * y + r2 * z, r3 * x + r4 * y + r5 * z, r6 * x + r7 * y + r8 * z
        va, vb, vc = r0 * u + r1 * v + r2 * w, r3 * u + r4 * v + r5 * w, r6 * u + r7 * v + r8 * w
        out = math.sqrt(a * a + b * b)
        aside, above = out - radius, abs(c) - height
        deep = min(max(aside, above), 0.0)
        aside, above = max(aside, 0.0), max(above, 0.0)
        outward = aside * (a * va + b * vb) / max(out, _LEAST)
        away = math.sqrt(aside * aside + above * above)
        apart[n] = away + deep - rounding
        nearing[n] = half * abs(outward + math.copysign(above, c) * vc) / max(away, _LEAST)


@njit_simd
def to_ball(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
    """As `to_box`."""
    ox, oy, oz, radius = row[9], row[10], row[11], row[17]
    for n in range(PLACES):
        x, y, z = point[n] - ox, point[PLACES + n] - oy, point[2 * PLACES + n] - oz
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        away = math.sqrt(x * x + y * y + z * z)
        apart[n] = away - radius
        nearing[n] = half * abs(x * u + y * v + z * w) / max(away, _LEAST)


@njit_simd
def to_point(point: Any, other: Any, half: float, apart: Any, nearing: Any) -> None:
    """Writes how far two points (POINT,) are apart, and how much nearer their velocities bring them
    in half a share."""
    for n in range(PLACES):
        x, y = point[n] - other[n], point[PLACES + n] - other[PLACES + n]
        z = point[2 * PLACES + n] - other[2 * PLACES + n]
        u = point[3 * PLACES + n] - other[3 * PLACES + n]
        v = point[4 * PLACES + n] - other[4 * PLACES + n]
        w = point[5 * PLACES + n] - other[5 * PLACES + n]
        away = math.sqrt(x * x + y * y + z * z)
        apart[n] = away
        nearing[n] = half * abs(x * u + y * v + z * w) / max(away, _LEAST)
