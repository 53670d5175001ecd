"""A robot that only translates: a point with a radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.collision.shapes import Sphere
from envs.problem import Array


@dataclass(frozen=True)
class PointRobot:
    """A sphere of `radius` about the configuration, which is its position: (3,) in the workspace,
    or (2,) in its plane z = 0, where it is a disc."""

    radius: float

    @property
    def shapes(self) -> tuple[Sphere, ...]:
        return (Sphere(self.radius),)

    @property
    def moving(self) -> int:
        return 1

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        return ()

    @property
    def rate_bound(self) -> float:
        return 1.0

    def poses(self, q: Array) -> Array:
        found: Array = _UNTURNED.copy()
        found[0, : len(q), 3] = q
        return found

    def motion_bound(self, a: Array, b: Array) -> float:
        step = b - a
        return float(np.sqrt(step @ step))

    def trace(self, q: Array) -> Array:
        """Its middle."""
        middle = np.zeros((len(q), 1, 3))
        middle[:, 0, : np.shape(q)[1]] = q
        return middle


_UNTURNED = np.eye(3, 4)[None]
