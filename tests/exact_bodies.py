"""Rigid bodies among obstacles, for checks of ours; Pinocchio has the rotations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio
from coal_shapes import ExactSolid, coal_geometry, coal_pose
from exact_scene import ExactScene, Joints
from exact_steps import Frames, body_frames

from envs.collision.shapes import PlacedShape
from envs.problem import Array


class ExactBody(ExactScene):
    """A body of solids.

    Args:
        parts: of the body.
        obstacles: what it must not touch.
        z: of the plane, where configurations are x, y and the heading; None where they are x, y, z
            and maybe a quaternion x, y, z, w.
    """

    def __init__(
        self, parts: Sequence[PlacedShape], obstacles: Sequence[PlacedShape], z: float | None
    ) -> None:
        self._z = z
        shapes = [*parts, *obstacles]
        solids = [ExactSolid(coal_geometry(shape.solid)) for shape in shapes]
        offsets = np.array([coal_pose(shape) for shape in shapes])
        bodies = [1] * len(parts) + [0] * len(obstacles)
        moves = np.array([[body == 1] * 2 for body in bodies])
        reaches = np.array(
            [
                np.linalg.norm(pose[:3, :3] @ solid.middle + pose[:3, 3]) + solid.radius
                for solid, pose in zip(solids, offsets, strict=True)
            ]
        )
        joints = Joints(moves, np.array([False, True]), np.stack([np.zeros_like(reaches), reaches]))
        among = [(i, len(parts) + j) for i in range(len(parts)) for j in range(len(obstacles))]
        super().__init__(solids, bodies, offsets, joints, among)

    def frames(self, q: Array) -> Frames:
        """At a configuration, where nothing moves."""
        return self.motion(q, q).at(0.0)

    def motion(self, a: Array, b: Array) -> BodyMotion:
        """Between configurations, by the shorter turn."""
        return BodyMotion(pose_of(a, self._z), pose_of(b, self._z))


def pose_of(q: Array, z: float | None) -> Any:
    """Where a configuration has a body, as a `pinocchio.SE3`: x, y and the heading in the plane at
    z; or, if there is none, x, y, z and maybe a quaternion x, y, z, w."""
    if z is not None:
        turn = pinocchio.exp3(np.array([0.0, 0.0, q[2]]))
        return pinocchio.SE3(turn, np.array([q[0], q[1], z]))
    if len(q) == 3:
        return pinocchio.SE3(np.eye(3), q)
    quaternion = pinocchio.Quaternion(q[3:] / np.linalg.norm(q[3:]))
    return pinocchio.SE3(quaternion.toRotationMatrix(), q[:3])


class BodyMotion:
    """Of a body that goes straight and turns steadily about one axis, see `exact_scene.Motion`: as
    on a joint that slides, with one on it that turns."""

    def __init__(self, begin: Any, end: Any) -> None:
        self._turn, self._shift = begin.rotation, np.array(begin.translation)
        self._step = end.translation - self._shift
        self._angle = pinocchio.log3(self._turn.T @ end.rotation)
        self.speeds = np.array([math.hypot(*self._step), math.hypot(*self._angle)])
        self._always = None if self.speeds.any() else self._at(0.0)

    def at(self, t: float) -> Frames:
        return self._always or self._at(t)

    def _at(self, t: float) -> Frames:
        turn = self._turn @ pinocchio.exp3(t * self._angle)
        frames: Frames = body_frames(
            turn, self._shift + t * self._step, self._step, turn @ self._angle
        )
        return frames
