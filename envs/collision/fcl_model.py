"""Exact collision and distance queries between a robot and a scene, through FCL."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import fcl
import numpy as np
from numpy.typing import NDArray

from envs.collision import continuous
from envs.collision.shapes import Box, Mesh, Obstacle, Sphere
from envs.problem import Array
from envs.robots.base import Robot

DEFAULT_TOLERANCE = 1e-3

Allowed = Callable[[Array], NDArray[np.bool_]]


class CollisionModel:
    """A robot among solid obstacles, with a broad phase over the obstacles.

    FCL's primitive shapes are solid, so a robot wholly inside one is in collision. Its meshes are
    surfaces: whether the robot is on the right side of one is what `allowed` says.

    Args:
        robot: its shapes, poses and motion bound.
        obstacles: shapes fixed in the workspace.
        tolerance: to which segments and paths are decided, in workspace units: whatever keeps
            more than this clearance is accepted, whatever touches an obstacle is not, and what
            lies between may be refused.
        allowed: (n, d) -> (n,) of bool, where configurations may be that touch nothing; constant
            between obstacles' surfaces. None for everywhere.

    Attributes:
        checks: the number of configurations that were queried so far.
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Sequence[Obstacle],
        tolerance: float = DEFAULT_TOLERANCE,
        allowed: Allowed | None = None,
    ) -> None:
        if not (tolerance > 0 and np.isfinite(tolerance)):
            raise ValueError(f"tolerance must be positive, not {tolerance}")
        self.robot = robot
        self.tolerance = tolerance
        self.checks = 0
        self._bodies = [fcl.CollisionObject(_geometry(shape)) for shape in robot.shapes]
        self._allowed = allowed
        self._obstacles = [_placed(obstacle) for obstacle in obstacles]
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._obstacles)
        self._manager.setup()

    def is_valid(self, q: Array) -> bool:
        """Whether the robot touches nothing at a configuration (d,). Ignores the bounds."""
        self._place(q)
        for body in self._bodies:
            data = fcl.CollisionData()
            self._manager.collide(body, data, fcl.defaultCollisionCallback)
            if data.result.is_collision:
                return False
        return self._on_the_right_side(q)

    def clearance(self, q: Array) -> float:
        """The distance from robot to obstacles at a configuration (d,), in workspace units.

        Negative where they touch; its size then means nothing.
        """
        self._place(q)
        least = np.inf
        for body in self._bodies:
            data = fcl.DistanceData()
            self._manager.distance(body, data, fcl.defaultDistanceCallback)
            least = min(least, data.result.min_distance)
        return least if self._on_the_right_side(q) else -abs(least)

    def segment_is_free(self, a: Array, b: Array) -> bool:
        """Whether the straight motion between configurations a and b (d,) is proved free.

        See `continuous.segment_is_free`, to `self.tolerance`.
        """
        bound = self.robot.motion_bound(a, b)
        return continuous.segment_is_free(self.clearance, a, b, bound, self.tolerance)

    def min_clearance(self, waypoints: Array) -> float:
        """The least clearance along a path of waypoints (k, d), to within `self.tolerance`.

        The path is proved free exactly if the result is above `self.tolerance`.
        See `continuous.path_min_clearance`.
        """
        bounds = [self.robot.motion_bound(a, b) for a, b in pairwise(waypoints)]
        return continuous.path_min_clearance(self.clearance, waypoints, bounds, self.tolerance)

    def _on_the_right_side(self, q: Array) -> bool:
        return self._allowed is None or bool(self._allowed(q[None])[0])

    def _place(self, q: Array) -> None:
        self.checks += 1
        for body, (rotation, translation) in zip(self._bodies, self.robot.poses(q), strict=True):
            if rotation is None:
                body.setTranslation(translation)
            else:
                body.setTransform(fcl.Transform(rotation, translation))


def _placed(obstacle: Obstacle) -> fcl.CollisionObject:
    if isinstance(obstacle, Box):
        return fcl.CollisionObject(_geometry(obstacle), fcl.Transform(np.eye(3), obstacle.center))
    return fcl.CollisionObject(_geometry(obstacle), fcl.Transform())


def _geometry(shape: Obstacle | Sphere) -> fcl.CollisionGeometry:
    if isinstance(shape, Box):
        return fcl.Box(*shape.sides)
    if isinstance(shape, Mesh):
        model = fcl.BVHModel()
        model.beginModel(len(shape.vertices), len(shape.faces))
        model.addSubModel(shape.vertices, shape.faces)
        model.endModel()
        return model
    return fcl.Sphere(shape.radius)
