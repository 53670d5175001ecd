"""Distance between two convex solids in compiled code, never above the truth, and poses, (3, 4): a
rotation and a translation side by side.

The algorithm of Gilbert, Johnson and Keerthi, "A fast procedure for computing the distance between
complex objects in three-dimensional space", IEEE Journal of Robotics and Automation 4(2), 1988, on
the differences a - b of the solids' points. Of the nearest point so far, v, and the difference w
that lies least far along it, |v| is at least the distance and v.w / |v| at most: a plane normal to
v keeps the solids that far apart. Only the latter is returned, so that a search which ends early,
for want of precision or steps, errs to the safe side.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.collision.hull_support import furthest
from envs.collision.shapes import BOX, MESH, POINT, ROW, TRIANGLE
from envs.compiled import njit_cached, njit_hot

_PRECISION = 1e-7
"""How far below the distance it may be found, in metres, or by the distance where over a metre."""

_STEPS = 100

_FLAT = 1e-20
"""Of an edge's squared length: a triangle whose corner is less far off another edge is none."""

_NO_CORNERS = np.empty((0, 3)), np.zeros(1, dtype=np.int64)


@njit_cached
def distance(a: Any, b: Any, most: float) -> float:
    """A lower bound of the distance between two solids, rows (ROW,) as in `shapes.solid`.

    Within `_PRECISION` of the distance, and 0 where they touch or overlap; or else at least
    `most`, as soon as the distance is proved to be. Never above the distance, but for rounding.
    """
    return hull_distance(a, _NO_CORNERS, b, _NO_CORNERS, most)


@njit_cached
def hull_distance(a: Any, corners: Any, b: Any, other_corners: Any, most: float) -> float:
    """As `distance`, of solids or meshes, of which it is that of their hulls: their corners, see
    `corners_by_cell`, from the centres of their rows, along the rows' axes; any of a solid."""
    points, v = np.empty((4, 6)), np.empty(3)
    return _searched(a, corners, b, other_corners, most, points, v)[0]


@njit_cached
def hull_distance_between(
    a: Any, corners: Any, b: Any, other_corners: Any, most: float, ends: Any
) -> tuple[float, bool]:
    """As `hull_distance`, and whether `ends` (2, 3) are the points of each that are nearest to each
    other: so far as the search came, on their cores, but for rounding."""
    points, v = np.empty((4, 6)), np.empty(3)
    found, n = _searched(a, corners, b, other_corners, most, points, v)
    return found, _ends(a, points, n, ends)


@njit_cached
def moved(row: Any, pose: Any, out: Any) -> None:
    """Writes the row (ROW,) of a solid, given in a body's frame, with the body at a pose (3, 4).

    `out` must not be `row`.
    """
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = (
                pose[j, 0] * row[3 * i] + pose[j, 1] * row[3 * i + 1] + pose[j, 2] * row[3 * i + 2]
            )
        out[9 + i] = pose[i, 0] * row[9] + pose[i, 1] * row[10] + pose[i, 2] * row[11] + pose[i, 3]
    for i in range(12, ROW):
        out[i] = row[i]


@njit_cached
def _searched(
    a: Any, corners: Any, b: Any, other_corners: Any, most: float, points: Any, v: Any
) -> tuple[float, int]:
    """At most the distance between two solids, see `distance`; and the number of vertices of the
    simplex at which the search ended, the first rows of points (4, 6): differences of a point of
    each, and beside them that of the first. v (3,) is for its steps.

    Their cores are searched, and the radii about them taken off in the end.
    """
    x, y, z = a[9] - b[9], a[10] - b[10], a[11] - b[11]
    center_x, center_y, center_z = x, y, z
    length = math.sqrt(x * x + y * y + z * z)
    apart = length - a[15] - b[15]
    if apart >= most:
        return apart, 0
    rounding = a[17] + b[17]
    n, squared, lower = 0, np.inf, 0.0
    # (x, y, z) is the difference of a point of each, so that they are at most `length` apart. Of
    # all such differences w is the least far along it: none is nearer to the origin than the plane
    # through w across it. Both hold at every step, wherever the search ends.
    for _ in range(_STEPS):
        if length <= _PRECISION:
            break
        ax, ay, az = _support(a, corners, -x, -y, -z)
        bx, by, bz = _support(b, other_corners, x, y, z)
        wx, wy, wz = center_x + (ax - bx), center_y + (ay - by), center_z + (az - bz)
        lower = max(lower, (x * wx + y * wy + z * wz) / length)
        if lower - rounding >= most or length - lower <= _PRECISION * max(1.0, length):
            break
        points[n, 0], points[n, 1], points[n, 2] = wx, wy, wz
        points[n, 3], points[n, 4], points[n, 5] = ax, ay, az
        n, found = _nearest(points, n + 1, v)
        if not found < squared:  # as near as rounding allows
            break
        squared, length = found, math.sqrt(found)
        x, y, z = v[0], v[1], v[2]
    return max(lower - rounding, 0.0), n


