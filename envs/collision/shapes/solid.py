"""What is asked of a shape."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from envs.collision.shapes.sphere_cover import Spheres
from envs.problem import Array

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
        """The row (17,), see `distance_row`, with its frame at a pose (4, 4) or (3, 4)."""

    @abstractmethod
    def triangulate(self) -> trimesh.Trimesh:
        """Its surface."""

    @abstractmethod
    def fcl_geometry(self) -> fcl.CollisionGeometry:
        """It as FCL has it, about the origin but for `offset`."""

    def piece_points(self) -> Array:
        """A point (n, 3) of each connected piece of it."""
        return np.zeros((1, 3)) if self.offset is None else self.offset[None]


def rounded(values: Array) -> list[Any]:
    """Numbers to nine decimals, for fingerprints: sines are not the same to the last bit on every
    machine."""
    listed: list[Any] = (np.round(values, 9) + 0.0).tolist()  # no -0.0
    return listed
