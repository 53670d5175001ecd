"""What worlds of a point robot have in common: the cube, the robot, the problems."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from envs.collision.ball_motions import BallAmongShapes
from envs.collision.motion_check import MotionCheck
from envs.collision.separation import Shapes, shapes_of
from envs.environment import Environment
from envs.free_space import GridComponents, connected_problems
from envs.plain_scene import PlainRobot, PlainScene
from envs.problem import Problem
from envs.robots.point import PointRobot
from envs.scenes import HALF_SIDE
from envs.seeding import derived_seed, stream
from envs.speed_model import SpeedModel

_EXPLORED: dict[tuple[type, str], GridComponents] = {}
"""By class and fingerprint, the last used at the end."""

_MOST_EXPLORED = 4
"""Each takes 8 MB."""


class PointWorld(Environment):
    """A sphere-shaped robot that translates in a cube of side 20 centred at the origin.

    Args:
        radius: of the robot; clearance is measured from its surface.
        speed_model: equation 3 with this world's constants.

    Attributes:
        min_clearance: least clearance of a problem's start and goal.
        min_separation: least distance between them.
        kind_of_problems: names their random streams.
        advice: what to do where there are too few problems.
    """

    robot: PointRobot
    min_clearance: float
    min_separation = 4.0
    kind_of_problems: str
    advice: str

    def __init__(self, radius: float, speed_model: SpeedModel) -> None:
        self.lower, self.upper = np.full(3, -HALF_SIDE), np.full(3, HALF_SIDE)
        self.robot = PointRobot(radius)
        self.speed_model = speed_model

    @property
    def is_point_robot(self) -> bool:
        return True

    @property
    def plain_scene(self) -> PlainScene:
        return self.plain_scene_of(PlainRobot("ball", radius=self.robot.radius))

    @property
    def scene_seeds(self) -> tuple[int, ...]:
        """By which the problems of scenes of the same kind differ."""
        return ()

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform in free space, as `min_clearance` and `min_separation` demand, and
        proved to lie in one component of free space (see `GridComponents`)."""
        return connected_problems(
            self,
            self._components,
            stream(f"{self.kind_of_problems} problems", seed, *self.scene_seeds),
            n,
            lambda index: derived_seed(f"{self.kind_of_problems} planner", seed, index),
            self.advice,
        )

    @property
    def _components(self) -> GridComponents:
        """Explored once for each world in a process, however often it is made: that takes longer
        than all else of a short run."""
        key = type(self), self.fingerprint
        found = _EXPLORED.pop(key, None)
        if found is None:
            found = self.explored()
        _EXPLORED[key] = found
        while len(_EXPLORED) > _MOST_EXPLORED:
            del _EXPLORED[next(iter(_EXPLORED))]
        return found

    def explored(self) -> GridComponents:
        """The connected components of free space."""
        return GridComponents(self.clearance, self.lower, self.upper)

    @cached_property
    def compiled_shapes(self) -> tuple[Shapes, Shapes]:
        """The robot and the obstacles, for compiled code."""
        return shapes_of(self.robot.shapes), shapes_of(self.obstacles)

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        if self.sides is None:
            return None
        ball, around = self.compiled_shapes
        return MotionCheck(BallAmongShapes(ball, around, self.sides, float(tolerance)))

    def point_definition(self) -> dict[str, Any]:
        """The part of `definition` that these worlds share."""
        model = self.speed_model
        contact = [model.contact] if model.contact else []
        return {
            "bounds": [self.lower.tolist(), self.upper.tolist()],
            "robot_radius": self.robot.radius,
            "speed": [model.d_min, model.d_max, model.s_const, *contact],
            "problems": [self.min_clearance, self.min_separation],
        }