@njit_hot
def _ends(a: Any, points: Any, n: int, ends: Any) -> bool:
    """Writes the points (2, 3) of two solids whose difference is the one of a simplex (see
    `_searched`) that is nearest to the origin, which must be within; returns whether it is one of
    at most three vertices, not flat."""
    if n == 0 or n == 4:
        return False
    by_e, by_f = 0.0, 0.0
    one, two, three = points[0], points[min(1, n - 1)], points[n - 1]
    ex, ey, ez = two[0] - one[0], two[1] - one[1], two[2] - one[2]
    ee, along_e = ex * ex + ey * ey + ez * ez, -(one[0] * ex + one[1] * ey + one[2] * ez)
    if n == 2:
        by_e = along_e / ee
    if n == 3:
        fx, fy, fz = three[0] - one[0], three[1] - one[1], three[2] - one[2]
        ff, along_f = fx * fx + fy * fy + fz * fz, -(one[0] * fx + one[1] * fy + one[2] * fz)
        ef = ex * fx + ey * fy + ez * fz
        area = ee * ff - ef * ef
        if not area > 0.0:
            return False
        by_e = (along_e * ff - along_f * ef) / area
        by_f = (along_f * ee - along_e * ef) / area
    for i in range(3):
        ends[0, i] = a[9 + i] + one[3 + i]
        ends[0, i] += by_e * (two[3 + i] - one[3 + i]) + by_f * (three[3 + i] - one[3 + i])
        ends[1, i] = ends[0, i] - one[i] - by_e * (two[i] - one[i]) - by_f * (three[i] - one[i])
    return True


