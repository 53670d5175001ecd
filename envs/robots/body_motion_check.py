"""Motions of rigid bodies, for planners that are compiled themselves."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from envs.collision.continuous import compiled_is_covered
from envs.collision.gjk import moved
from envs.collision.motion_check import array_at, checks_motions, known_as
from envs.collision.open_edges import is_beside
from envs.collision.separation import Shapes, are_beyond, separation
from envs.collision.shapes import ROW
from envs.collision.winding import Sides, is_on_the_right_side
from envs.compiled import njit_cached, njit_hot
from envs.compiled_space import SpaceArrays, go, rotation_angle, shortest
from envs.problem import Array


class BodyMotionCheck(NamedTuple):
    """A rigid body among obstacles.

    Attributes:
        space: of its configurations: the position, then a heading or a unit quaternion, if it
            turns.
        parts: the shapes it is made of, in its frame.
        around: the obstacles.
        sides: of surfaces that the body may be on.
        points: (p, 3) in its frame, one of each piece of it, by which its side is known.
        radius: of a ball about the origin of its frame that holds it.
        position: (3,) where its frame is, as far as configurations do not say.
        tolerance: in workspace units.
    """

    space: SpaceArrays
    parts: Shapes
    around: Shapes
    sides: Sides
    points: Array
    radius: float
    position: Array
    tolerance: float


@checks_motions(BodyMotionCheck)
def _body_motion_is_free(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "BodyMotionCheck")
    return bool(body_motion_is_free(check, array_at(a, size), array_at(b, size)))


@njit_cached
def body_motion_is_free(check: Any, a: Any, b: Any) -> bool:
    """See `motion_check.motion_is_free`."""
    bound = _motion_bound(check, a, b)
    there, pose, still = np.empty(len(a)), np.eye(3, 4), np.eye(3, 4)
    pose[:, 3] = check.position
    row = np.empty(ROW)
    # What is in the way of a motion is nearly always in the way at its end, too.
    motion = check, a, b, bound, there, pose, row, still
    if _room(motion, 1.0) < 0:
        return False
    if not compiled_is_covered(_room, motion, bound):
        return False
    return len(check.sides.roots) == 0 or _stays_on_the_right_side(motion)


@njit_hot
def _motion_bound(check: Any, a: Any, b: Any) -> float:
    """How far any point of the body moves at most."""
    space = check.space
    squared, turned = 0.0, 0.0
    for i in range(space.begins[1]):
        squared += (b[i] - a[i]) ** 2
    if len(space.weights) > 1:
        begin = space.begins[1]
        if space.are_rotations[1]:
            turned = rotation_angle(a, b, begin)
        else:
            turned = abs(shortest(space, a[begin], b[begin], begin))
    return math.sqrt(squared) + turned * float(check.radius)


@njit_cached
def _room(motion: Any, t: float) -> float:
    check, a, b, bound, there, pose, row, still = motion
    go(check.space, a, b, t, there)
    _place(check.space, there, pose)
    found = bound + 2 * check.tolerance  # proves all of the motion, and more than the tolerance
    for part in range(len(check.parts.rows)):
        moved(check.parts.rows[part], pose, row)
        for j in range(len(check.around.rows)):
            other = check.around.rows[j]
            if are_beyond(row, other, found):
                continue
            apart = separation(check.parts, part, row, pose, check.around, j, other, still, found)
            found = min(found, apart)
            if found <= check.tolerance:
                return -1.0
    return float(found - check.tolerance / 2)


@njit_cached
def _stays_on_the_right_side(motion: Any) -> bool:
    """As `winding.stays_on_the_right_side`, of a point of each piece of the body."""
    check, a, b, bound, there, pose, _, _ = motion
    cells = check.sides.beside
    parts = int(bound / cells.side) + 1
    passes = False
    for step in range(1, parts + 1):
        go(check.space, a, b, step / parts, there)
        _place(check.space, there, pose)
        for n in range(len(check.points)):
            x, y, z = (
                _along(pose, 0, check, n),
                _along(pose, 1, check, n),
                _along(pose, 2, check, n),
            )
            is_near = is_beside(cells, x, y, z)
            passes |= is_near
            is_asked = is_near or (passes and step == parts)
            if is_asked and not is_on_the_right_side(check.sides, x, y, z):
                return False
    return True


@njit_hot
def _along(pose: Any, axis: int, check: Any, n: int) -> float:
    """Where the nth of the body's points is on an axis of the workspace."""
    found: float = pose[axis, 3]
    for i in range(3):
        found += pose[axis, i] * check.points[n, i]
    return found


@njit_hot
def _place(space: Any, q: Any, pose: Any) -> None:
    """Writes the pose (3, 4) of the body's frame."""
    positions = space.begins[1]
    for i in range(positions):
        pose[i, 3] = q[i]
    if len(space.weights) == 1:
        return
    if not space.are_rotations[1]:
        cosine, sine = math.cos(q[positions]), math.sin(q[positions])
        pose[0, 0], pose[0, 1], pose[1, 0], pose[1, 1] = cosine, -sine, sine, cosine
        return
    x, y, z, w = q[positions], q[positions + 1], q[positions + 2], q[positions + 3]
    double = 2.0 / (x * x + y * y + z * z + w * w)
    pose[0, 0], pose[0, 1] = 1.0 - double * (y * y + z * z), double * (x * y - z * w)
    pose[0, 2], pose[1, 0] = double * (x * z + y * w), double * (x * y + z * w)
    pose[1, 1], pose[1, 2] = 1.0 - double * (x * x + z * z), double * (y * z - x * w)
    pose[2, 0], pose[2, 1] = double * (x * z - y * w), double * (y * z + x * w)
    pose[2, 2] = 1.0 - double * (x * x + y * y)
