"""The contract of a robot."""

from __future__ import annotations

from typing import Protocol

from envs.collision.shapes import Solid
from envs.problem import Array

Pose = tuple[Array | None, Array]
"""A rotation (3, 3), or None for none, and a translation (3,), in the workspace frame."""


class Robot(Protocol):
    """What collision checking needs to know of a robot."""

    @property
    def shapes(self) -> tuple[Solid, ...]:
        """Its rigid bodies, each in its own frame; those that move come first."""

    @property
    def moving(self) -> int:
        """How many of them move. Only these are checked against obstacles."""

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Which shapes, by their numbers, must not touch each other. The first of two moves, and
        it is the one that moves as seen from the other."""

    @property
    def rate_bound(self) -> float:
        """An upper bound, over all configurations, on the workspace distance that any point of
        the robot travels per unit of distance in configuration space."""

    def poses(self, q: Array) -> tuple[Pose, ...]:
        """The placement of every shape at a configuration (d,)."""

    def motion_bound(self, a: Array, b: Array) -> float:
        """An upper bound on the workspace distance that any point of the robot travels per unit
        of t while the configuration moves as a + t (b - a), t in [0, 1]."""
