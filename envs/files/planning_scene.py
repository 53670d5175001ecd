"""Planning scenes, as MoveIt has them: objects made of shapes, and what may touch what."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Box, ConvexHull, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.errors import InputError, suggestion
from envs.files.allowed_collision_matrix import AllowedCollisionMatrix
from envs.files.mesh_file import cleaned
from envs.files.mesh_formats.soup import Soup, UnreadableError
from envs.problem import Array

SIDES = 128
"""Of the hull that stands for a cone, which it holds: it reaches out of it by 0.03 % of the radius
at most."""

SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "cone": 2}
"""How many lengths the primitives have that are read."""

_UNREAD = {
    "plane": "a plane has no end; use a box",
    "octree": "octomaps are not read; use primitives or meshes",
    "octomap": "octomaps are not read; use primitives or meshes",
    "prism": "prisms are not read; use a mesh",
}
"""Shapes that MoveIt knows besides, with what to do instead."""


@dataclass(frozen=True)
class PlanningScene:
    """The objects about a robot.

    Attributes:
        obstacles: in the frame of the world, in metres.
        names: (o,) of the objects that they are of.
        allowed: which links and objects may touch each other.
    """

    obstacles: tuple[PlacedShape, ...]
    names: tuple[str, ...]
    allowed: AllowedCollisionMatrix = field(default_factory=AllowedCollisionMatrix)


def primitive(kind: str, sizes: Sequence[float], name: str) -> Solid:
    """A primitive of an object.

    Args:
        kind: a key of `SIZES`.
        sizes: of a box its full sides, of a sphere its radius, of others radius and length.
        name: of the object, for messages.

    Raises:
        InputError: there is none of the kind, or of these sizes.
    """
    check_kind(kind, name)
    if not all(size > 0 for size in sizes):
        raise InputError(f"object {name!r}: dimensions must be positive, not {list(sizes)}")
    try:
        return _SOLIDS[kind](*sizes)
    except ValueError as error:  # a shape's own
        raise InputError(f"object {name!r}: {error}") from error


def check_kind(kind: str, name: str) -> None:
    """Raises InputError unless primitives of this kind are read."""
    if kind in _UNREAD:
        raise InputError(f"object {name!r}: {_UNREAD[kind]}")
    if kind not in SIZES:
        raise InputError(f"object {name!r} is a {kind!r}; {suggestion(kind, (*SIZES, 'mesh'))}")


def _cone(radius: float, length: float) -> ConvexHull:
    """About a cone whose tip is up its z axis and whose middle is at the origin."""
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    rim = radius / math.cos(np.pi / SIDES) * np.array([np.cos(angles), np.sin(angles)]).T
    low = np.column_stack([rim, np.full(SIDES, -length / 2)])
    return ConvexHull.of_points(np.concatenate([low, [[0.0, 0.0, length / 2]]]))


_SOLIDS: Mapping[str, Callable[..., Solid]] = {
    "box": lambda *sides: Box(np.zeros(3), np.array(sides)),
    "sphere": Sphere,
    "cylinder": Cylinder,
    "cone": _cone,
}


def mesh(vertices: Array, faces: NDArray[np.int64], name: str) -> Mesh:
    """A mesh of an object, of vertices (n, 3) and faces (m, 3).

    Raises:
        InputError: it holds nothing.
    """
    what = f"the mesh of object {name!r}"
    soup = Soup(vertices, faces)
    try:
        soup.check()
    except UnreadableError as error:
        raise InputError(f"{what} cannot be used: {error}") from error
    if len(faces) == 0:
        raise InputError(f"{what} has no triangles")
    found = cleaned(soup, what)
    if not found.closed:
        raise InputError(
            f"{what} is not watertight, so it has no inside: {found.holes}; close its holes"
        )
    return Mesh(found.vertices, found.faces)
