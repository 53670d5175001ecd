"""Proofs that motions of arms are free, compiled: by spheres where these tell, else by distances.

As `envs.collision.continuous.segment_is_free`, but each part of the arm, and each pair of its
parts, is covered by shares of the motion of its own: those near the base move little, and may be
near obstacles; links of a wrist are near each other wherever it moves them. See `sphere_proofs` for
what is proved of a share at its middle; what is not is halved.

The acceleration of a point x is bounded from the joints before it, of which joint i turns by w_i:
d^2 x / dq_i dq_j = a_i x (a_j x (x - o_j)), j being farther out, is no longer than x is off the
axis of j, so that B = sum_j w_j (w_j + 2 sum_(i < j) w_i) reach_j.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.separation import are_beyond, is_allowed, separated
from envs.compiled import njit_cached, njit_hot
from envs.robots.arm_clearance import apart, moved_rows
from envs.robots.kinematic_tree import body_motions, body_poses
from envs.robots.sphere_proofs import (
    OPEN,
    REFUTED,
    STACK,
    TOUCHING,
    Bodies,
    Bounds,
    measures_of,
    next_in_doubt,
    pair_by_distance,
    part_by_distances,
)
from envs.robots.table_proofs import place_in_tables

_DEEPEST = 40
"""Halvings after which a motion is taken to be blocked: what is left is shorter than numbers
tell."""


@njit_cached
def prove(
    arm: Any,
    trees: Any,
    tables: Any,
    around: Any,
    may_touch: Any,
    a: Any,
    b: Any,
    asked: float,
    kept: float,
) -> tuple[float, bool]:
    """A place t of the straight motion from a to b (d,) at which an arm is not known to be more
    than `asked` from obstacles and itself, or -1 if it is proved to keep more than `kept` all
    along. And whether something surely touches at that place.

    Whether something is within another is not asked: where nothing is touched, that does not
    change along a motion; see `nothing_within`.

    Args:
        arm: `RobotArrays`, whose pairs of parts are those without tables.
        trees: `SphereTrees` of its parts.
        tables: `PairTables` of the other pairs.
        around: the obstacles, `Shapes`.
        may_touch: which parts may touch which of them, see `contacts_array`.
        asked, kept: in workspace units, the former more than the latter.
    """
    place, touches = prove_but_tables(arm, trees, around, may_touch, a, b, asked, kept)
    if place >= 0:
        return place, touches
    return place_in_tables(arm, tables, a, b, asked, kept), False


@njit_cached
def prove_but_tables(
    arm: Any,
    trees: Any,
    around: Any,
    may_touch: Any,
    a: Any,
    b: Any,
    asked: float,
    kept: float,
) -> tuple[float, bool]:
    """As `prove`, of all but the pairs that have tables."""
    tree, parts = arm.tree, arm.moving
    items = parts + len(arm.branches)
    speeds, bends, moves = np.empty(len(tree.parents)), np.empty(items), np.empty(items)
    for joint in range(len(speeds)):
        k = tree.coordinates[joint]
        speeds[joint] = tree.ratios[joint] * (b[k] - a[k])
    count = 1 + len(speeds)
    bound(arm, trees, speeds, np.empty(count), bends, moves)
    bodies = Bodies(np.empty((count, 3, 4)), np.empty((count, 3)), np.empty((count, 3)))
    near, stack = np.empty(len(around.rows), dtype=np.int64), np.empty(STACK, dtype=np.int64)
    shares, waiting = np.zeros(items, dtype=np.int64), np.empty(items, dtype=np.int64)
    for n in range(items):  # those farther out first: what moves most touches first
        waiting[n] = parts - 1 - n if n < parts else n
    width = 1.0
    for _ in range(_DEEPEST):
        states = np.empty(items, dtype=np.int64)
        next_shares, next_waiting = np.empty(2 * items, np.int64), np.empty(2 * items, np.int64)
        end = following = 0
        while end < items:
            begin, share, half = end, shares[end], width / 2
            while end < items and shares[end] == share:
                end += 1
            t = (share + 0.5) * width
            body_motions(tree, a + t * (b - a), speeds, bodies[0], bodies[1], bodies[2])
            bounds, n = Bounds(half, bends, moves, asked, kept), begin
            while True:
                n, asks = next_in_doubt(
                    arm,
                    trees,
                    around,
                    may_touch,
                    waiting,
                    n,
                    end,
                    bodies,
                    bounds,
                    states,
                    near,
                    stack,
                )
                if n == end:
                    break
                item, known, place = waiting[n], states[n], 0.5
                measures = measures_of(bounds, item)
                if asks > 0:
                    some = near[:asks]
                    known = part_by_distances(arm, around, item, known, bodies, measures, some)
                elif known == REFUTED:
                    low, high = a + (t - half) * (b - a), a + (t + half) * (b - a)
                    pair = arm.branches[item - parts]
                    known, place = pair_by_distance(arm, pair, low, high, bodies, measures)
                if known >= REFUTED:
                    return t + (2 * place - 1) * half, known == TOUCHING
                states[n] = known
                n += 1
            for child in range(2 * share, 2 * share + 2):
                for n in range(begin, end):
                    if states[n] == OPEN:
                        next_shares[following], next_waiting[following] = child, waiting[n]
                        following += 1
        if following == 0:
            return -1.0, False
        shares, waiting, items, width = next_shares, next_waiting, following, width / 2
    return shares[0] * width, False


@njit_cached
def nothing_within(arm: Any, around: Any, may_touch: Any, q: Any) -> bool:
    """Whether it is known that at a configuration (d,) where nothing is touched, nothing is within
    another: that hulls tell. Of solids that are no meshes it always is."""
    bodies, still = np.empty((1 + len(arm.tree.parents), 3, 4)), np.eye(3, 4)
    body_poses(arm.tree, q, bodies)
    rows = moved_rows(arm, bodies)
    for part in range(arm.moving):
        pose = bodies[arm.bodies[part]]
        for j in range(len(around.rows)):
            if arm.shapes.roots[part] < 0 and around.roots[j] < 0:
                continue
            if is_allowed(may_touch, part, j) or are_beyond(rows[part], around.rows[j], 0.0):
                continue
            other = around.rows[j]
            if not separated(arm.shapes, part, rows[part], pose, around, j, other, still, 0.0)[1]:
                return False
    for n in range(len(arm.branches)):
        part, other = arm.branches[n, 0], arm.branches[n, 1]
        has_mesh = arm.shapes.roots[part] >= 0 or arm.shapes.roots[other] >= 0
        if has_mesh and not apart(arm, bodies, rows, part, other, 0.0)[1]:
            return False
    return True


@njit_hot
def bound(arm: Any, trees: Any, speeds: Any, turned: Any, bends: Any, moves: Any) -> None:
    """Writes bounds (moving + k,) on the acceleration and the speed of any point of each part, and
    of the points of each pair of parts as seen from each other, per unit of t.

    Args:
        speeds: (m,) of the joints.
        turned: (1 + m,) is written to, see `turns_of`.
    """
    turns_of(arm.tree, speeds, turned)
    for item in range(arm.moving + len(arm.branches)):
        bends[item], moves[item] = bounds_of(arm, trees, speeds, turned, item)


@njit_hot
def turns_of(tree: Any, speeds: Any, turned: Any) -> None:
    """Writes how fast the joints up to each body turn it together, at most, (1 + m,)."""
    turned[0] = 0.0
    for joint in range(len(speeds)):
        turns = 0.0 if tree.prismatic[joint] else abs(speeds[joint])
        turned[joint + 1] = turned[tree.parents[joint]] + turns


@njit_hot
def bounds_of(arm: Any, trees: Any, speeds: Any, turned: Any, item: int) -> tuple[float, float]:
    """Those of one part or pair of parts, see `bound`."""
    if item < arm.moving:
        return _seen_from(arm, trees, speeds, turned, item, 0)
    pair = arm.branches[item - arm.moving]
    bends, moves = _seen_from(arm, trees, speeds, turned, pair[0], pair[2])
    more_bends, more_moves = _seen_from(arm, trees, speeds, turned, pair[1], pair[2])
    return bends + more_bends, moves + more_moves


@njit_hot
def _seen_from(
    arm: Any, trees: Any, speeds: Any, turned: Any, part: int, branch: int
) -> tuple[float, float]:
    """Those of a part as seen from a body that it is on."""
    tree, body, bends, moves = arm.tree, arm.bodies[part], 0.0, 0.0
    more = trees.beyond[part]  # than what `reach` is of
    while body != branch:
        joint = body - 1
        speed = abs(speeds[joint])
        body = tree.parents[joint]
        before = turned[body] - turned[branch]
        if tree.prismatic[joint]:
            moves += speed
            bends += 2 * speed * before
        else:
            reach = arm.reach[joint, part] + more
            moves += speed * reach
            bends += speed * (speed + 2 * before) * reach
    return bends, moves
