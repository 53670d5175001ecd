"""Distances of the same shapes at one configuration after another, compiled.

What was known of two shapes a moment ago, less what they have been moved since, is a bound of their
distance now. Along a path few pairs can be the nearest then, and only those are asked again.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.collision.gjk import distance, moved
from envs.collision.mesh_distance import mesh_to_mesh
from envs.collision.mesh_fronts import distance_by_front, fronts_for, take_front
from envs.collision.separation import (
    boxes_apart,
    is_allowed,
    pose_between,
    separated_within,
    sphere_gap,
    told_by_hulls,
)
from envs.collision.shapes import ROW
from envs.compiled import njit_cached, njit_hot, njit_inline

ROUNDING = 1e-6
"""By how much a distance may be found too short, in workspace units, or of it where it is over one;
see `envs.collision.separation`."""

_FRONTS = 8
"""Pairs of meshes at most whose surfaces are asked by fronts."""

_OFTEN = 4
"""How often the surfaces of a pair are asked until there is a front of them."""

_OF_POSES = 1e-12
"""By how much something may be moved farther than computed, in workspace units."""


@njit_cached
def listed_pairs(pairs: Any, shapes: int, moving: int, around: int, may_touch: Any) -> Any:
    """All that must not touch, (k, 2): pairs of a robot's shapes, then each that moves with each
    that stands still, which count from the number of the robot's shapes on.

    Args:
        pairs: (n, 2) of the robot's shapes.
        shapes, moving: how many it has, and how many of them move.
        around: how many stand still.
        may_touch: which may touch which of these, see `contacts_array`.
    """
    each, k = np.empty((len(pairs) + moving * around, 2), dtype=np.int64), 0
    for pair in pairs:
        each[k, 0], each[k, 1] = pair[0], pair[1]
        k += 1
    for part in range(moving):
        for j in range(around):
            if not is_allowed(may_touch, part, j):
                each[k, 0], each[k, 1] = part, shapes + j
                k += 1
    return each[:k]


@njit_inline
def apart_now(
    shapes: Any,
    rows: Any,
    frames: Any,
    around: Any,
    still: Any,
    part: int,
    other: int,
    most: float,
    reach: float,
) -> tuple[float, bool]:
    """`separated_within` of a robot's shape and another, or one that stands still, numbered as in
    `listed_pairs`; or something less that is at least `most`. It is made part of its callers: to
    hand it what it needs would take as long as most distances.

    Args:
        rows: (p, ROW) of the robot's shapes where they are now.
        frames: (p, 3, 4) that they are placed in.
        still: (3, 4), the frame of those that stand still.
    """
    row, j = rows[part], other - len(rows)
    there, root = (rows[other], shapes.roots[other]) if j < 0 else (around.rows[j], around.roots[j])
    found, known = sphere_gap(row, there), True
    if found >= most:
        return found, known
    if shapes.roots[part] < 0 and root < 0:
        return distance(row, there, most), known
    pose = frames[part]
    if shapes.roots[part] >= 0:  # boxes about meshes are quicker to tell
        if j < 0:
            found = boxes_apart(shapes, part, pose, shapes, other, there, frames[other], most)
        else:
            found = boxes_apart(shapes, part, pose, around, j, there, still, most)
        if found >= most:
            return found, known
    if j < 0:
        at = frames[other]
        return separated_within(shapes, part, row, pose, shapes, other, there, at, most, reach)
    return separated_within(shapes, part, row, pose, around, j, there, still, most, reach)


@njit_hot
def is_beyond(bound: float, most: float) -> bool:
    """Whether what is at least `bound` apart is found to be no less than `most` apart."""
    return bool(bound - ROUNDING * max(1.0, bound) >= most)


@njit_cached
def least_along(
    shapes: Any,
    poses: Any,
    around: Any,
    pairs: Any,
    moving: int,
    may_touch: Any,
    near: float,
    least: Any,
    is_near: Any,
    known: Any,
    follows: Any,
) -> None:
    """Writes the least distance (n,) of what must not touch at each of n configurations, as
    `separated` has it; which shapes (n, moving) are no farther than `near` from anything, as far as
    nothing touches; whether it is known (n,) that nothing is within another; and where not, whether
    that follows (n,) from its being so at the configuration before.

    Args:
        shapes: the robot's, whose frames are at `poses` (n, p, 3, 4).
        around: those that stand still.
        pairs: (k, 2) of the robot's shapes; each counts for the first of the two, which moves.
        may_touch: see `contacts_array`.
    """
    count = len(shapes.rows)
    each = listed_pairs(pairs, count, moving, len(around.rows), may_touch)
    follows[:] = True
    if len(each) == 0:
        least[:], known[:] = np.inf, True
        return
    bounds, sure = np.full(len(each), -np.inf), np.ones(len(each), dtype=np.bool_)
    rows, still, nearest = np.empty((count, ROW)), np.eye(3, 4), 0
    steps = np.full(len(each), np.inf)
    fronts, front_of = fronts_for(_FRONTS), np.full(len(each), -_OFTEN)
    for n in range(len(poses)):
        if n > 0:
            _moved_since(shapes.rows, poses[n - 1], poses[n], each, len(pairs), steps)
            bounds -= steps
        for part in range(count):
            moved(shapes.rows[part], poses[n, part], rows[part])
        least[n], first = np.inf, nearest
        for turn in range(-1, len(each)):  # what was the nearest first, which spares most others
            k = first if turn < 0 else turn
            most = max(least[n], near)
            if turn == first or least[n] <= 0.0 or is_beyond(bounds[k], most):
                continue
            part, other = each[k, 0], each[k, 1]
            if other < count and shapes.roots[part] >= 0 and shapes.roots[other] >= 0:
                found, known_apart = _meshes_apart(
                    shapes, rows, poses[n], fronts, front_of, k, part, other, most
                )
            else:
                found, known_apart = apart_now(
                    shapes, rows, poses[n], around, still, part, other, most, most
                )
            # Of what has not come as near as to touch, what is within what has not changed.
            is_as_before, bounds[k] = bounds[k] > 0.0, found
            sure[k] = known_apart or (sure[k] and is_as_before)
            follows[n] = follows[n] and (sure[k] or is_as_before)
            if found < least[n]:
                least[n], nearest = found, k
            is_near[n, part] = is_near[n, part] or found <= near
        known[n] = sure.all()


@njit_cached
def _meshes_apart(
    shapes: Any,
    rows: Any,
    poses: Any,
    fronts: Any,
    front_of: Any,
    k: int,
    part: int,
    other: int,
    most: float,
) -> tuple[float, bool]:
    """As `apart_now`, of two of a robot's shapes that are meshes. If their surfaces are asked often
    they have a front.

    Args:
        front_of: (k,) by pair, which one; until then how often they are asked yet, below 0.
        k: the number of this pair.
    """
    row, there, pose, at = rows[part], rows[other], poses[part], poses[other]
    found = sphere_gap(row, there)
    if found < most:
        found = boxes_apart(shapes, part, pose, shapes, other, there, at, most)
    if found >= most:
        return found, True
    hulls, most, is_enough = told_by_hulls(
        shapes, part, row, pose, shapes, other, there, at, most, most
    )
    if is_enough:
        return hulls, hulls > 0.0
    root, other_root = shapes.roots[part], shapes.roots[other]
    if shapes.trees.radii[root] < shapes.trees.radii[other_root]:
        # The smaller one second: what counts of a front is how far that is moved.
        part, other, root, other_root = other, part, other_root, root
    if front_of[k] < 0:
        front_of[k] += 1
        if front_of[k] == 0:
            front_of[k] = take_front(fronts, root, other_root)
    between = np.empty((3, 4))
    pose_between(shapes, part, poses[part], shapes, other, poses[other], between)
    trees, found = shapes.trees, -1.0
    if front_of[k] >= 0:
        found = distance_by_front(trees, fronts, front_of[k], between, most)
    if found < 0.0:
        found = mesh_to_mesh(trees, root, trees, other_root, between, most, 0.0)
    return max(hulls, found), hulls > 0.0


@njit_cached
def _moved_since(rows: Any, before: Any, now: Any, each: Any, of_robot: int, steps: Any) -> None:
    """Writes by how much each of the pairs (k, 2) may be nearer than before, (k,): the first shape
    as seen from the second has not moved any farther. Poses are (p, 3, 4)."""
    alone = np.empty(len(rows))
    for part in range(len(rows)):
        alone[part] = _moved(rows[part], before[part], now[part])
    first, then = np.empty((3, 4)), np.empty((3, 4))
    for k in range(len(each)):
        part, other = each[k, 0], each[k, 1]
        steps[k] = alone[part]
        if k < of_robot:
            _as_seen(before[part], before[other], first)
            _as_seen(now[part], now[other], then)
            steps[k] = _moved(rows[part], first, then)


@njit_hot
def _moved(row: Any, before: Any, now: Any) -> float:
    """How far any point of a shape, a row in its own frame, is moved from one pose to another: no
    farther than its middle is, and what its radius turns by."""
    turned, shifted = 0.0, 0.0
    for i in range(3):
        x, y, z = now[i, 0] - before[i, 0], now[i, 1] - before[i, 1], now[i, 2] - before[i, 2]
        turned += x * x + y * y + z * z
        step = x * row[9] + y * row[10] + z * row[11] + now[i, 3] - before[i, 3]
        shifted += step * step
    # Two rotations differ by a matrix whose two singular values that are not 0 are equal.
    return math.sqrt(shifted) + float(row[15]) * math.sqrt(turned / 2) + _OF_POSES


@njit_hot
def _as_seen(pose: Any, other: Any, out: Any) -> None:
    """Writes a pose as it is in the frame that another one is of."""
    x, y, z = pose[0, 3] - other[0, 3], pose[1, 3] - other[1, 3], pose[2, 3] - other[2, 3]
    for i in range(3):
        u, v, w = other[0, i], other[1, i], other[2, i]
        for j in range(3):
            out[i, j] = u * pose[0, j] + v * pose[1, j] + w * pose[2, j]
        out[i, 3] = u * x + v * y + w * z
