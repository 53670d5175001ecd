"""Whether motions of an arm are free, and configurations joined by such, for all that is proved by
spheres that cover its links and by the links' distances from each other."""

from __future__ import annotations

import numpy as np

from envs import connection
from envs.collision.part_scenes import PartScenes
from envs.problem import Array
from envs.robots import arm_clearance, rrt_connect, swept_pairs
from envs.robots.arm import Arm


class ArmMotions:
    """Motions of an arm among obstacles.

    Args:
        arm: the robot.
        scenes: the obstacles, for each part.
    """

    def __init__(self, arm: Arm, scenes: PartScenes) -> None:
        self._arm = arm
        self._scenes = scenes
        self._others, self._swept = swept_pairs.split(arm)

    def are_free(self, path: Array, tolerance: float) -> bool:
        """Whether nothing is touched along a path of waypoints (k, d), to a tolerance in metres;
        see `arm_clearance.segment_is_free`."""
        swept = self._swept
        for robot, straight in self._arm.motions(path):
            rest = robot._replace(branches=self._others)
            if not arm_clearance.paths_are_free(rest, self._scenes, [straight], tolerance)[0]:
                return False
            if len(swept) and not swept_pairs.path_keeps_apart(rest, swept, straight, tolerance):
                return False
        return True

    def join(self, start: Array, goal: Array, draws: Array, tolerance: float) -> bool:
        """Whether a long search that draws configurations (n, d) joins two, (d,) each."""
        arm = self._arm.arrays
        if not arm.tree.spherical.any():
            arm = arm._replace(branches=self._others)
            ends = start, goal, draws
            return rrt_connect.is_connected(arm, self._scenes, *ends, tolerance, self._swept)

        def is_free(a: Array, b: Array) -> bool:
            return self.are_free(np.array([a, b]), tolerance)

        space = self._arm.tree.space
        return connection.is_connected(space, is_free, start, goal, draws, rrt_connect.STEP)
