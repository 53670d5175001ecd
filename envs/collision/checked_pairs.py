"""The pairs of shapes that must not touch, one by one: for messages that say which is too near.
`CollisionModel` looks for the least distance alone, and spares most pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import Obstacle, Robot
from envs.problem import Array


class CheckedPairs:
    """The pairs of a robot's own shapes, and of these and obstacles, that must not touch.

    Args:
        robot: its shapes, of which the first `moving` meet the obstacles.
        obstacles: fixed in the workspace.
        may_touch: (moving, obstacles) of bool, which may touch each other, as in `CollisionModel`.

    Attributes:
        numbers: of the two of each pair: first the robot's shapes, then the obstacles are counted.

    Example:
        >>> from envs.collision.shapes import Box
        >>> from envs.robots.point import PointRobot
        >>> boxes = [Box([x, 0, 0], [1, 1, 1]) for x in (2, -4)]
        >>> pairs = CheckedPairs(PointRobot(radius=0.5), boxes)
        >>> pairs.numbers
        [(0, 1), (0, 2)]
        >>> pairs.nearest(np.zeros(3))
        ((0, 1), 1.0)
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Sequence[Obstacle],
        may_touch: NDArray[np.bool_] | None = None,
    ) -> None:
        first = len(robot.shapes)
        meeting = product(range(robot.moving), range(len(obstacles)))
        checked = ((i, j) for i, j in meeting if may_touch is None or not may_touch[i, j])
        self.numbers = [*robot.pairs, *((i, first + j) for i, j in checked)]
        self._robot = robot
        self._shapes = shapes_of([*robot.shapes, *obstacles])
        self._still = [np.eye(3, 4)] * len(obstacles)

    def distances(self, q: Array, most: Sequence[float]) -> list[float]:
        """How far the two of each pair are apart at a configuration (d,), in workspace units, never
        more than they are; or something that is at least `most`, of each pair. 0 where they
        touch."""
        poses = self._poses(q)
        return [
            self._distance(poses, pair, enough)
            for pair, enough in zip(self.numbers, most, strict=True)
        ]

    def nearest(self, q: Array) -> tuple[tuple[int, int] | None, float]:
        """The pair that is nearest to each other at a configuration (d,), of several the first,
        and its distance; None and infinity if there are no pairs."""
        poses = self._poses(q)
        found, least = None, math.inf
        for pair in self.numbers:
            apart = self._distance(poses, pair, least)
            if apart < least:
                found, least = pair, apart
        return found, least

    def _poses(self, q: Array) -> list[Array]:
        """(3, 4) each."""
        return [*self._robot.poses(q), *self._still]

    def _distance(self, poses: Sequence[Array], pair: tuple[int, int], most: float) -> float:
        i, j = pair
        [apart] = separations(self._shapes, i, j, np.array([[poses[i], poses[j]]]), most)
        return float(apart)
