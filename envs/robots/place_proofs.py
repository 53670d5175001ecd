"""What spheres prove of an arm's parts, and of pairs of them, about many places of a motion at once,
compiled.

What is proved about a place, and why, says `sphere_proofs`, which asks one place at a time. Places
are the bits of a mask.
"""

from __future__ import annotations

import math
from typing import Any

from envs.collision.primitive_sdf import to_solid
from envs.collision.separation import is_allowed
from envs.collision.shapes import BOX, CYLINDER
from envs.compiled import njit_hot, njit_inline, njit_simd
from envs.robots.motion_places import BODY, PLACES, point_at_places
from envs.robots.motion_proof import bounds_of

PROVED, NEAR, UNKNOWN, TOUCHING = 0, 1, 2, 3
"""What spheres tell: that all keeps what it should, or may in smaller shares of the motion; that at
some place they are no more than what is asked from something; that there is something near of which
they tell nothing; that something is touched."""

_ALL = (1 << PLACES) - 1
"""The mask of all places."""

_MIDDLE = PLACES // 2
"""The place nearest to the middle of a stretch, of two."""

_FARTHEST = (_MIDDLE + 0.5) / PLACES
"""From there to the farther end, of the stretch."""

_LEAST = 1e-300
"""Instead of no length, where something is divided by it."""


@njit_hot
def ask_spheres(
    arm: Any,
    trees: Any,
    around: Any,
    may_touch: Any,
    items: Any,
    width: float,
    tolerance: float,
    room: Any,
    left: Any,
) -> int:
    """What spheres tell of parts and pairs of them in as many shares of a stretch of a motion as
    there are places, whose bodies are in the room.

    One call asks about many, see `sphere_proofs.next_in_doubt`.

    Args:
        items: numbers (k,) of parts, or of pairs after them.
        width: of the stretch.
        tolerance: see `ArmMotionCheck`.
        room: `Room`.
        left: (k,) the masks are written here of the shares in which each is not proved yet.
    """
    half = width / PLACES / 2
    room.looked[-1] += 1
    for n in range(len(items)):
        item = items[n]
        if room.bends[item] < 0.0:
            room.bends[item], room.moves[item] = bounds_of(
                arm, trees, room.speeds, room.turned, item
            )
        # From the place in the middle to the farther end of the stretch.
        moves = room.moves[item] * width * _FARTHEST
        measures = half, room.bends[item] * half * half / 2, moves, tolerance, tolerance / 2
        if item < arm.moving:
            known, left[n] = _part(arm, trees, around, may_touch, item, measures, room)
        else:
            part, other = arm.branches[item - arm.moving, 0], arm.branches[item - arm.moving, 1]
            known, left[n] = _pair(arm, trees, part, other, measures, room)
        if known != PROVED:
            return known
    return PROVED


@njit_inline
def _look(arm: Any, trees: Any, part: int, room: Any) -> None:
    """Finds where the sphere is that holds a part, once a look."""
    if room.looked[part] != room.looked[-1]:
        room.looked[part] = room.looked[-1]
        number = arm.bodies[part]
        body = room.bodies[number * BODY : (number + 1) * BODY]
        point_at_places(body, trees.centers[trees.firsts[part]], room.roots[part])


@njit_inline
def _part(
    arm: Any, trees: Any, around: Any, may_touch: Any, part: int, measures: Any, room: Any
) -> tuple[int, int]:
    """What is known of a part and obstacles; and the mask of places that are left."""
    half, bend, moves, _, kept = measures
    _look(arm, trees, part, room)
    root, number, point, left = trees.firsts[part], arm.bodies[part], room.roots[part], 0
    body = room.bodies[number * BODY : (number + 1) * BODY]
    radius = trees.radii[root]
    x, y, z = point[_MIDDLE], point[PLACES + _MIDDLE], point[2 * PLACES + _MIDDLE]
    is_reached = False
    for j in range(len(around.rows)):
        is_mesh = around.roots[j] >= 0  # whose row does not tell how far it is
        if not is_mesh and to_solid(around.rows, j, x, y, z) > radius + moves + kept:
            continue
        if not is_reached:  # no point of the part comes farther within half a share
            _reaches(point, half, radius + bend + kept, room.reaches)
            is_reached = True
        row = around.rows[j]
        mask = _near_ball(point, room.reaches, row, room.apart)
        if mask == 0 or is_allowed(may_touch, part, j):
            continue
        if is_mesh:
            return UNKNOWN, left
        known, more = _part_and_solid(trees, root, body, row, measures, mask, room)
        if known != PROVED:
            return known, left
        left |= more
    return PROVED, left


