"""Shapes that are surfaces of triangles."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes.solid import MESH, ROW, Solid, Spheres
from envs.grid import cells_of
from envs.problem import Array, frozen_array

if TYPE_CHECKING:
    import fcl
    import trimesh

_MOST_CELLS = 12
"""Along the longest side, of those that are covered by a sphere each."""


@dataclass(frozen=True, eq=False)
class Mesh(Solid):
    """A triangulated surface: `vertices` (n, 3) in its frame, `faces` (m, 3).

    Equal to another if both have the same numbers.
    """

    kind: ClassVar[str] = "mesh"

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
    def bounds(self) -> tuple[Array, Array]:
        """Corners (3,) of its box along the axes of its frame."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @cached_property
    def digest(self) -> str:
        """Of the numbers, the same on every machine."""
        return digest_of(self.vertices, self.faces)

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

    def definition(self) -> list[Any]:
        return [self.kind, self.digest]

    def bounding_sphere(self) -> tuple[Array, float]:
        center = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2
        return center, float(np.linalg.norm(self.vertices - center, axis=1).max())

    def sphere_cover(self, slack: float) -> Spheres:
        """One sphere for each cell of a grid that holds some of the surface."""
        extent = float(np.ptp(self.vertices, axis=0).max())
        cell = max(4 * slack, extent / _MOST_CELLS)
        fine: Any = self.triangulate().subdivide_to_size(cell, 20)
        corners = np.asarray(fine.triangles)
        index = cells_of(corners.mean(axis=1), self.vertices.min(axis=0), cell)
        index -= index.min(axis=0)
        numbers = np.ravel_multi_index(tuple(index.T), tuple(index.max(axis=0) + 1))
        _, owner = np.unique(numbers, return_inverse=True)
        low, high = np.full((owner.max() + 1, 3), np.inf), np.full((owner.max() + 1, 3), -np.inf)
        np.minimum.at(low, owner, corners.min(axis=1))
        np.maximum.at(high, owner, corners.max(axis=1))
        centers = (low + high) / 2
        radii = np.zeros(len(centers))
        away = np.linalg.norm(corners - centers[owner][:, None], axis=2).max(axis=1)
        np.maximum.at(radii, owner, away)
        return Spheres(centers, radii)

    def distance_row(self, pose: Array) -> Array:
        """With but its axes, and the centre and the radius of a sphere that holds it."""
        center, radius = self.bounding_sphere()
        row = np.zeros(ROW)
        row[:9] = pose[:3, :3].T.ravel()
        row[9:12] = pose[:3, :3] @ center + pose[:3, 3]
        row[15], row[16] = radius * (1 + 1e-12), MESH
        return row

    def triangulate(self) -> trimesh.Trimesh:
        import trimesh  # half a second, which processes without meshes can save

        return trimesh.Trimesh(self.vertices, self.faces, process=False)

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        import fcl

        model = fcl.BVHModel()
        model.beginModel(len(self.vertices), len(self.faces))
        model.addSubModel(self.vertices, self.faces)
        model.endModel()
        return model

    def piece_points(self) -> Array:
        return self._piece_points

    @cached_property
    def _piece_points(self) -> Array:
        import trimesh

        pieces = trimesh.graph.connected_components(
            self.triangulate().face_adjacency, nodes=np.arange(len(self.faces))
        )
        return np.array([self.vertices[self.faces[piece[0], 0]] for piece in pieces])


def digest_of(*arrays: NDArray[Any]) -> str:
    """Of numbers, the same on every machine."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()
