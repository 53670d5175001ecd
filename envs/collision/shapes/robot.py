"""What collision checking and pictures ask of a robot."""

from __future__ import annotations

from typing import Protocol

from envs.collision.shapes.solid import Solid
from envs.problem import Array


class Bodies(Protocol):
    """Rigid shapes that a configuration places."""

    @property
    def shapes(self) -> tuple[Solid, ...]:
        """Its rigid bodies (`Solid`: box, ball, cylinder, capsule, mesh), each in its own frame, in
        workspace units; those that move come first."""

    @property
    def moving(self) -> int:
        """How many of them move. Only these are checked against obstacles."""

    def poses(self, q: Array) -> Array:
        """The placement of every shape. Pictures show it there by `Solid.triangulate`.

        Args:
            q: a configuration, float64 (d,).

        Returns:
            float64 (shapes, 3, 4): for each shape a rotation (3, 3) and beside it a translation
            (3,), from the shape's frame to the workspace.
        """


class Robot(Bodies, Protocol):
    """The contract of a robot: rigid shapes that a configuration places. What collision checking
    and pictures ask; `envs.robots` has a ball that translates and arms.

    The bounds on motion are what certified checks rest on: they may be too large, which costs
    time, and must never be too small. A robot can be hashed, as objects can by default, and its
    shapes do not change: what collision checks know of them is kept with it.

    Example:
        >>> import numpy as np
        >>> from envs.robots.point import PointRobot
        >>> robot = PointRobot(radius=0.5)
        >>> robot.poses(np.array([1.0, 2.0, 3.0]))[0, :, 3].tolist()
        [1.0, 2.0, 3.0]
        >>> robot.motion_bound(np.zeros(3), np.array([3.0, 4.0, 0.0]))
        5.0
        >>> robot.trace(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])).tolist()
        [[[1.0, 2.0, 3.0]], [[4.0, 5.0, 6.0]]]
    """

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Which shapes, by their numbers, must not touch each other, each two once. The first of
        them moves."""

    @property
    def rate_bound(self) -> float:
        """An upper bound, over all configurations, on the workspace distance that any point of
        the robot travels per unit of distance in configuration space, and by which the distance
        of two shapes of `pairs` changes."""

    def motion_bound(self, a: Array, b: Array) -> float:
        """An upper bound on the workspace distance that any point of the robot travels per unit
        of t while the configuration moves from a to b the shortest way, t in [0, 1]: in R^d as
        a + t (b - a); and on the rate at which the distance of two shapes of `pairs` changes, of
        which both may move.

        Args:
            a, b: configurations, float64 (d,).

        Returns:
            The bound (float), in workspace units.
        """

    def trace(self, q: Array) -> Array:
        """Where the points are whose ways pictures draw: the middle of a ball or of a body, the
        tip of an arm's tool, of two arms both.

        Args:
            q: configurations, float64 (n, d).

        Returns:
            float64 (n, k, 3) in the workspace frame, of k points, at least one and always the
            same.
        """
