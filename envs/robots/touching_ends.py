"""Which of many configurations of an arm surely touch something, all at once, compiled.

Most of what a search tries ends in something that is in the way. Spheres that are wholly within
parts tell of that: where one reaches into an obstacle there is contact. Parts that touch each other
are left to those who ask about one at a time: links beside each other are near in all. The
configurations are the bits of a mask.
"""

from __future__ import annotations

from typing import Any

from envs.collision.motion_check import LANES
from envs.collision.separation import is_allowed
from envs.collision.shapes import BOX, CYLINDER
from envs.compiled import njit_hot, njit_inline
from envs.robots.motion_places import BODY, PLACES, bodies_at_configurations, point_at_places
from envs.robots.place_distances import below, near_ball, to_ball, to_box, to_cylinder

assert LANES == PLACES

_ALL = (1 << LANES) - 1


@njit_hot
def ends_that_touch(check: Any, q: Any) -> int:
    """The mask of configurations (LANES, d) of which spheres tell that an obstacle is touched.

    Args:
        check: `ArmMotionCheck`.
    """
    arm, trees, room = check.arm, check.trees, check.room
    bodies_at_configurations(arm.tree, q, room.bodies, room.turns)
    touching = 0
    for part in range(arm.moving - 1, -1, -1):  # those farthest out, which move most, first
        touching |= _part(arm, trees, check.around, check.may_touch, part, touching, room)
        if touching == _ALL:
            break
    return touching


@njit_inline
def _part(
    arm: Any, trees: Any, around: Any, may_touch: Any, part: int, touching: int, room: Any
) -> int:
    """The mask of those where a part touches an obstacle that is no mesh."""
    root, number, found = trees.firsts[part], arm.bodies[part], 0
    body = room.bodies[number * BODY : (number + 1) * BODY]
    point_at_places(body, trees.centers[root], room.roots[part])
    if trees.inner[root] < 0.0:
        return 0
    room.reaches[:] = trees.inner[root]
    for j in range(len(around.rows)):
        row = around.rows[j]
        mask = near_ball(room.roots[part], room.reaches, row, room.apart) & ~touching & ~found
        if mask != 0 and around.roots[j] < 0 and not is_allowed(may_touch, part, j):
            found |= _part_and_solid(trees, root, body, row, mask, room)
    return found


@njit_hot
def _part_and_solid(trees: Any, root: int, body: Any, row: Any, mask: int, room: Any) -> int:
    """The mask of those where spheres within a part reach into a solid."""
    waiting, point, apart, found = room.waiting, room.point, room.apart, 0
    waiting[0], waiting[1] = root, mask
    size = 2
    while size > 0:
        size -= 2
        node, mask = waiting[size], waiting[size + 1] & ~found
        if mask == 0:
            continue
        point_at_places(body, trees.centers[node], point)
        if row[16] == BOX:
            to_box(point, row, 0.0, apart, room.nearing)
        elif row[16] == CYLINDER:
            to_cylinder(point, row, 0.0, apart, room.nearing)
        else:
            to_ball(point, row, 0.0, apart, room.nearing)
        mask &= below(apart, trees.inner[node])
        child, end = node + 1, trees.skips[node]
        if child == end:
            found |= mask
            continue
        while mask != 0 and child < end and size <= len(waiting) - 2:
            waiting[size], waiting[size + 1] = child, mask
            size += 2
            child = trees.skips[child]
    return found
