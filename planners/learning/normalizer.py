"""The space in which learned planners compute."""

from __future__ import annotations

from dataclasses import dataclass

from envs import Environment
from envs.collision.shapes import SURFACE_POINTS, surface_points
from envs.problem import Array


@dataclass(frozen=True)
class Normalizer:
    """Between an environment's configurations and the networks' space, where the longest side of
    the bounds is 1 and their middle is the origin.

    `middle` is (d,), `extent` the length of the longest side, in the environment's unit.
    """

    middle: Array
    extent: float

    @staticmethod
    def of(env: Environment) -> Normalizer:
        """The scale of an environment's bounds."""
        return Normalizer((env.lower + env.upper) / 2, float((env.upper - env.lower).max()))

    def normalize(self, q: Array) -> Array:
        """Configurations (..., d) in the networks' space."""
        scaled: Array = (q - self.middle) / self.extent
        return scaled

    def denormalize(self, x: Array) -> Array:
        """Configurations (..., d) in the environment's unit."""
        grown: Array = x * self.extent + self.middle
        return grown


def obstacle_point_cloud(env: Environment) -> Array:
    """Surface points (n, 3) of an environment's obstacles, in the networks' space."""
    return Normalizer.of(env).normalize(surface_points(env.obstacles, SURFACE_POINTS, seed=0))
