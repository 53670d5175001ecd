"""The space in which learned planners compute."""

from __future__ import annotations

from dataclasses import dataclass

from envs import Environment
from envs.collision.surface import SURFACE_POINTS, surface_points
from envs.problem import Array


@dataclass(frozen=True)
class Scale:
    """Between an environment's configurations and the networks' space, where the longest side of
    the bounds is 1 and their middle is the origin.

    `middle` is (d,), `extent` the length of the longest side, in the environment's unit.
    """

    middle: Array
    extent: float

    @staticmethod
    def of(env: Environment) -> Scale:
        """The scale of an environment's bounds."""
        return Scale((env.lower + env.upper) / 2, float((env.upper - env.lower).max()))

    def shrink(self, q: Array) -> Array:
        """Configurations (..., d) in the networks' space."""
        scaled: Array = (q - self.middle) / self.extent
        return scaled

    def grow(self, x: Array) -> Array:
        """Configurations (..., d) in the environment's unit."""
        grown: Array = x * self.extent + self.middle
        return grown


def cloud(env: Environment) -> Array:
    """Surface points (n, 3) of an environment's obstacles, in the networks' space."""
    return Scale.of(env).shrink(surface_points(env.obstacles, SURFACE_POINTS, seed=0))
