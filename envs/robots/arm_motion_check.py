"""Motions of arms: for planners that are compiled themselves, and what is told of them quickly."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.motion_check import (
    LANES,
    MOTION_FREE,
    MOTION_NEARS,
    MOTION_OPEN,
    MOTION_TOUCHES,
    array_at,
    checks_motions,
    known_as,
    tells_of_ends,
)
from envs.collision.separation import Shapes
from envs.compiled import njit_cached, njit_hot
from envs.robots.arm import RobotArrays
from envs.robots.kinematic_tree import body_motions
from envs.robots.motion_places import PLACES, bodies_at_places
from envs.robots.motion_proof import prove_but_tables, turns_of
from envs.robots.pair_tables import PairTables
from envs.robots.place_proofs import NEAR, PROVED, TOUCHING, UNKNOWN, ask_spheres
from envs.robots.rrt_connect import write_reached
from envs.robots.sphere_proofs import next_in_doubt
from envs.robots.sphere_trees import SphereTrees
from envs.robots.table_proofs import are_known_by_tables, keep_by_cells
from envs.robots.touching_ends import ends_that_touch
from envs.robots.working_room import Room

FREE, BLOCKED, TABLES_LEFT, OPEN = 0, 1, 2, 3
"""What is told of a motion at once: that it is proved free; that it is not; that spheres prove it,
and tables have to be filled; that more must be asked."""

_LEVELS = 4
"""Of shares, each a `PLACES`-th of the one before; what is left after these is not told by
spheres."""

_WAYS_OUT = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Shares of a motion after which it may have come away from what it begins near."""


class ArmMotionCheck(NamedTuple):
    """An arm without spherical joints among obstacles.

    Attributes:
        arm: with the pairs of parts that have no tables.
        trees: of spheres that cover its parts.
        tables: of the other pairs.
        around: the obstacles.
        may_touch: which parts may touch which of them, see `contacts_array`.
        tolerance: in metres.
        room: to work in.
    """

    arm: RobotArrays
    trees: SphereTrees
    tables: PairTables
    around: Shapes
    may_touch: NDArray[np.bool_]
    tolerance: float
    room: Room


class QuickArmCheck(NamedTuple):
    """What an `ArmMotionCheck` is told quickly, for those who ask distances of all that is left."""

    check: ArmMotionCheck


@checks_motions(QuickArmCheck)
def _told_quickly(known: Any, a: Any, b: Any, size: int) -> int:
    """Where spheres do not tell of the end of a motion, its distances are asked: most motions that
    are not free are not so there, and to look for a place takes many times as long."""
    check = known_as(known, "QuickArmCheck").check
    begin, end, kept = array_at(a, size), check.room.end, check.tolerance / 2
    write_reached(check.arm.tree.wraps, begin, array_at(b, size), end)
    told = _known_at(check, end)
    if told == PROVED:
        told = _known_of(check, begin, end)
        if told == PROVED and are_known_by_tables(check.tables, begin, end, kept):
            return MOTION_FREE
    elif told != TOUCHING:
        rest = check.arm, check.trees, check.around, check.may_touch
        place, touches = prove_but_tables(*rest, end, end, check.tolerance, kept)
        if place >= 0:
            return MOTION_TOUCHES if touches else MOTION_NEARS
    return MOTION_TOUCHES if told == TOUCHING else MOTION_OPEN


@checks_motions(ArmMotionCheck)
def _arm_motion_is_free(known: Any, a: Any, b: Any, size: int) -> bool:
    """Spheres, and what tables know already, tell of most motions. Distances, which take a hundred
    times as long, are asked only of motions that begin where spheres do not tell apart what is
    near: out of there a planner must come. Elsewhere what they do not tell apart is refused."""
    told = _told(known, array_at(a, size), array_at(b, size))
    if told <= BLOCKED:
        return bool(told == FREE)
    return bool(_found(known, array_at(a, size), array_at(b, size), told == TABLES_LEFT))


@tells_of_ends(ArmMotionCheck)
def _ends_that_touch(known: Any, ends: Any, size: int) -> int:
    return int(ends_that_touch(known_as(known, "ArmMotionCheck"), array_at(ends, (LANES, size))))


