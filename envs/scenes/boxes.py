"""Worlds made of axis-aligned boxes."""

from __future__ import annotations

from collections.abc import Sequence
from operator import is_
from typing import Any

import numpy as np

from envs.collision.ball_motions import BallAmongBoxes
from envs.collision.distance_fields import box_arrays, distance_to_boxes
from envs.collision.fcl_model import Searcher
from envs.collision.margin_search import least_among_boxes
from envs.collision.motion_check import MotionCheck
from envs.collision.shapes import Box
from envs.errors import InputError
from envs.problem import Array
from envs.scenes import HALF_SIDE
from envs.scenes.point_world import PointWorld
from envs.speed_model import SpeedModel


class BoxWorld(PointWorld):
    """A point robot among solid boxes, which may overlap.

    Raises:
        InputError: the robot's radius is out of range.
    """

    min_clearance = 0.4

    def __init__(self, boxes: Sequence[Box], robot_radius: float) -> None:
        if not 0 <= robot_radius <= 2:
            raise InputError(f"robot_radius must be between 0 and 2, not {robot_radius}")
        super().__init__(robot_radius, SpeedModel(d_min=0.2, d_max=2.0))
        self.obstacles = self._boxes = list(boxes)
        self._made_with = tuple(boxes)
        self._arrays = box_arrays(self._boxes)

    def clearance(self, q: Array) -> Array:
        points = self.configurations(q)
        return distance_to_boxes(points, *self._arrays) - self.robot.radius

    @property
    def _are_all(self) -> bool:
        """Whether its boxes are all obstacles: a subclass may have put others in `obstacles`, which
        alone counts for proofs."""
        return len(self.obstacles) == len(self._made_with) and all(
            map(is_, self.obstacles, self._made_with)
        )

    @property
    def searcher(self) -> Searcher | None:
        if not self._are_all:
            return super().searcher
        boxes, radius = self._arrays, self.robot.radius

        def search(
            waypoints: Array,
            bounds: Array,
            tolerance: float,
            most: float,
            near: float,
            asked: Array,
        ) -> tuple[float, bool, int, int]:
            path = np.ascontiguousarray(waypoints)
            return least_among_boxes(path, bounds, boxes, radius, tolerance, most, near, asked)

        return search

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        if not self._are_all:
            return super().motion_check(tolerance)
        return MotionCheck(
            BallAmongBoxes(*self._arrays, float(self.robot.radius), float(tolerance))
        )

    def boxes_definition(self) -> list[list[float]]:
        """Centres and sides, for `definition`."""
        return [[*box.center.tolist(), *box.sides.tolist()] for box in self._boxes]


class SingleBox(BoxWorld):
    """The paper's box: one solid cube in the middle.

    Args:
        side: of the box.
        robot_radius: see `Cluttered3D`.

    Raises:
        InputError: an argument is out of range.
    """

    kind_of_problems = "box"
    advice = "make the box smaller (side)"

    def __init__(self, side: float = 8.0, robot_radius: float = 0.01) -> None:
        if not 0 < side <= 1.8 * HALF_SIDE:
            raise InputError(f"box: side must be above 0 and at most {1.8 * HALF_SIDE}, not {side}")
        super().__init__([Box(np.zeros(3), np.full(3, side))], robot_radius)

    def definition(self) -> dict[str, Any]:
        return {
            "class": "SingleBox",
            "version": 1,
            "boxes": self.boxes_definition(),
            **self.point_definition(),
        }
