"""Cluttered 3-D: a small round robot among random boxes."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from envs.collision.shapes import Box
from envs.errors import InputError
from envs.problem import Array
from envs.scenes import HALF_SIDE
from envs.scenes.boxes import BoxWorld
from envs.seeding import stream

FAMILY = (*range(8), *range(20_000, 20_024))
"""Scenes for learners that generalise: the paper's eight, and others that no table is about."""


class Cluttered3D(BoxWorld):
    """A point robot in a cube of side 20 centred at the origin, among axis-aligned boxes.

    Box sides are uniform in [2, 6], centres uniform with the box inside the cube. Obstacles may
    overlap.

    Args:
        scene: the seed of the boxes, >= 0.
        boxes: how many.
        robot_radius: of the sphere about the configuration; clearance is measured from it. The
            default is the paper's collision threshold.

    Raises:
        InputError: an argument is out of range.
    """

    kind_of_problems = "c3d"
    advice = "ask for fewer boxes or problems"

    def __init__(self, scene: int = 0, boxes: int = 10, robot_radius: float = 0.01) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"c3d: scene must be between 0 and 2^32 - 1, not {scene}")
        if not 1 <= boxes <= 1000:
            raise InputError(f"c3d: boxes must be between 1 and 1000, not {boxes}")
        rng = stream("c3d", scene)
        sides = rng.uniform(2.0, 6.0, (boxes, 3))
        room = HALF_SIDE - sides / 2
        centers = rng.uniform(-room, room)
        super().__init__([Box(c, s) for c, s in zip(centers, sides, strict=True)], robot_radius)
        self._scene = scene

    @property
    def scene_seeds(self) -> tuple[int, ...]:
        return (self._scene,)

    def definition(self) -> dict[str, Any]:
        return {
            **self.family_definition(),
            "boxes": self.boxes_definition(),
            "scene": self._scene,
        }

    def family(self) -> list[Cluttered3D]:
        """`FAMILY`, with as many boxes and as large a robot."""
        return [Cluttered3D(scene, len(self.obstacles), self.robot.radius) for scene in FAMILY]

    def symmetries(self) -> Array:
        """The 48 of a cube."""
        signs = itertools.product((-1.0, 1.0), repeat=3)
        turns = itertools.permutations(np.eye(3))
        return np.array([np.diag(s) @ np.array(t) for s, t in itertools.product(signs, turns)])

    def family_definition(self) -> dict[str, Any]:
        return {
            "class": "Cluttered3D",
            "version": 1,
            "boxes": len(self.obstacles),
            **self.point_definition(),
        }
