"""Proofs that motions of arms are free, by the distances of their links, compiled.

As `envs.collision.continuous.segment_is_free`, but with a bound for each part: those near the base
move little, and may be near obstacles; and one for each pair of parts: links of a wrist are near
each other wherever it moves them. Distances are those of `CollisionModel`, never above the truth,
or of the hulls of meshes where these are far enough apart.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.coherence import ROUNDING, apart_now, listed_pairs
from envs.compiled import njit_cached
from envs.robots.arm import motion_bounds
from envs.robots.arm_clearance import NEAR, moved_rows
from envs.robots.kinematic_tree import body_poses


@njit_cached
def prove(
    arm: Any, around: Any, may_touch: Any, a: Any, b: Any, asked: float, kept: float
) -> tuple[float, bool]:
    """A place t of the straight motion from a to b (d,) at which an arm is not known to be more
    than `asked` from obstacles and itself, or -1 if it is proved to keep more than `kept` all
    along. And whether it is known that nothing is within another; where nothing is touched that
    does not change.

    Args:
        around: the obstacles, `Shapes`.
        may_touch: which parts may touch which of them, see `contacts_array`.
        asked, kept: in workspace units, the former more than the latter. The proof takes the
            longer, the less they differ.
    """
    each = listed_pairs(
        arm.branches[:, :2], len(arm.bodies), arm.moving, len(around.rows), may_touch
    )
    if len(each) == 0:
        return -1.0, True
    speeds = _speeds(arm, a, b, each)
    distances, sure = np.full(len(each), np.inf), np.ones(len(each), dtype=np.bool_)
    left, bodies = np.arange(len(each)), np.empty((1 + len(arm.tree.parents), 3, 4))
    frames = np.empty((len(arm.bodies), 3, 4))
    # Breadth first, as `is_covered`, with the pairs that are not yet proved of each interval.
    begins, ends, lefts, is_known, n = [0.0], [1.0], [left], False, 0
    while n < len(begins):
        begin, end, left = begins[n], ends[n], lefts[n]
        middle, half = (begin + end) / 2, (end - begin) / 2
        n += 1
        body_poses(arm.tree, a + middle * (b - a), bodies)
        for part in range(len(frames)):
            frames[part] = bodies[arm.bodies[part]]
        rows = moved_rows(arm, bodies)
        pairs = each, left, speeds, distances, sure
        share = _share_proved(arm, around, rows, frames, pairs, asked, kept, half)
        if share < 0:
            return middle, is_known
        is_known = is_known or bool(sure.all())
        if share < half:
            # What is surely asked of nowhere in it need not be looked at again.
            near = distances[left] - speeds[left] * half <= asked + ROUNDING
            left = left[near]
            begins.append(begin)
            ends.append(middle - share)
            begins.append(middle + share)
            ends.append(end)
            lefts.append(left)
            lefts.append(left)
    return -1.0, is_known


@njit_cached
def _speeds(arm: Any, a: Any, b: Any, each: Any) -> Any:
    """How fast the shapes of each pair (k, 2), see `listed_pairs`, may come nearer, (k,)."""
    bounds, nearing = np.empty(arm.moving), np.empty(len(arm.branches))
    motion_bounds(arm, a, b, bounds, nearing)
    speeds = np.empty(len(each))
    for k in range(len(each)):
        speeds[k] = nearing[k] if k < len(nearing) else bounds[each[k, 0]]
    return speeds


@njit_cached
def _share_proved(
    arm: Any,
    around: Any,
    rows: Any,
    frames: Any,
    pairs: Any,
    asked: float,
    kept: float,
    enough: float,
) -> float:
    """How much of a motion about a place is proved to keep more than `kept`, at most `enough`, or
    -1 where less than what is asked is known.

    Args:
        rows, frames: of the parts, as they are there; see `apart_now`.
        pairs: all, which are left, and of each the speed, and, which are written where it is left,
            its distance and whether it is known that neither is within the other.
    """
    each, left, speeds, distances, sure = pairs
    share, still = enough, np.eye(3, 4)
    for k in left[::-1]:  # those farther out last in the list: they are nearer to things
        part, other = each[k, 0], each[k, 1]
        # Farther apart than this, the two do not lessen the share, nor need be asked again.
        most = max(enough * speeds[k] + kept, 2 * asked - kept) + 2 * ROUNDING
        found, known = apart_now(arm.shapes, rows, frames, around, still, part, other, most, NEAR)
        distances[k], sure[k] = found, known
        if found <= asked:
            return -1.0
        if speeds[k] > 0:
            share = min(share, (found - kept) / speeds[k])
    return share
