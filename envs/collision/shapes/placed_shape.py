"""Shapes that are put somewhere, and points on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from envs.collision.shapes.solid import Solid, rounded
from envs.problem import Array, frozen_array

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A solid put somewhere.

    Attributes:
        solid: in its own frame.
        pose: (4, 4), from that frame to the frame in which it is placed.
    """

    exact_in_fcl: ClassVar[bool] = False

    solid: Solid
    pose: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen_array(self.pose, 2, "pose"))
        if self.pose.shape != (4, 4):
            raise ValueError(f"a pose must be (4, 4), not {self.pose.shape}")

    def definition(self) -> list[Any]:
        """The numbers that it is made of, as JSON data."""
        return [*self.solid.definition(), rounded(self.pose[:3])]

    def triangulate(self) -> trimesh.Trimesh:
        """Its surface, in the frame in which it is placed."""
        placed = self.solid.triangulate()
        placed.apply_transform(self.pose)
        return placed

    def piece_points(self) -> Array:
        """A point (n, 3) of each connected piece of it, in the frame in which it is placed."""
        points: Array = self.solid.piece_points() @ self.pose[:3, :3].T + self.pose[:3, 3]
        return points


Obstacle = Solid | PlacedShape
"""What is fixed in the workspace, with a `solid` and its `pose` there; solids that are not placed
are in its frame."""

SURFACE_POINTS = 20_000
"""How many learners look at, as in the paper."""


def surface_points(obstacles: Sequence[Obstacle], n: int, seed: int) -> Array:
    """`n` points (n, 3), uniform by area over the obstacles' surfaces, in the workspace frame.

    Where obstacles overlap, surface that lies within another is sampled as well.
    """
    import trimesh  # half a second, which processes that look at no surface can save

    mesh = trimesh.util.concatenate([obstacle.triangulate() for obstacle in obstacles])
    points, _ = trimesh.sample.sample_surface(mesh, n, seed=seed)
    return np.asarray(points, dtype=np.float64)
