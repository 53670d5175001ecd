"""What spheres prove of an arm's parts, and of pairs of them, about many places of a motion at
once, compiled.

What is proved about a place, and why, says `sphere_proofs`, which asks one place at a time. Places
are the bits of a mask.
"""

from __future__ import annotations

from typing import Any

from envs.collision.primitive_sdf import to_solid
from envs.collision.separation import is_allowed
from envs.collision.shapes import BOX, CYLINDER
from envs.compiled import njit_hot, njit_inline
from envs.robots.motion_places import BODY, PLACES, point_at_places
from envs.robots.motion_proof import bounds_of
from envs.robots.place_distances import (
    below,
    fast,
    near_ball,
    reaches,
    to_ball,
    to_box,
    to_cylinder,
    to_point,
    unproved,
)

PROVED, NEAR, UNKNOWN, TOUCHING = 0, 1, 2, 3
"""What spheres tell: that all keeps what it should, or may in smaller shares of the motion; that at
some place they are no more than what is asked from something; that there is something near of which
they tell nothing; that something is touched."""

_MIDDLE = PLACES // 2
"""The place nearest to the middle of a stretch, of two."""

_FARTHEST = (_MIDDLE + 0.5) / PLACES
"""From there to the farther end, of the stretch."""


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
            reaches(point, half, radius + bend + kept, room.reaches)
            is_reached = True
        row = around.rows[j]
        mask = near_ball(point, room.reaches, row, room.apart)
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
            to_box(point, row, half, apart, nearing)
        elif row[16] == CYLINDER:
            to_cylinder(point, row, half, apart, nearing)
        else:
            to_ball(point, row, half, apart, nearing)
        radius, end = trees.radii[node], trees.skips[node]
        mask &= unproved(apart, nearing, radius + bend + kept)
        if mask == 0:
            continue
        if end == node + 1:
            if mask & below(apart, trees.inner[node]):
                return TOUCHING, left
            if mask & below(apart, asked + radius):
                return NEAR, left
            left |= mask
            continue
        # Smaller spheres would hardly prove it where they move that fast, and none touches.
        hopeless = mask & fast(apart, nearing, bend, asked + radius)
        left |= hopeless
        mask &= ~hopeless
        child = node + 1
        while mask != 0 and child < end:
            if size > len(waiting) - 3:
                return UNKNOWN, left
            waiting[size], waiting[size + 1] = child, mask
            size += 2
            child = trees.skips[child]
    return PROVED, left


@njit_inline
def _pair(arm: Any, trees: Any, part: int, other: int, measures: Any, room: Any) -> tuple[int, int]:
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
    to_point(point, there, half, room.apart, room.nearing)
    mask = unproved(room.apart, room.nearing, radii + bend + kept)
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
        to_point(room.point, room.other, half, apart, nearing)
        radii = trees.radii[i] + trees.radii[j]
        mask &= unproved(apart, nearing, radii + bend + kept)
        if mask == 0:
            continue
        end, other_end = trees.skips[i], trees.skips[j]
        is_leaf, is_other_leaf = end == i + 1, other_end == j + 1
        if is_leaf and is_other_leaf:
            inner, other_inner = trees.inner[i], trees.inner[j]
            if inner >= 0.0 and other_inner >= 0.0 and mask & below(apart, inner + other_inner):
                return TOUCHING, left
            if mask & below(apart, asked + radii):
                return NEAR, left
            left |= mask
            continue
        hopeless = mask & fast(apart, nearing, bend, radii)
        left |= hopeless
        mask &= ~hopeless
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