@njit_hot
def _told(known: Any, a: Any, b: Any) -> int:
    """What spheres and tables tell at once. What is in the way of a motion is nearly always in the
    way at its end, too, which is asked first."""
    check = known_as(known, "ArmMotionCheck")
    room, kept = check.room, check.tolerance / 2
    write_reached(check.arm.tree.wraps, a, b, room.end)
    told = _known_at(check, room.end)
    if told == PROVED:
        told = _known_of(check, a, room.end)
        if told == PROVED:
            return FREE if are_known_by_tables(check.tables, a, room.end, kept) else TABLES_LEFT
    if told == NEAR:
        told = _known_at(check, a)
        if told == NEAR:
            return _from_way_out(check, a, room.end)
        return BLOCKED if told == PROVED else _all_open(room)
    return BLOCKED if told == TOUCHING else _all_open(room)


@njit_hot
def _from_way_out(check: Any, a: Any, b: Any) -> int:
    """What is told of a motion, of whose beginning spheres tell too little: of the rest of it,
    after a place to where it has come away from what is near."""
    room = check.room
    for share in _WAYS_OUT:
        for i in range(len(a)):
            room.out[i] = a[i] + share * (b[i] - a[i])
        told = _known_at(check, room.out)
        if told == NEAR:
            continue
        if told == PROVED:
            told = _known_of(check, room.out, b)
        if told == PROVED:
            return OPEN
        return _all_open(room) if told == UNKNOWN else BLOCKED
    return _all_open(room)


@njit_hot
def _all_open(room: Any) -> int:
    """Distances are to be asked of all of the motion."""
    for i in range(len(room.end)):
        room.out[i] = room.end[i]
    return OPEN


@njit_cached
def _found(known: Any, a: Any, b: Any, is_proved_by_spheres: bool) -> bool:
    """What tables and distances tell of a motion that has been told of."""
    check = known_as(known, "ArmMotionCheck")
    asked, kept, end, out = check.tolerance, check.tolerance / 2, check.room.end, check.room.out
    if not is_proved_by_spheres:
        rest = check.arm, check.trees, check.around, check.may_touch
        if prove_but_tables(*rest, out, out, asked, kept)[0] >= 0:
            return False
        if prove_but_tables(*rest, a, out, asked, kept)[0] >= 0:
            return False
    return bool(keep_by_cells(check.arm, check.tables, a, end, asked, kept))


@njit_hot
def _known_at(check: Any, q: Any) -> int:
    """What spheres tell of a configuration (d,): of meshes among the obstacles nothing."""
    arm, room = check.arm, check.room
    body_motions(arm.tree, q, room.none, room.at.poses, room.at.shifts, room.at.spins)
    n, known = 0, PROVED
    while True:
        n, asks = next_in_doubt(
            arm,
            check.trees,
            check.around,
            check.may_touch,
            room.order,
            n,
            len(room.order),
            room.at,
            room.still,
            room.states,
            room.near,
            room.waiting,
        )
        if n == len(room.order):
            return known
        if room.states[n] == TOUCHING:
            return TOUCHING
        known = max(known, NEAR)
        for k in range(asks):
            if check.around.roots[room.near[k]] >= 0:
                known = UNKNOWN
        n += 1


@njit_hot
def _known_of(check: Any, a: Any, b: Any) -> int:
    """What spheres tell of the motion from a to b (d,), in ever smaller shares of it."""
    arm = check.arm
    room = check.room
    tree = arm.tree
    for joint in range(len(tree.parents)):
        k = tree.coordinates[joint]
        room.speeds[joint] = tree.ratios[joint] * (b[k] - a[k])
    turns_of(tree, room.speeds, room.turned)
    room.bends[:] = -1.0
    items, width = len(room.order), 1.0
    for n in range(items):
        room.shares[0, n], room.items[0, n] = 0, room.order[n]
    for level in range(_LEVELS):
        this, other = level % 2, 1 - level % 2
        shares = room.shares[this]
        waiting = room.items[this]
        left = room.left
        end = following = 0
        while end < items:
            begin, share = end, shares[end]
            while end < items and shares[end] == share:
                end += 1
            bodies_at_places(tree, a, b, share * width, width, room.bodies, room.turns)
            known = ask_spheres(
                arm,
                check.trees,
                check.around,
                check.may_touch,
                waiting[begin:end],
                width,
                check.tolerance,
                room,
                left[begin:end],
            )
            if known != PROVED:
                return known
            for place in range(PLACES):
                for n in range(begin, end):
                    if left[n] >> place & 1:
                        if following == len(left):
                            return UNKNOWN
                        room.shares[other, following] = PLACES * share + place
                        room.items[other, following] = waiting[n]
                        following += 1
        if following == 0:
            return PROVED
        items, width = following, width / PLACES
    return UNKNOWN
