"""A point robot among solid cells of a lattice, in the plane or in space."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.ball_motions import BallAmongCells
from envs.collision.motion_check import MotionCheck
from envs.collision.occupancy import CellDistances, covering_boxes
from envs.collision.shapes import Box
from envs.errors import InputError
from envs.free_space import GridComponents
from envs.grid import node_counts
from envs.problem import Array
from envs.scenes.point_world import PointWorld
from envs.speed_model import SpeedModel

_APART = 5
"""Ends of problems are a fifth of the longest side apart."""

_MOST_NODES = 10_000_000
"""Of the grid on which free space is explored."""

_TO_A_NODE = 0.9
"""By the spacing of such a grid: from no place its nearest node is farther, also in space."""

_MOST_BOXES = 200_000
"""Each takes a few kilobytes, with what FCL keeps of it."""

_TALL = 50
"""What stands in the plane is a 50th as tall as the lattice is long, in pictures."""


class CellWorld(PointWorld):
    """A disc among the solid squares of a lattice, or a ball among its cubes.

    Where two cells meet at a corner nothing passes. The robot is on the lattice as a whole: what
    is outside is out of bounds. Problems' ends are uniform in free space, a fifth of the longest
    side apart, and connected.

    Args:
        name: what users call it, in messages.
        solid: (nx, ny) or (nx, ny, nz) of bool.
        side: of a cell.
        origin: (2,) or (3,), the lower corner of the first cell.
        radius: of the robot; 0 for a point.
        speed_model: equation 3 with this world's constants.

    Raises:
        InputError: the robot is too large, or the cells are too ragged.
    """

    advice = "the robot has too little room; make it smaller (radius), or give a larger map"

    def __init__(
        self,
        name: str,
        solid: NDArray[np.bool_],
        side: float,
        origin: Array,
        radius: float,
        speed_model: SpeedModel,
    ) -> None:
        self._cells, self._side, self._origin = solid, side, origin
        sides = side * np.array(solid.shape)
        if not 0 <= 2 * radius < sides.min():
            raise InputError(
                f"{name}: radius must be from 0 to less than half of the map's shortest side, "
                f"{sides.min() / 2:g}, not {radius:g}"
            )
        super().__init__(radius, speed_model)
        self.lower, self.upper = origin + radius, origin + sides - radius
        self.min_separation = float(sides.max()) / _APART
        boxes = covering_boxes(solid)
        if len(boxes) > _MOST_BOXES:
            raise InputError(
                f"{name} is too ragged: it takes {len(boxes)} boxes to cover what is "
                f"occupied, more than {_MOST_BOXES}; smooth it, scale it down, or cut out a part"
            )
        self._boxes = [self._box(*corners) for corners in boxes]
        self.obstacles = self._boxes
        self._distances = CellDistances(solid)
        self.min_clearance = _TO_A_NODE * self._spacing

    def _box(self, begin: NDArray[np.int64], end: NDArray[np.int64]) -> Box:
        """What stands on some cells."""
        middle, sides = np.zeros(3), np.full(3, self._side * max(self._cells.shape) / _TALL)
        middle[: len(begin)] = self._origin + self._side * (begin + end) / 2
        sides[: len(begin)] = self._side * (end - begin)
        return Box(middle, sides)

    @cached_property
    def _spacing(self) -> float:
        """Between nodes that prove connections: half a cell, so that a way a cell wide counts as
        open; twice that, and so on, where these were too many."""
        spacing = self._side / 2
        while np.prod(self._node_counts(spacing), dtype=np.float64) > _MOST_NODES:
            spacing *= 2
        return spacing

    def _node_counts(self, spacing: float) -> NDArray[np.int64]:
        # No more for rounding: nodes are in the middles of cells and of their sides.
        return np.maximum(node_counts(self.lower, self.upper, spacing * (1 + 1e-9)), 2)

    def explored(self) -> GridComponents:
        counts = self._node_counts(self._spacing)
        return GridComponents(self.clearance, self.lower, self.upper, counts)

    @property
    def obstacle_names(self) -> Sequence[str]:
        """By the cells, as the boxes are no parts that a user knows."""
        return [
            f"occupied cells about {_text(box.center[: self.dimension])}" for box in self._boxes
        ]

    def clearance(self, q: Array) -> Array:
        there = (self.configurations(q) - self._origin) / self._side
        return self._side * self._distances(there) - self.robot.radius

    def motion_check(self, tolerance: float) -> MotionCheck:
        known = self._distances.occupied, self._origin, float(self._side)
        check = BallAmongCells(*known, float(self.robot.radius), float(tolerance))
        return MotionCheck(check)

    def cells_definition(self) -> dict[str, Any]:
        """The part of `definition` that these worlds share."""
        return {
            "cells": [list(self._cells.shape), digest(np.packbits(self._cells))],
            "side": self._side,
            "origin": self._origin.tolist(),
            **self.point_definition(),
        }


def _text(place: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in place) + ")"


def digest(numbers: NDArray[Any]) -> str:
    """16 hexadecimal digits of numbers."""
    return sha256(np.ascontiguousarray(numbers).tobytes()).hexdigest()[:16]
