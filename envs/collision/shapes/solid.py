"""What is asked of a shape, and the two forms in which others look at it.

As a row of `ROW` numbers, for compiled code, it is all points no farther than a radius from a
convex core: a ball is a point and a radius, a capsule a line and a radius. The row has the axes
(3, 3) of the core, row by row; its centre (3,); its size (3,), which is half the sides of a box (0
along an axis makes it a rectangle, 0 along two a line), radius, half length and 0 of a cylinder, 0
of a point; the radius of a sphere about the centre that holds the shape; what the core is; and the
radius about the core.

As spheres that cover it, for clearances of millions of configurations: all of it lies within them,
so distances from them are never more than those from the shape; `slack` bounds how much less they
can be where the shape's surface is smooth.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from envs.errors import InputError
from envs.plain_scene import PlainSolid
from envs.problem import Array

BOX, CYLINDER, POINT, TRIANGLE, MESH = 0.0, 1.0, 2.0, 3.0, -1.0
"""What a row says that its core is; the last of them stands for a mesh. A triangle's has its
corners from its centre in place of axes, and size 0."""

ROW = 18
"""Numbers of a row."""


def make_row(core: float, turn: Array, center: Array, size: Array, radius: float = 0.0) -> Array:
    """The row (`ROW`,) of a solid.

    Args:
        core: `BOX`, `CYLINDER` or `POINT`.
        turn: (3, 3), the rotation of the core.
        center: (3,) of the core, where that puts it.
        size: (3,) of the core, see the module.
        radius: how far about the core the solid reaches.
    """
    held = np.linalg.norm(size) + radius
    return np.concatenate([turn.T.ravel(), center, size, [held, core, radius]])


_MOST_SPHERES = 50_000
"""Of a solid; those of the arms that ship have some dozens."""


@dataclass(frozen=True)
class Spheres:
    """Spheres in a solid's frame: `centers` (m, 3), `radii` (m,)."""

    centers: Array
    radii: Array


def countable(count: float) -> int:
    """A number of spheres.

    Raises:
        InputError: they are too many.
    """
    if count > _MOST_SPHERES:
        raise InputError(
            "a link is so large or so thin that its cover by spheres would take "
            f"{count:.2g} of them, more than {_MOST_SPHERES}; is its size in metres?"
        )
    return int(count)


if TYPE_CHECKING:  # each takes long to import, which processes that do not ask can save
    import fcl
    import trimesh

LARGEST = 1e6
"""Of numbers in users' files of arms and scenes. Metres and radians beyond it are mistakes, and
might overflow where they multiply."""

_UNMOVED = np.eye(4)
_UNMOVED.flags.writeable = False


class Solid(ABC):
    """A shape in a frame of its own. As an obstacle that is not placed anywhere, it is where it is
    with its frame in the workspace's.

    Class attributes:
        kind: what it is called in scene files, definitions and messages.
        exact_in_fcl: whether FCL has its distance from a ball in closed form where it is not
            turned.
    """

    kind: ClassVar[str]
    exact_in_fcl: ClassVar[bool] = False

    @property
    def solid(self) -> Solid:
        """Itself, as of a `PlacedShape`."""
        return self

    @property
    def pose(self) -> Array:
        """The pose (4, 4) at which it is as it is."""
        return _UNMOVED

    @property
    def offset(self) -> Array | None:
        """Where the middle of what FCL is given is in its frame, (3,); None for the origin."""
        return None

    @abstractmethod
    def definition(self) -> list[Any]:
        """The numbers that it is made of, after its kind, as JSON data for fingerprints."""

    @abstractmethod
    def bounding_sphere(self) -> tuple[Array, float]:
        """Centre (3,) and radius of a sphere that holds it."""

    @abstractmethod
    def sphere_cover(self, slack: float) -> Spheres:
        """Spheres that cover it and reach out of its sides by about `slack` at most.

        At edges and flat ends they reach out farther, by as much as a sphere is wide there.

        Raises:
            InputError: it would take too many.
        """

    @abstractmethod
    def distance_row(self, pose: Array) -> Array:
        """Its row (`ROW`,), see the module and `make_row`, with its frame at a pose (4, 4) or
        (3, 4)."""

    @abstractmethod
    def triangulate(self) -> trimesh.Trimesh:
        """Its surface."""

    @abstractmethod
    def fcl_geometry(self) -> fcl.CollisionGeometry:
        """It as FCL has it, about the origin but for `offset`."""

    def plain(self, pose: Array) -> PlainSolid:
        """It as plain data, with its frame at a pose (4, 4): by default its surface."""
        surface = self.triangulate()
        faces = np.asarray(surface.faces, dtype=np.int64)
        return PlainSolid("mesh", {}, pose, np.asarray(surface.vertices), faces)

    def piece_points(self) -> Array:
        """A point (n, 3) of each connected piece of it."""
        return np.zeros((1, 3)) if self.offset is None else self.offset[None]


def rounded(values: Array) -> list[Any]:
    """Numbers to nine decimals, for fingerprints: sines are not the same to the last bit on every
    machine."""
    listed: list[Any] = (np.round(values, 9) + 0.0).tolist()  # no -0.0
    return listed
