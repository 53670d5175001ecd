"""The space in which learned planners compute."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from envs import Environment
from envs.collision.shapes import SURFACE_POINTS, surface_points
from envs.problem import Array
from envs.spaces import Kind, Space
from planners.learning.circles import NO_CIRCLES, Circles


def unsupported_space(space: Space) -> str | None:
    """Why learned planners do not compute in a configuration space, or None if they do: in R^n,
    also where coordinates wrap."""
    if Kind.ROTATIONS in space.kinds:
        return f"its network does not know rotations yet, as there are in {space}"
    if len(space.parts) > 1:
        return f"its network measures all coordinates together, and not yet in parts as {space} has"
    return None


@dataclass(frozen=True)
class Normalizer:
    """Between an environment's configurations and the networks' space, where the longest side of
    the bounds is 1 and their middle is the origin. There coordinates that wrap may be anything.

    `middle` is (d,), `extent` the length of the longest side, in the environment's unit. `space` is
    the environment's, see `unsupported_space`.
    """

    middle: Array
    extent: float
    space: Space

    @staticmethod
    def of(env: Environment) -> Normalizer:
        """The scale of an environment's bounds."""
        extent = float((env.upper - env.lower).max())
        return Normalizer((env.lower + env.upper) / 2, extent, env.space)

    @property
    def circles(self) -> Circles:
        """The coordinates that wrap."""
        places = tuple(np.flatnonzero(self.space.wraps).tolist())
        return Circles(places, 2 * math.pi / self.extent) if places else NO_CIRCLES

    def normalize(self, q: Array) -> Array:
        """Configurations (..., d) in the networks' space."""
        scaled: Array = (q - self.middle) / self.extent
        return scaled

    def denormalize(self, x: Array) -> Array:
        """Configurations (..., d) in the environment's unit, within the bounds where they wrap."""
        grown: Array = x * self.extent + self.middle
        return self.space.wrapped(grown)


def obstacle_point_cloud(env: Environment) -> Array:
    """Surface points (n, 3) of an environment's obstacles: of point robots' in the networks' space,
    else in the workspace, whose unit is then how far the robot comes."""
    points = surface_points(env.obstacles, SURFACE_POINTS, seed=0)
    if env.is_point_robot:
        scale = Normalizer.of(env)
        [[middle]] = env.robot.trace(scale.middle[None])  # in the workspace, also of a plane
        return np.asarray((points - middle) / scale.extent)
    return points / env.extent
