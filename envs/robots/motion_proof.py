"""Proofs that motions of arms are free, by the distances of their links, compiled.

As `envs.collision.continuous.segment_is_free`, but with a bound for each part: those near the base
move little, and may be near obstacles; and one for each pair of parts: links of a wrist are near
each other wherever it moves them. Distances are those of `CollisionModel`, never above the truth,
or of the hulls of meshes where these are far enough apart.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.continuous import compiled_is_covered
from envs.collision.separation import are_beyond, is_allowed, separated
from envs.compiled import njit_cached
from envs.robots.arm_clearance import moved_rows, share_of_pairs, within_reach
from envs.robots.kinematic_tree import body_poses
from envs.robots.motion_bounds import motion_bounds


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
    bounds, nearing = np.empty(arm.moving), np.empty(len(arm.branches))
    motion_bounds(arm, a, b, bounds, nearing)
    place, known = np.full(1, -1.0), np.zeros(1, dtype=np.bool_)
    motion = (arm, around, may_touch, a, b, asked, kept, bounds, nearing, place, known)
    compiled_is_covered(_share_proved, motion, 1.0)
    return place[0], known[0]


@njit_cached
def _share_proved(motion: Any, t: float) -> float:
    """How much of a motion about t is proved to keep more than `kept`, or -1 where less than what
    is asked is known, which is then the place that is told."""
    arm, around, may_touch, a, b, asked, kept, bounds, nearing, place, known = motion
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    body_poses(arm.tree, a + t * (b - a), bodies)
    rows, still = moved_rows(arm, bodies), np.eye(3, 4)
    share, is_known = 1.0, True  # all of the motion, from wherever on it
    for part in range(arm.moving - 1, -1, -1):
        # Farther away than this, it does not lessen the share.
        enough = max(share * bounds[part] + kept, 2 * asked - kept)
        least, pose = enough, bodies[arm.bodies[part]]
        for j in range(len(around.rows)):
            if is_allowed(may_touch, part, j) or are_beyond(rows[part], around.rows[j], least):
                continue
            near = within_reach(arm.shapes, part, around, j, least)
            found, outside = separated(
                arm.shapes, part, rows[part], pose, around, j, around.rows[j], still, near
            )
            least, is_known = min(least, found), is_known and outside
        if least <= asked:
            place[0] = t
            return -1.0
        if bounds[part] > 0:
            share = min(share, (least - kept) / bounds[part])
    share, outside = share_of_pairs(arm, bodies, rows, nearing, asked, kept, share)
    if share < 0:
        place[0] = t
    known[0] = known[0] or (is_known and outside)
    return share
