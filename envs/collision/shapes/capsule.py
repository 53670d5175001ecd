"""Capsules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from envs.collision.shapes.sized import Rod
from envs.collision.shapes.solid import BOX, Spheres, countable, make_row
from envs.problem import Array

if TYPE_CHECKING:
    import fcl
    import trimesh


@dataclass(frozen=True)
class Capsule(Rod):
    """A solid cylinder along the z axis of the frame it is placed in, its middle at the origin,
    with half a ball on either end.

    `length` is that of the cylinder, between the centres of the balls, as Drake, SDFormat, FCL,
    coal and Pinocchio have it: from tip to tip it is length + 2 radius.
    """

    kind: ClassVar[str] = "capsule"

    def bounding_sphere(self) -> tuple[Array, float]:
        return np.zeros(3), self.radius + self.length / 2

    def sphere_cover(self, slack: float) -> Spheres:
        """Spheres about points of its axis, from end to end: they reach out of it nowhere by more
        than `slack`."""
        most = 2 * np.sqrt((self.radius + slack) ** 2 - self.radius**2)
        count = countable(np.ceil(self.length / most) + 1)
        centers = np.zeros((count, 3))
        centers[:, 2] = np.linspace(-self.length / 2, self.length / 2, count)
        half = self.length / (2 * (count - 1))
        return Spheres(centers, np.full(count, np.hypot(self.radius, half)))

    def distance_row(self, pose: Array) -> Array:
        axis = np.array([0.0, 0.0, self.length / 2])
        return make_row(BOX, pose[:3, :3], pose[:3, 3], axis, self.radius)

    def triangulate(self) -> trimesh.Trimesh:
        import trimesh

        capsule: trimesh.Trimesh = trimesh.creation.capsule(self.length, self.radius, (16, 32))
        capsule.apply_translation(-capsule.bounds.mean(axis=0))  # some versions begin at an end
        return capsule

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        import fcl

        return fcl.Capsule(self.radius, self.length)
