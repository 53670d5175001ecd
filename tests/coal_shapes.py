"""Solids as coal takes them, and what is within them."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import trimesh
from exact_steps import encloses
from numpy.typing import NDArray

from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Sphere
from envs.problem import Array


def coal_geometry(solid: Any) -> Any:
    if isinstance(solid, Box):
        return coal.Box(*solid.sides)
    if isinstance(solid, Cylinder):
        return coal.Cylinder(solid.radius, solid.length)
    if isinstance(solid, Capsule):
        return coal.Capsule(solid.radius, solid.length)
    if isinstance(solid, Sphere):
        return coal.Sphere(solid.radius)
    assert isinstance(solid, Mesh)
    return coal_mesh(solid.vertices, solid.faces)


def coal_mesh(vertices: Array, faces: NDArray[np.int64]) -> Any:
    """A surface for coal."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices:
        points.append(np.array(vertex))
    for face in faces:
        triangles.append(coal.Triangle(*map(int, face)))
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(points, triangles)
    model.endModel()
    return model


def coal_pose(placed: PlacedShape) -> Array:
    """(4, 4), of what coal has for a placed solid: the middle of its boxes is the origin."""
    pose = placed.pose.copy()
    if isinstance(placed.solid, Box):
        pose[:3, 3] += pose[:3, :3] @ placed.solid.center
    return pose


class ExactSolid:
    """A solid of coal's, of which meshes are surfaces unless they are convex.

    Args:
        geometry: coal's; a surface, if it is a mesh.

    Attributes:
        geometry: the same, but a convex mesh as a convex solid, of which coal finds distances in a
            tenth of the time.
        hull: a convex solid about it; itself, if it is one.
        middle, half: (3,) of its bounding box.
        radius: of a ball about the middle that holds it.
        points: (k, 3) one of each piece.
        surface: of a mesh, its corners (m, 3, 3); else None.
    """

    def __init__(self, geometry: Any) -> None:
        geometry.computeLocalAABB()
        box = geometry.aabb_local
        self.middle, self.half = np.array(box.center()), (box.max_ - box.min_) / 2
        self.radius = float(np.linalg.norm(self.half))
        self.geometry = self.hull = geometry
        self.points = np.zeros((1, 3))
        self.surface: Array | None = None
        if isinstance(geometry, coal.BVHModelBase):
            self._take_mesh(geometry)

    def _take_mesh(self, geometry: Any) -> None:
        vertices = np.array(geometry.vertices())
        each = [geometry.tri_indices(n) for n in range(geometry.num_tris)]
        faces = np.array([[one[0], one[1], one[2]] for one in each])
        whole = trimesh.Trimesh(vertices, faces)  # merges corners of STL files
        pieces = whole.split(only_watertight=False)
        self.points = np.array([piece.vertices[0] for piece in pieces])
        self.radius = float(np.linalg.norm(whole.vertices - self.middle, axis=1).max())
        self.surface = np.array(whole.triangles)
        hull = whole.convex_hull
        about = coal_mesh(hull.vertices, hull.faces)
        about.buildConvexRepresentation(False)
        self.hull = about.convex
        self.hull.computeLocalAABB()
        if len(pieces) == 1 and whole.is_watertight and whole.is_convex:
            self.geometry = self.hull

    def encloses(self, points: Array) -> bool:
        """Whether the inside of a mesh has one of some points (n, 3)."""
        assert self.surface is not None
        near = points[(np.abs(points - self.middle) < self.half).all(axis=1)]
        return len(near) > 0 and bool(encloses(self.surface, near))
