"""Shapes of which a few sizes tell all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from envs.collision.shapes.solid import BOX, CYLINDER, POINT, Solid, Spheres, countable, make_row
from envs.plain_scene import PlainSolid
from envs.problem import Array, frozen_array

if TYPE_CHECKING:
    import fcl
    import trimesh


class SizedSolid(Solid):
    """A solid about the origin of its frame, made of a few lengths. Files name it by its kind and
    these: URDFs as `<cylinder radius="0.05" length="0.4"/>`, scenes as `cylinder: [0.05, 0.4]`.

    Class attributes:
        sizes: how many lengths each attribute of its URDF element has, in the order of scene files;
            lengths are above 0.
    """

    sizes: ClassVar[Mapping[str, int]]

    @classmethod
    def of_sizes(cls, sizes: Sequence[float]) -> SizedSolid:
        """That of all its lengths, in order.

        Raises:
            ValueError: one of them cannot be.
        """
        return cls(*sizes)

    def plain(self, pose: Array) -> PlainSolid:
        lengths = {name: (float(getattr(self, name)),) for name in self.sizes}
        return PlainSolid(self.kind, lengths, pose)


@dataclass(frozen=True)
class Sphere(SizedSolid):
    """A solid sphere about the origin of the frame it is placed in."""

    kind: ClassVar[str] = "sphere"
    sizes: ClassVar[Mapping[str, int]] = {"radius": 1}

    radius: float

    def __post_init__(self) -> None:
        if not (self.radius >= 0 and np.isfinite(self.radius)):
            raise ValueError(f"a sphere's radius must be finite and >= 0, not {self.radius}")

    def definition(self) -> list[Any]:
        return [self.kind, self.radius]

    def bounding_sphere(self) -> tuple[Array, float]:
        return np.zeros(3), self.radius

    def sphere_cover(self, slack: float) -> Spheres:
        return Spheres(np.zeros((1, 3)), np.array([self.radius]))

    def distance_row(self, pose: Array) -> Array:
        return make_row(POINT, pose[:3, :3], pose[:3, 3], np.zeros(3), self.radius)

    def triangulate(self) -> trimesh.Trimesh:
        import trimesh

        if self.radius == 0:  # of a point, which has no surface
            return trimesh.Trimesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
        ball: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=2, radius=self.radius)
        return ball

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        import fcl

        return fcl.Sphere(self.radius)


@dataclass(frozen=True)
class Rod(SizedSolid):
    """A solid that is round about the z axis of the frame it is placed in, of a length along it.

    Raises:
        ValueError: radius or length is not finite and positive.
    """

    sizes: ClassVar[Mapping[str, int]] = {"radius": 1, "length": 1}

    radius: float
    length: float

    def __post_init__(self) -> None:
        if not (self.radius > 0 and self.length > 0 and np.isfinite(self.radius + self.length)):
            raise ValueError(
                f"a {self.kind}'s radius and length must be finite and positive, not "
                f"{self.radius} and {self.length}"
            )

    def definition(self) -> list[Any]:
        return [self.kind, self.radius, self.length]


@dataclass(frozen=True)
class Cylinder(Rod):
    """A solid cylinder along the z axis of the frame it is placed in, its middle at the origin."""

    kind: ClassVar[str] = "cylinder"

    def bounding_sphere(self) -> tuple[Array, float]:
        return np.zeros(3), float(np.hypot(self.radius, self.length / 2))

    def sphere_cover(self, slack: float) -> Spheres:
        half = np.sqrt((self.radius + slack) ** 2 - self.radius**2)
        count = countable(np.ceil(self.length / (2 * half)))
        half = self.length / (2 * count)
        centers = np.zeros((count, 3))
        centers[:, 2] = half * (2 * np.arange(count) + 1 - count)
        return Spheres(centers, np.full(count, np.hypot(self.radius, half)))

    def distance_row(self, pose: Array) -> Array:
        size = np.array([self.radius, self.length / 2, 0.0])
        return make_row(CYLINDER, pose[:3, :3], pose[:3, 3], size)

    def triangulate(self) -> trimesh.Trimesh:
        import trimesh

        cylinder: trimesh.Trimesh = trimesh.creation.cylinder(self.radius, self.length)
        return cylinder

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        import fcl

        return fcl.Cylinder(self.radius, self.length)


@dataclass(frozen=True, eq=False)
class Box(SizedSolid):
    """A solid box along the axes of its frame: `center` (3,) there, full `sides` (3,)."""

    kind: ClassVar[str] = "box"
    sizes: ClassVar[Mapping[str, int]] = {"size": 3}
    exact_in_fcl: ClassVar[bool] = True

    center: Array
    sides: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", frozen_array(self.center, 1, "box centre"))
        object.__setattr__(self, "sides", frozen_array(self.sides, 1, "box sides"))
        if (self.sides <= 0).any():
            raise ValueError(f"box sides must be positive, not {self.sides.tolist()}")

    @classmethod
    def of_sizes(cls, sizes: Sequence[float]) -> Box:
        return cls(np.zeros(3), np.array(sizes))

    @property
    def offset(self) -> Array:
        return self.center

    def definition(self) -> list[Any]:
        return [self.kind, self.center.tolist(), self.sides.tolist()]

    def bounding_sphere(self) -> tuple[Array, float]:
        return self.center, float(np.linalg.norm(self.sides) / 2)

    def sphere_cover(self, slack: float) -> Spheres:
        """One sphere a cell, one layer of them: they reach out of the two largest sides by
        `slack`, or by an eighth of a thick box's thickness, which would take very many
        otherwise."""
        half = self.sides / 2
        thinnest = float(half.min())
        reach = max(np.sqrt((thinnest + slack) ** 2 - thinnest**2) / np.sqrt(2), thinnest / 2)
        wanted = np.maximum(np.ceil(half / reach), 1)
        wanted[np.argmin(half)] = 1
        countable(wanted.prod())
        counts = wanted.astype(int)
        cell = half / counts
        steps = [c * (2 * np.arange(n) + 1 - n) for c, n in zip(cell, counts, strict=True)]
        centers = self.center + np.array(list(product(*steps)))
        return Spheres(centers, np.full(len(centers), np.linalg.norm(cell)))

    def distance_row(self, pose: Array) -> Array:
        turn = pose[:3, :3]
        return make_row(BOX, turn, turn @ self.center + pose[:3, 3], self.sides / 2)

    def triangulate(self) -> trimesh.Trimesh:
        import trimesh

        box: trimesh.Trimesh = trimesh.creation.box(self.sides)
        box.apply_translation(self.center)
        return box

    def plain(self, pose: Array) -> PlainSolid:
        middle = np.eye(4)
        middle[:3, 3] = self.center
        return PlainSolid(self.kind, {"size": tuple(self.sides.tolist())}, pose @ middle)

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        import fcl

        return fcl.Box(*self.sides)