@njit_cached
def _support(row: Any, corners: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """From the centre of a solid's core, the core's point furthest along a direction."""
    kind = row[16]
    if kind == POINT:
        return 0.0, 0.0, 0.0
    p = row[0] * x + row[1] * y + row[2] * z
    q = row[3] * x + row[4] * y + row[5] * z
    r = row[6] * x + row[7] * y + row[8] * z
    if kind == TRIANGLE:
        corner = 0 if p >= q and p >= r else 3 if q >= r else 6
        return row[corner], row[corner + 1], row[corner + 2]
    if kind == MESH:
        p, q, r = furthest(corners, p, q, r)
    elif kind == BOX:
        p, q = math.copysign(row[12], p), math.copysign(row[13], q)
        r = math.copysign(row[14], r)
    else:
        aside = math.sqrt(p * p + q * q)
        scale = row[12] / aside if aside > 0.0 else 0.0
        p, q, r = scale * p, scale * q, math.copysign(row[13], r)
    return (
        row[0] * p + row[3] * q + row[6] * r,
        row[1] * p + row[4] * q + row[7] * r,
        row[2] * p + row[5] * q + row[8] * r,
    )


@njit_cached
def _nearest(points: Any, n: int, v: Any) -> tuple[int, float]:
    """The point of a simplex nearest to the origin, written to v (3,), if the last vertex helps.

    Of each face with the last vertex on it, the nearest point of its plane, where that lies within
    the face: all are points of the simplex, whatever is lost to rounding. The first rows of points
    (4, 6), of which the first three numbers count here, become the vertices of the face with the
    nearest of all. Returns their number, and the squared distance of that point.
    """
    last = n - 1
    px, py, pz = points[last, 0], points[last, 1], points[last, 2]
    ox, oy, oz = points[last, 3], points[last, 4], points[last, 5]
    least = px * px + py * py + pz * pz
    v[0], v[1], v[2] = px, py, pz
    first, second, third = -1, -1, -1
    for i in range(last):
        ex, ey, ez = points[i, 0] - px, points[i, 1] - py, points[i, 2] - pz
        ee = ex * ex + ey * ey + ez * ez
        if not ee > 0.0:
            continue
        # On the edge p + along e, where its product with e is 0.
        along = -(px * ex + py * ey + pz * ez) / ee
        if 0.0 < along < 1.0:
            x, y, z = px + along * ex, py + along * ey, pz + along * ez
            squared = x * x + y * y + z * z
            if squared < least:
                least, first, second = squared, i, -1
                v[0], v[1], v[2] = x, y, z
        for j in range(i + 1, last):
            fx, fy, fz = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
            # On the triangle p + by_e e + by_f f: q is f without its part along e, so that the
            # two can be found one after the other.
            share = (ex * fx + ey * fy + ez * fz) / ee
            qx, qy, qz = fx - share * ex, fy - share * ey, fz - share * ez
            qq = qx * qx + qy * qy + qz * qz
            if qq <= _FLAT * (fx * fx + fy * fy + fz * fz):  # no more than an edge
                continue
            by_f = -(px * qx + py * qy + pz * qz) / qq
            by_e = along - share * by_f
            if by_f > 0.0 and by_e > 0.0 and by_e + by_f < 1.0:
                x = px + by_e * ex + by_f * fx
                y = py + by_e * ey + by_f * fy
                z = pz + by_e * ez + by_f * fz
                squared = x * x + y * y + z * z
                if squared < least:
                    least, first, second = squared, i, j
                    v[0], v[1], v[2] = x, y, z
    if n == 4:
        ex, ey, ez = points[0, 0] - px, points[0, 1] - py, points[0, 2] - pz
        fx, fy, fz = points[1, 0] - px, points[1, 1] - py, points[1, 2] - pz
        gx, gy, gz = points[2, 0] - px, points[2, 1] - py, points[2, 2] - pz
        nx, ny, nz = fy * gz - fz * gy, fz * gx - fx * gz, fx * gy - fy * gx
        volume = ex * nx + ey * ny + ez * nz
        if volume != 0.0:
            # The origin as p + by_e e + by_f f + by_g g, by Cramer's rule: within if all are
            # positive and their sum is below 1.
            by_e = -(px * nx + py * ny + pz * nz) / volume
            nx, ny, nz = py * ez - pz * ey, pz * ex - px * ez, px * ey - py * ex
            by_f = (gx * nx + gy * ny + gz * nz) / volume
            by_g = -(fx * nx + fy * ny + fz * nz) / volume
            if by_e > 0.0 and by_f > 0.0 and by_g > 0.0 and by_e + by_f + by_g < 1.0:
                x = px + by_e * ex + by_f * fx + by_g * gx
                y = py + by_e * ey + by_f * fy + by_g * gy
                z = pz + by_e * ez + by_f * fz + by_g * gz
                squared = x * x + y * y + z * z
                if squared < least:
                    least, first, second, third = squared, 0, 1, 2
                    v[0], v[1], v[2] = x, y, z
    n = 0
    for i in (first, second, third):
        if i >= 0:
            for k in range(6):
                points[n, k] = points[i, k]
            n += 1
    points[n, 0], points[n, 1], points[n, 2] = px, py, pz
    points[n, 3], points[n, 4], points[n, 5] = ox, oy, oz
    return n + 1, least


@njit_hot
def compose(a: Any, b: Any, out: Any) -> None:
    """Writes the pose a b (3, 4); `out` is neither of them."""
    for i in range(3):
        for j in range(4):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
        out[i, 3] += a[i, 3]


@njit_hot
def at(pose: Any, point: Any) -> tuple[float, float, float]:
    """Where a point (3,) is that a pose (3, 4) carries."""
    return (
        pose[0, 0] * point[0] + pose[0, 1] * point[1] + pose[0, 2] * point[2] + pose[0, 3],
        pose[1, 0] * point[0] + pose[1, 1] * point[1] + pose[1, 2] * point[2] + pose[1, 3],
        pose[2, 0] * point[0] + pose[2, 1] * point[1] + pose[2, 2] * point[2] + pose[2, 3],
    )
