"""Cluttered 3-D: a small round robot among random boxes."""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import Any

import numpy as np

from envs.base import Environment
from envs.collision.distance import signed_distance_to_boxes
from envs.collision.shapes import Box
from envs.errors import InputError
from envs.free_space import GridComponents, connected_problems
from envs.problem import Array, Problem
from envs.robots.point import PointRobot
from envs.scenes import HALF_SIDE
from envs.seeding import derived_seed, stream
from envs.speed import SpeedModel

FAMILY = (*range(8), *range(20_000, 20_024))
"""Scenes for learners that generalise: the paper's eight, and others that no table is about."""


class Cluttered3D(Environment):
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

    min_clearance = 0.4
    min_separation = 4.0

    def __init__(self, scene: int = 0, boxes: int = 10, robot_radius: float = 0.01) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"c3d: scene must be between 0 and 2^32 - 1, not {scene}")
        if not 1 <= boxes <= 1000:
            raise InputError(f"c3d: boxes must be between 1 and 1000, not {boxes}")
        if not 0 <= robot_radius <= 2:
            raise InputError(f"c3d: robot_radius must be between 0 and 2, not {robot_radius}")
        self.lower = np.full(3, -HALF_SIDE)
        self.upper = np.full(3, HALF_SIDE)
        self.robot = PointRobot(robot_radius)
        self._radius = robot_radius
        self.speed_model = SpeedModel(d_min=0.2, d_max=2.0)
        self._scene = scene
        rng = stream("c3d", scene)
        sides = rng.uniform(2.0, 6.0, (boxes, 3))
        room = HALF_SIDE - sides / 2
        centers = rng.uniform(-room, room)
        self._boxes = [Box(c, s) for c, s in zip(centers, sides, strict=True)]
        self.obstacles = self._boxes

    def clearance(self, q: Array) -> Array:
        points = self.configurations(q)
        return signed_distance_to_boxes(points, self._boxes) - self._radius

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform in free space, as `min_clearance` and `min_separation` demand, and
        proved to lie in one component of free space (see `GridComponents`)."""
        rng = stream("c3d problems", seed, self._scene)
        return connected_problems(
            self,
            self._components,
            rng,
            n,
            lambda index: derived_seed("c3d planner", seed, index),
            advice="ask for fewer boxes or problems",
        )

    @cached_property
    def _components(self) -> GridComponents:
        return GridComponents(self.clearance, self.lower, self.upper)

    def definition(self) -> dict[str, Any]:
        return {
            **self.family_definition(),
            "boxes": [[*box.center.tolist(), *box.sides.tolist()] for box in self._boxes],
            "scene": self._scene,
        }

    def family(self) -> list[Cluttered3D]:
        """`FAMILY`, with as many boxes and as large a robot."""
        return [Cluttered3D(scene, len(self.obstacles), self._radius) for scene in FAMILY]

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
            "bounds": [self.lower.tolist(), self.upper.tolist()],
            "robot_radius": self._radius,
            "speed": [self.speed_model.d_min, self.speed_model.d_max, self.speed_model.s_const],
            "problems": [self.min_clearance, self.min_separation],
        }
