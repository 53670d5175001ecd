"""Solid shapes of scenes and robots, points on them, and what collision checking asks a robot."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array, frozen_array

if TYPE_CHECKING:
    import trimesh

LARGEST = 1e6
"""Of numbers in users' files of arms and scenes. Metres and radians beyond it are mistakes, and
might overflow where they multiply."""


@dataclass(frozen=True, eq=False)
class Box:
    """A solid axis-aligned box: `center` (3,), full `sides` (3,), in the workspace frame."""

    center: Array
    sides: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", frozen_array(self.center, 1, "box centre"))
        object.__setattr__(self, "sides", frozen_array(self.sides, 1, "box sides"))
        if (self.sides <= 0).any():
            raise ValueError(f"box sides must be positive, not {self.sides.tolist()}")


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangulated surface: `vertices` (n, 3) in the workspace frame, `faces` (m, 3).

    Equal to another if both have the same numbers.
    """

    vertices: Array
    faces: NDArray[np.int64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen_array(self.vertices, 2, "mesh vertices"))
        faces = np.array(self.faces, dtype=np.int64)
        if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0:
            raise ValueError(f"mesh faces must be (m, 3), not {faces.shape}")
        if faces.min() < 0 or faces.max() >= len(self.vertices):
            raise ValueError("mesh faces name vertices that are not there")
        faces.flags.writeable = False
        object.__setattr__(self, "faces", faces)

    @cached_property
    def digest(self) -> str:
        """Of the numbers, the same on every machine."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.vertices, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.faces, dtype="<i8").tobytes())
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def joined(self, other: Mesh) -> Mesh:
        """Both as one."""
        return Mesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.faces, other.faces + len(self.vertices)]),
        )


@dataclass(frozen=True)
class Sphere:
    """A solid sphere about the origin of the frame it is placed in."""

    radius: float

    def __post_init__(self) -> None:
        if not (self.radius >= 0 and np.isfinite(self.radius)):
            raise ValueError(f"a sphere's radius must be finite and >= 0, not {self.radius}")


@dataclass(frozen=True)
class Cylinder:
    """A solid cylinder along the z axis of the frame it is placed in, its middle at the origin."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        if not (self.radius > 0 and self.length > 0 and np.isfinite(self.radius + self.length)):
            raise ValueError(
                "a cylinder's radius and length must be finite and positive, not "
                f"{self.radius} and {self.length}"
            )


Solid = Sphere | Cylinder | Box | Mesh
"""What a robot's links are made of, each in a frame of its own; a mesh there is closed."""


def rounded(values: Array) -> list[Any]:
    """Numbers to nine decimals, for fingerprints: sines are not the same to the last bit on every
    machine."""
    listed: list[Any] = (np.round(values, 9) + 0.0).tolist()  # no -0.0
    return listed


def _numbers(solid: Solid) -> list[Any]:
    if isinstance(solid, Mesh):
        return ["mesh", solid.digest]
    if isinstance(solid, Box):
        return ["box", solid.center.tolist(), solid.sides.tolist()]
    if isinstance(solid, Cylinder):
        return ["cylinder", solid.radius, solid.length]
    return ["sphere", solid.radius]


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A solid put somewhere.

    Attributes:
        solid: in its own frame.
        pose: (4, 4), from that frame to the frame in which it is placed.
    """

    solid: Solid
    pose: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen_array(self.pose, 2, "pose"))
        if self.pose.shape != (4, 4):
            raise ValueError(f"a pose must be (4, 4), not {self.pose.shape}")

    def definition(self) -> list[Any]:
        """The numbers that it is made of, as JSON data."""
        return [*_numbers(self.solid), rounded(self.pose[:3])]


Obstacle = Box | Mesh | PlacedShape
"""What is fixed in the workspace; boxes and meshes that are not placed are in its frame."""


Pose = tuple[Array | None, Array]
"""A rotation (3, 3), or None for none, and a translation (3,), in the workspace frame."""


class Robot(Protocol):
    """The contract of a robot: rigid shapes that a configuration places. What collision checking
    asks; `envs.robots` has a ball that translates and serial arms.

    The bounds on motion are what certified checks rest on: they may be too large, which costs
    time, and must never be too small.

    Example:
        >>> from envs.robots.point import PointRobot
        >>> robot = PointRobot(radius=0.5)
        >>> [(rotation, position)] = robot.poses(np.array([1.0, 2.0, 3.0]))
        >>> position.tolist()
        [1.0, 2.0, 3.0]
        >>> robot.motion_bound(np.zeros(3), np.array([3.0, 4.0, 0.0]))
        5.0
    """

    @property
    def shapes(self) -> tuple[Solid, ...]:
        """Its rigid bodies (`Solid`: box, ball, cylinder, mesh), each in its own frame, in
        workspace units; those that move come first."""

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
        the robot travels per unit of (Euclidean) distance in configuration space."""

    def poses(self, q: Array) -> tuple[Pose, ...]:
        """The placement of every shape.

        Args:
            q: a configuration, float64 (d,).

        Returns:
            For each shape a rotation (3, 3), or None for none, and a translation (3,), from the
            shape's frame to the workspace.
        """

    def motion_bound(self, a: Array, b: Array) -> float:
        """An upper bound on the workspace distance that any point of the robot travels per unit
        of t while the configuration moves as a + t (b - a), t in [0, 1].

        Args:
            a, b: configurations, float64 (d,).

        Returns:
            The bound (float), in workspace units.
        """


SURFACE_POINTS = 20_000
"""How many learners look at, as in the paper."""


def surface_points(obstacles: Sequence[Obstacle], n: int, seed: int) -> Array:
    """`n` points (n, 3), uniform by area over the obstacles' surfaces, in the workspace frame.

    Where obstacles overlap, surface that lies within another is sampled as well.
    """
    import trimesh  # half a second, which processes that look at no surface can save

    mesh = trimesh.util.concatenate([triangulated(obstacle) for obstacle in obstacles])
    points, _ = trimesh.sample.sample_surface(mesh, n, seed=seed)
    return np.asarray(points, dtype=np.float64)


def triangulated(obstacle: Obstacle) -> trimesh.Trimesh:
    """An obstacle's surface, in the workspace frame."""
    if isinstance(obstacle, PlacedShape):
        placed = _triangulated(obstacle.solid)
        placed.apply_transform(obstacle.pose)
        return placed
    return _triangulated(obstacle)


def _triangulated(solid: Solid) -> trimesh.Trimesh:
    import trimesh

    if isinstance(solid, Box):
        box: trimesh.Trimesh = trimesh.creation.box(solid.sides)
        box.apply_translation(solid.center)
        return box
    if isinstance(solid, Cylinder):
        cylinder: trimesh.Trimesh = trimesh.creation.cylinder(solid.radius, solid.length)
        return cylinder
    if isinstance(solid, Sphere):
        ball: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=2, radius=solid.radius)
        return ball
    return trimesh.Trimesh(solid.vertices, solid.faces, process=False)
