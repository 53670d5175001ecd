"""A world with a problem that has no solution: its start is walled in."""

from __future__ import annotations

from typing import Any

import numpy as np

from envs import Problem
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld

_INSIDE, _WALL = 4.0, 1.0  # the cage's inner side and its walls' thickness, in units of the cube


class Cage(BoxWorld):
    """A point robot in the cube, in whose middle six slabs enclose a smaller cube."""

    kind_of_problems = "cage"
    advice = "there is room for any number"

    def __init__(self) -> None:
        side = _INSIDE + 2 * _WALL
        slabs = []
        for axis in range(3):
            sides = np.full(3, side)
            sides[axis] = _WALL
            centre = np.zeros(3)
            centre[axis] = (_INSIDE + _WALL) / 2
            slabs += [Box(centre, sides), Box(-centre, sides)]
        super().__init__(slabs, robot_radius=0.01)

    def definition(self) -> dict[str, Any]:
        return {
            "class": "Cage",
            "version": 1,
            "boxes": self.boxes_definition(),
            **self.point_definition(),
        }


def hopeless(seed: int = 1) -> Problem:
    """From the middle of the cage to outside."""
    return Problem(np.zeros(3), np.full(3, 7.0), 0, seed)
