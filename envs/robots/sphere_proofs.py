"""What spheres and distances prove of a part of an arm, or of a pair of its parts, about the middle
of a share of a motion, compiled.

There a sphere about c, which covers some of a part, moves with velocity v. Within half of the share
h it comes no nearer to a convex obstacle, whose nearest point lies in the direction n, than

    |c - obstacle| - h |n . v| - h^2 / 2 B,

where B bounds its acceleration: the obstacle lies beyond the plane through its nearest point, so
that n need not be followed. The same holds of two spheres that both move, n being along the line
between them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from envs.collision.gjk import at, hull_distance, moved
from envs.collision.separation import corners, is_allowed, separated
from envs.collision.shapes import BOX, CYLINDER, ROW
from envs.compiled import njit_cached, njit_hot, njit_inline
from envs.problem import Array
from envs.robots.arm_clearance import NEAR, within_reach
from envs.robots.swept_pairs import place_of_nearing

PROVED, OPEN, REFUTED, TOUCHING = 0, 1, 2, 3
"""What is known of a part or a pair in a share of a motion: that it keeps what it should; not yet;
that somewhere it may not keep what is asked; that something is touched in the middle."""

STACK = 512
"""Numbers that `pair_by_spheres` needs room for."""

_FAR_APART = 0.002
"""Metres between the hulls of two meshes from which halving takes less time than their surfaces."""


class Bodies(NamedTuple):
    """Poses (1 + m, 3, 4) of an arm's bodies, the velocities (1 + m, 3) of their origins, and their
    angular velocities (1 + m, 3)."""

    poses: Array
    shifts: Array
    spins: Array


class Bounds(NamedTuple):
    """Of a share of a motion.

    Attributes:
        half: of the share.
        bends, moves: (k,) bounds on accelerations and speeds, see `motion_proof.bound`.
        asked, kept: in workspace units.
    """

    half: float
    bends: Array
    moves: Array
    asked: float
    kept: float


@njit_inline
def _carried(point: Any, pose: Any, shift: Any, spin: Any) -> Any:
    """Where a point (3,) of a body is, and its velocity."""
    x, y, z = at(pose, point)
    rx, ry, rz = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    return (
        x,
        y,
        z,
        shift[0] + spin[1] * rz - spin[2] * ry,
        shift[1] + spin[2] * rx - spin[0] * rz,
        shift[2] + spin[0] * ry - spin[1] * rx,
    )


@njit_inline
def _nearing(rows: Any, j: int, place: Any) -> tuple[float, float]:
    """The signed distance of a point from solid j, and how fast it changes with the point's
    velocity: where outside, its size along the direction of the nearest point; see `to_solid`."""
    x, y, z, u, v, w = place
    x, y, z = x - rows[j, 9], y - rows[j, 10], z - rows[j, 11]
    a = rows[j, 0] * x + rows[j, 1] * y + rows[j, 2] * z
    b = rows[j, 3] * x + rows[j, 4] * y + rows[j, 5] * z
    c = rows[j, 6] * x + rows[j, 7] * y + rows[j, 8] * z
    va = rows[j, 0] * u + rows[j, 1] * v + rows[j, 2] * w
    vb = rows[j, 3] * u + rows[j, 4] * v + rows[j, 5] * w
    vc = rows[j, 6] * u + rows[j, 7] * v + rows[j, 8] * w
    if rows[j, 16] == CYLINDER:
        out = math.sqrt(a * a + b * b)
        aside, above = out - rows[j, 12], abs(c) - rows[j, 13]
        deep = min(max(aside, above), 0.0)
        aside, above = max(aside, 0.0), max(above, 0.0)
        if aside > 0.0:
            a, b = a / out * aside, b / out * aside
        else:
            a = b = 0.0
        c = math.copysign(above, c)
    elif rows[j, 16] == BOX:
        da, db, dc = abs(a) - rows[j, 12], abs(b) - rows[j, 13], abs(c) - rows[j, 14]
        deep = min(max(da, db, dc), 0.0)
        a = math.copysign(max(da, 0.0), a)
        b = math.copysign(max(db, 0.0), b)
        c = math.copysign(max(dc, 0.0), c)
    else:
        deep = 0.0
    away = math.sqrt(a * a + b * b + c * c)
    rate = abs(a * va + b * vb + c * vc) / away if away > 0.0 else 0.0
    return away + deep - rows[j, 17], rate


@njit_cached
def part_by_distances(
    arm: Any, around: Any, part: int, known: int, bodies: Any, measures: Any, near: Any
) -> int:
    """What is known of a part by its distances from some obstacles, and of what else is `known`."""
    half, bend, move, asked, kept = measures
    body, middle = arm.bodies[part], arm.middles[part]
    pose, spin = bodies[0][body], bodies[2][body]
    # What the velocities of now tell may be less.
    _, _, _, u, v, w = _carried(middle, pose, bodies[1][body], spin)
    turned = arm.radii[part] * math.sqrt((spin * spin).sum())
    move = min(move, half * (math.sqrt(u * u + v * v + w * w) + turned) + bend)
    row, still = np.empty(ROW), np.eye(3, 4)
    moved(arm.shapes.rows[part], pose, row)
    for j in near:
        most = within_reach(arm.shapes, part, around, j, max(move + kept, 2 * asked - kept))
        other = around.rows[j]
        found = separated(arm.shapes, part, row, pose, around, j, other, still, most)[0]
        if found <= asked:
            return REFUTED
        if found - kept <= move:
            known = OPEN
    return known


@njit_inline
def _spheres(
    trees: Any,
    part: int,
    rows: Any,
    j: int,
    pose: Any,
    shift: Any,
    spin: Any,
    measures: Any,
) -> int:
    """What a tree of spheres tells of a part and solid j. `REFUTED` where some sphere is no more
    than what is asked from it."""
    half, bend, _, asked, kept = measures
    known, node = PROVED, trees.firsts[part]
    end = trees.firsts[part + 1]
    while node < end:
        distance, rate = _nearing(rows, j, _carried(trees.centers[node], pose, shift, spin))
        if distance - trees.radii[node] - half * rate - bend > kept and distance > 0.0:
            node = trees.skips[node]
            continue
        move = half * rate + bend
        if move > distance and distance > asked + trees.radii[node]:
            known = max(known, OPEN)  # smaller spheres would hardly prove it, and none touches
            node = trees.skips[node]
            continue
        if trees.skips[node] == node + 1:
            if distance < trees.inner[node]:
                return TOUCHING
            known = max(known, REFUTED if distance - trees.radii[node] <= asked else OPEN)
        node += 1
    return known


@njit_inline
def _part_by_spheres(
    arm: Any,
    trees: Any,
    around: Any,
    may_touch: Any,
    part: int,
    bodies: Any,
    measures: Any,
    near: Any,
) -> tuple[int, int]:
    """What spheres tell of a part and obstacles, but for those that they do not tell enough of:
    writes their numbers and returns how many they are."""
    half, bend, _, _, kept = measures
    body, root = arm.bodies[part], trees.firsts[part]
    pose, shift, spin = bodies[0][body], bodies[1][body], bodies[2][body]
    x, y, z, u, v, w = _carried(trees.centers[root], pose, shift, spin)
    # No point of the part comes farther within half the interval.
    reach = trees.radii[root] + half * math.sqrt(u * u + v * v + w * w) + bend + kept
    known, count = PROVED, 0
    for j in range(len(around.rows)):
        beyond = reach + around.rows[j, 15]
        dx, dy, dz = x - around.rows[j, 9], y - around.rows[j, 10], z - around.rows[j, 11]
        if dx * dx + dy * dy + dz * dz > beyond * beyond or is_allowed(may_touch, part, j):
            continue
        found = REFUTED
        if around.roots[j] < 0:
            found = _spheres(trees, part, around.rows, j, pose, shift, spin, measures)
        if found == TOUCHING:
            return TOUCHING, 0
        if found == REFUTED:
            near[count] = j
            count += 1
        elif found == OPEN:
            known = OPEN
    return known, count


@njit_cached
def pair_by_distance(
    arm: Any, pair: Any, a: Any, b: Any, bodies: Any, measures: Any
) -> tuple[int, float]:
    """What is known of a pair of parts (3,) by how far they are apart, on the motion from a to b
    (d,) that is the share; and where on it that is so, in [0, 1]."""
    part, other = pair[0], pair[1]
    _, _, move, asked, kept = measures
    shapes = arm.shapes
    row, there = np.empty(ROW), np.empty(ROW)
    pose, at_other = bodies[0][arm.bodies[part]], bodies[0][arm.bodies[other]]
    moved(shapes.rows[part], pose, row)
    moved(shapes.rows[other], at_other, there)
    if shapes.roots[part] >= 0 and shapes.roots[other] >= 0:
        hulls = hull_distance(
            row, corners(shapes, part), there, corners(shapes, other), move + kept
        )
        if hulls - kept > move:
            return PROVED, 0.5
        if hulls > max(_FAR_APART, asked):
            return OPEN, 0.5
        if asked > NEAR:
            return REFUTED, 0.5
        place = place_of_nearing(arm, pair.reshape(1, 3), a, b, asked, kept)
        return PROVED if place < 0 else REFUTED, place
    most = within_reach(shapes, part, shapes, other, max(move + kept, 2 * asked - kept))
    distance = separated(shapes, part, row, pose, shapes, other, there, at_other, most)[0]
    if distance <= asked:
        return REFUTED, 0.5
    return PROVED if distance - kept > move else OPEN, 0.5


@njit_inline
def _pair_by_spheres(
    arm: Any, trees: Any, pair: Any, bodies: Any, measures: Any, stack: Any
) -> int:
    """What spheres tell of a pair of parts (3,). `REFUTED` where some are no more than what is
    asked apart, or too many would have to be asked."""
    half, bend, _, asked, kept = measures
    part, other = pair[0], pair[1]
    body, at_other = arm.bodies[part], arm.bodies[other]
    pose, shift, spin = bodies[0][body], bodies[1][body], bodies[2][body]
    pose_2, shift_2, spin_2 = bodies[0][at_other], bodies[1][at_other], bodies[2][at_other]
    stack[0], stack[1] = trees.firsts[part], trees.firsts[other]
    size = 2
    while size > 0:
        size -= 2
        i, j = stack[size], stack[size + 1]
        x, y, z, u, v, w = _carried(trees.centers[i], pose, shift, spin)
        x2, y2, z2, u2, v2, w2 = _carried(trees.centers[j], pose_2, shift_2, spin_2)
        x, y, z, u, v, w = x - x2, y - y2, z - z2, u - u2, v - v2, w - w2
        distance = math.sqrt(x * x + y * y + z * z)
        radii = trees.radii[i] + trees.radii[j]
        move = bend
        if distance > radii:
            move += half * abs(x * u + y * v + z * w) / distance
            if distance - radii - move > kept:
                continue
            if move > distance and move > radii:
                return OPEN  # which smaller spheres would hardly change
        is_leaf, is_other_leaf = trees.skips[i] == i + 1, trees.skips[j] == j + 1
        if is_leaf and is_other_leaf:
            inner, inner_2 = trees.inner[i], trees.inner[j]
            if inner >= 0.0 and inner_2 >= 0.0 and distance < inner + inner_2:
                return TOUCHING
            return REFUTED if distance - radii <= asked else OPEN
        if size > len(stack) - 16:
            return REFUTED
        if is_other_leaf or (not is_leaf and trees.radii[i] > trees.radii[j]):
            child = i + 1
            while child < trees.skips[i]:
                stack[size], stack[size + 1] = child, j
                size += 2
                child = trees.skips[child]
        else:
            child = j + 1
            while child < trees.skips[j]:
                stack[size], stack[size + 1] = i, child
                size += 2
                child = trees.skips[child]
    return PROVED


@njit_inline
def measures_of(bounds: Any, item: int) -> Any:
    """Half of the share, how far points may bend from straight ways in it, how far they may move in
    it, and what is asked and kept, of one part or pair."""
    half, bends, moves, asked, kept = bounds
    return half, bends[item] * half * half / 2, moves[item] * half, asked, kept


@njit_hot
def next_in_doubt(
    arm: Any,
    trees: Any,
    around: Any,
    may_touch: Any,
    items: Any,
    n: int,
    end: int,
    bodies: Any,
    bounds: Any,
    states: Any,
    near: Any,
    stack: Any,
) -> tuple[int, int]:
    """Asks spheres about parts and pairs, until there is one of which they do not tell enough.

    One call asks about many: arms are many arrays, and to pass these on takes longer than to ask.

    Args:
        items: numbers (k,) of parts, or of pairs after them.
        n, end: which of them are asked.
        bodies: `Bodies` in the middle of the share.
        bounds: `Bounds`.
        states: (k,) what is known of each is written here.
        near: the obstacles are written here that are to be asked for their distances from a part.
        stack: room for `STACK` numbers.

    Returns:
        which item it is, `end` if none; and the number of those obstacles.
    """
    while n < end:
        item, count = items[n], 0
        measures = measures_of(bounds, item)
        if item < arm.moving:
            known, count = _part_by_spheres(
                arm, trees, around, may_touch, item, bodies, measures, near
            )
        else:
            pair = arm.branches[item - arm.moving]
            known = _pair_by_spheres(arm, trees, pair, bodies, measures, stack)
        states[n] = known
        if count > 0 or known >= REFUTED:
            return n, count
        n += 1
    return n, 0
