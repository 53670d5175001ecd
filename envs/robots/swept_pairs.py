"""Whether links that are always near each other stay apart while an arm moves, compiled.

Links of a wrist, or of a shoulder, are near each other wherever joints move them, and each distance
of two meshes takes long. How far the whole of a link may be moved says little there: what is near
the other link is near the joints, too, and hardly moves. So each piece of the two surfaces is given
how far the joints between them move it about the middle of a motion; where pieces are farther apart
than both move, that is a proof for all of the motion, and few pieces are near enough to be asked.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import compose
from envs.collision.mesh_distance import AXIS, first_within
from envs.collision.separation import undo
from envs.compiled import njit_cached, njit_hot
from envs.robots.allowed_collisions import FAR
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import body_poses

NONE = np.empty((0, 3), dtype=np.int64)
"""No pairs."""

_PIECES = 8
"""Into which a motion is parted at once, at most."""


def split(arm: Arm) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The pairs of an arm, rows (k, 3) of `RobotArrays.branches`: those that are asked for their
    distances, and those that are swept, which are meshes that are nowhere seen `FAR` apart."""
    pairs, roots = arm.arrays.branches, arm.arrays.shapes.roots
    i, j = pairs[:, 0], pairs[:, 1]
    swept = (roots[i] >= 0) & (roots[j] >= 0) & (arm.link_pairs.farthest[i, j] < FAR)
    return pairs[~swept], pairs[swept]


@njit_cached
def path_keeps_apart(arm: Any, pairs: Any, path: Any, tolerance: float) -> bool:
    """Whether the motions between waypoints (n, d) are proved to keep the parts of pairs (k, 3)
    apart; see `motion_keeps_apart`."""
    if len(path) == 1:
        return bool(motion_keeps_apart(arm, pairs, path[0], path[0], tolerance))
    for n in range(len(path) - 1):
        if not motion_keeps_apart(arm, pairs, path[n], path[n + 1], tolerance):
            return False
    return True


@njit_cached
def motion_keeps_apart(arm: Any, pairs: Any, a: Any, b: Any, tolerance: float) -> bool:
    """Whether the straight motion from a to b (d,) is proved to keep the parts of pairs (k, 3),
    each of which are meshes, apart.

    As `envs.collision.continuous.segment_is_free`: True is a proof that they are more than
    tolerance / 2 apart all along, False means that they are no more than the tolerance apart
    somewhere.
    """
    return bool(place_of_nearing(arm, pairs, a, b, tolerance, tolerance / 2) < 0)


@njit_cached
def place_of_nearing(arm: Any, pairs: Any, a: Any, b: Any, asked: float, kept: float) -> float:
    """A place t of the straight motion from a to b (d,) at which the parts of one of some pairs
    (k, 3), each of which are meshes, are no more than `asked` apart, or -1 if all are proved to
    keep more than `kept`, which is less, all along."""
    for n in range(len(pairs)):
        place = _place(arm, pairs[n, 0], pairs[n, 1], pairs[n, 2], a, b, asked, kept)
        if place >= 0:
            return place
    return -1.0


@njit_cached
def _place(
    arm: Any, part: int, other: int, branch: int, a: Any, b: Any, asked: float, kept: float
) -> float:
    """Of one pair. Shares of the motion are asked breadth first, so that contact is found early."""
    middles, halves = [0.5], [0.5]
    done = 0
    while done < len(middles):
        middle, half = middles[done], halves[done]
        done += 1
        low, high = a + (middle - half) * (b - a), a + (middle + half) * (b - a)
        apart, moves = nearing_between(arm, part, other, branch, low, high, kept)
        if apart <= asked:
            return float(middle)
        if apart - kept > moves:
            continue
        # About as many as it takes there.
        pieces = min(max(math.ceil(moves / (apart - kept)), 2), _PIECES)
        for piece in range(pieces):
            middles.append(middle + half * ((2 * piece + 1) / pieces - 1.0))
            halves.append(half / pieces)
    return -1.0


@njit_cached
def nearing_between(
    arm: Any, part: int, other: int, branch: int, low: Any, high: Any, kept: float
) -> tuple[float, float]:
    """Of two parts that are meshes, in the middle of what lies between two configurations (d,), the
    first pieces found that somewhere between may come as near as `kept`: how far apart they are,
    and how far both move there at most; infinite and 0 if there are none.

    Each number of a configuration may be anything between the two, whatever the others are.
    """
    trees, roots, joints = arm.shapes.trees, arm.shapes.roots, len(arm.tree.parents)
    poses = np.empty((1 + joints, 3, 4))
    axes, other_axes = np.empty((joints, AXIS)), np.empty((joints, AXIS))
    here, there, between = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    body_poses(arm.tree, (low + high) / 2, poses)
    compose(poses[arm.bodies[part]], arm.shapes.poses[part], there)
    undo(there, here)
    n = _axes_between(arm, poses, part, branch, here, low, high, axes)
    compose(poses[arm.bodies[other]], arm.shapes.poses[other], there)
    compose(here, there, between)
    undo(there, here)
    m = _axes_between(arm, poses, other, branch, here, low, high, other_axes)
    return first_within(trees, roots[part], axes[:n], roots[other], other_axes[:m], between, kept)


@njit_hot
def _axes_between(
    arm: Any,
    poses: Any,
    part: int,
    branch: int,
    inverse: Any,
    low: Any,
    high: Any,
    axes: Any,
) -> int:
    """Writes the axes of the joints from a part inward to a body, see `first_within`, and returns
    their number: in the frame of the part's mesh, of which `inverse` undoes the pose, with how much
    they are moved from the middle of two configurations (d,)."""
    tree, body, count = arm.tree, arm.bodies[part], 0
    while body != branch:
        joint, pose = body - 1, poses[body]
        axis, row = tree.axes[joint], axes[count]
        x, y, z = pose[0, 3], pose[1, 3], pose[2, 3]
        u = pose[0, 0] * axis[0] + pose[0, 1] * axis[1] + pose[0, 2] * axis[2]
        v = pose[1, 0] * axis[0] + pose[1, 1] * axis[1] + pose[1, 2] * axis[2]
        w = pose[2, 0] * axis[0] + pose[2, 1] * axis[1] + pose[2, 2] * axis[2]
        for i in range(3):
            turn = inverse[i]
            row[i] = turn[0] * x + turn[1] * y + turn[2] * z + turn[3]
            row[3 + i] = turn[0] * u + turn[1] * v + turn[2] * w
        k = tree.coordinates[joint]
        row[6] = abs(tree.ratios[joint] * (high[k] - low[k])) / 2
        row[7] = 1.0 if tree.prismatic[joint] else 0.0
        body, count = tree.parents[joint], count + 1
    return count