@njit_hot
def _part_and_solid(
    trees: Any, root: int, body: Any, row: Any, measures: Any, mask: int, room: Any
) -> tuple[int, int]:
    """What is known of a part and a solid at some places; and the mask of those that are left."""
    half, bend, _, asked, kept = measures
    waiting, point, apart, nearing = room.waiting, room.point, room.apart, room.nearing
    waiting[0], waiting[1] = root, mask
    size, left = 2, 0
    while size > 0:
        size -= 2
        node, mask = waiting[size], waiting[size + 1]
        point_at_places(body, trees.centers[node], point)
        if row[16] == BOX:
            _to_box(point, row, half, apart, nearing)
        elif row[16] == CYLINDER:
            _to_cylinder(point, row, half, apart, nearing)
        else:
            _to_ball(point, row, half, apart, nearing)
        radius, end = trees.radii[node], trees.skips[node]
        mask &= _unproved(apart, nearing, radius + bend + kept)
        if mask == 0:
            continue
        if end == node + 1:
            if mask & _below(apart, trees.inner[node]):
                return TOUCHING, left
            if mask & _below(apart, asked + radius):
                return NEAR, left
            left |= mask
            continue
        # Smaller spheres would hardly prove it where they move that fast, and none touches.
        fast = mask & _fast(apart, nearing, bend, asked + radius)
        left |= fast
        mask &= ~fast
        child = node + 1
        while mask != 0 and child < end:
            if size > len(waiting) - 3:
                return UNKNOWN, left
            waiting[size], waiting[size + 1] = child, mask
            size += 2
            child = trees.skips[child]
    return PROVED, left


@njit_inline
def _pair(
    arm: Any, trees: Any, part: int, other: int, measures: Any, room: Any
) -> tuple[int, int]:
    """What is known of a pair of parts; and the mask of places that are left."""
    half, bend, moves, _, kept = measures
    _look(arm, trees, part, room)
    _look(arm, trees, other, room)
    point, there = room.roots[part], room.roots[other]
    root, other_root = trees.firsts[part], trees.firsts[other]
    radii = trees.radii[root] + trees.radii[other_root]
    x, y = point[_MIDDLE] - there[_MIDDLE], point[PLACES + _MIDDLE] - there[PLACES + _MIDDLE]
    z, beyond = point[2 * PLACES + _MIDDLE] - there[2 * PLACES + _MIDDLE], radii + moves + kept
    if x * x + y * y + z * z > beyond * beyond:
        return PROVED, 0
    _to_point(point, there, half, room.apart, room.nearing)
    mask = _unproved(room.apart, room.nearing, radii + bend + kept)
    if mask == 0:  # of most pairs, which takes less time than to pass on what follows
        return PROVED, 0
    number, other_number = arm.bodies[part], arm.bodies[other]
    body = room.bodies[number * BODY : (number + 1) * BODY]
    other_body = room.bodies[other_number * BODY : (other_number + 1) * BODY]
    return _parts(trees, root, other_root, body, other_body, measures, mask, room)


@njit_hot
def _parts(
    trees: Any,
    root: int,
    other_root: int,
    body: Any,
    other_body: Any,
    measures: Any,
    mask: int,
    room: Any,
) -> tuple[int, int]:
    """What is known of two parts at some places; and the mask of those that are left."""
    half, bend, _, asked, kept = measures
    waiting, apart, nearing = room.waiting, room.apart, room.nearing
    waiting[0], waiting[1], waiting[2] = root, other_root, mask
    size, left = 3, 0
    while size > 0:
        size -= 3
        i, j, mask = waiting[size], waiting[size + 1], waiting[size + 2]
        point_at_places(body, trees.centers[i], room.point)
        point_at_places(other_body, trees.centers[j], room.other)
        _to_point(room.point, room.other, half, apart, nearing)
        radii = trees.radii[i] + trees.radii[j]
        mask &= _unproved(apart, nearing, radii + bend + kept)
        if mask == 0:
            continue
        end, other_end = trees.skips[i], trees.skips[j]
        is_leaf, is_other_leaf = end == i + 1, other_end == j + 1
        if is_leaf and is_other_leaf:
            inner, other_inner = trees.inner[i], trees.inner[j]
            if inner >= 0.0 and other_inner >= 0.0 and mask & _below(apart, inner + other_inner):
                return TOUCHING, left
            if mask & _below(apart, asked + radii):
                return NEAR, left
            left |= mask
            continue
        fast = mask & _fast(apart, nearing, bend, radii)
        left |= fast
        mask &= ~fast
        splits = is_other_leaf or (not is_leaf and trees.radii[i] > trees.radii[j])
        child, last = (i + 1, end) if splits else (j + 1, other_end)
        while mask != 0 and child < last:
            if size > len(waiting) - 3:
                return UNKNOWN, left
            waiting[size], waiting[size + 1] = (child, j) if splits else (i, child)
            waiting[size + 2] = mask
            size += 3
            child = trees.skips[child]
    return PROVED, left


@njit_simd
def _below(values: Any, least: float) -> int:
    """The mask of places whose values (PLACES,) are no more than something."""
    mask = 0
    for n in range(PLACES):
        mask |= int(values[n] <= least) << n
    return mask


@njit_simd
def _unproved(apart: Any, nearing: Any, least: float) -> int:
    """The mask of places where a distance may become no more than something."""
    mask = 0
    for n in range(PLACES):
        mask |= int(apart[n] - nearing[n] <= least) << n
    return mask


@njit_simd
def _fast(apart: Any, nearing: Any, bend: float, least: float) -> int:
    """The mask of places where a distance of more than something may go to nothing."""
    mask = 0
    for n in range(PLACES):
        mask |= int((apart[n] > least) & (nearing[n] + bend > apart[n])) << n
    return mask


@njit_simd
def _reaches(point: Any, half: float, reach: float, out: Any) -> None:
    """Writes how far about a point (POINT,) what is within a reach of it comes in half a share."""
    for n in range(PLACES):
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        out[n] = reach + half * math.sqrt(u * u + v * v + w * w)


@njit_simd
def _near_ball(point: Any, reaches: Any, row: Any, room: Any) -> int:
    """The mask of places where the sphere that holds a solid is within reach of a point."""
    x, y, z, radius = row[9], row[10], row[11], row[15]
    for n in range(PLACES):
        dx, dy, dz = point[n] - x, point[PLACES + n] - y, point[2 * PLACES + n] - z
        reach = reaches[n] + radius
        room[n] = dx * dx + dy * dy + dz * dz - reach * reach
    return _below(room, 0.0)


@njit_simd
def _to_box(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
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
def _to_cylinder(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
    """As `_to_box`."""
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
def _to_ball(point: Any, row: Any, half: float, apart: Any, nearing: Any) -> None:
    """As `_to_box`."""
    ox, oy, oz, radius = row[9], row[10], row[11], row[17]
    for n in range(PLACES):
        x, y, z = point[n] - ox, point[PLACES + n] - oy, point[2 * PLACES + n] - oz
        u, v, w = point[3 * PLACES + n], point[4 * PLACES + n], point[5 * PLACES + n]
        away = math.sqrt(x * x + y * y + z * z)
        apart[n] = away - radius
        nearing[n] = half * abs(x * u + y * v + z * w) / max(away, _LEAST)


@njit_simd
def _to_point(point: Any, other: Any, half: float, apart: Any, nearing: Any) -> None:
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
