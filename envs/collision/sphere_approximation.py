"""Spheres that cover solids, for clearances of millions of configurations.

All of a solid lies within its spheres, so distances from them are never more than those from the
solid; `slack` bounds how much less they can be where the solid's surface is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from envs.collision.shapes import Box, Cylinder, Mesh, Solid, Sphere
from envs.errors import InputError
from envs.grid import cells_of
from envs.problem import Array


@dataclass(frozen=True)
class Spheres:
    """Spheres in a solid's frame: `centers` (m, 3), `radii` (m,)."""

    centers: Array
    radii: Array


def cover(solid: Solid, slack: float) -> Spheres:
    """Spheres that cover a solid and reach out of its sides by about `slack` at most.

    At edges and flat ends they reach out farther, by as much as a sphere is wide there.

    Raises:
        InputError: it would take too many.
    """
    if isinstance(solid, Sphere):
        return Spheres(np.zeros((1, 3)), np.array([solid.radius]))
    if isinstance(solid, Cylinder):
        return _cover_of_cylinder(solid, slack)
    if isinstance(solid, Box):
        return _cover_of_box(solid, slack)
    return _cover_of_mesh(solid, slack)


def bounding_sphere(solid: Solid) -> tuple[Array, float]:
    """Centre (3,) and radius of a sphere that holds a solid, in its frame."""
    if isinstance(solid, Sphere):
        return np.zeros(3), solid.radius
    if isinstance(solid, Cylinder):
        return np.zeros(3), float(np.hypot(solid.radius, solid.length / 2))
    if isinstance(solid, Box):
        return solid.center, float(np.linalg.norm(solid.sides) / 2)
    center = (solid.vertices.min(axis=0) + solid.vertices.max(axis=0)) / 2
    return center, float(np.linalg.norm(solid.vertices - center, axis=1).max())


def _cover_of_cylinder(solid: Cylinder, slack: float) -> Spheres:
    half = np.sqrt((solid.radius + slack) ** 2 - solid.radius**2)
    count = _countable(np.ceil(solid.length / (2 * half)))
    half = solid.length / (2 * count)
    centers = np.zeros((count, 3))
    centers[:, 2] = half * (2 * np.arange(count) + 1 - count)
    return Spheres(centers, np.full(count, np.hypot(solid.radius, half)))


def _cover_of_box(solid: Box, slack: float) -> Spheres:
    """One sphere a cell, one layer of them: they reach out of the two largest sides by `slack`, or
    by an eighth of a thick box's thickness, which would take very many otherwise."""
    half = solid.sides / 2
    thinnest = float(half.min())
    reach = max(np.sqrt((thinnest + slack) ** 2 - thinnest**2) / np.sqrt(2), thinnest / 2)
    wanted = np.maximum(np.ceil(half / reach), 1)
    wanted[np.argmin(half)] = 1
    _countable(wanted.prod())
    counts = wanted.astype(int)
    cell = half / counts
    steps = [c * (2 * np.arange(n) + 1 - n) for c, n in zip(cell, counts, strict=True)]
    centers = solid.center + np.array(list(product(*steps)))
    return Spheres(centers, np.full(len(centers), np.linalg.norm(cell)))


def _cover_of_mesh(solid: Mesh, slack: float) -> Spheres:
    """One sphere for each cell of a grid that holds some of the surface."""
    extent = float(np.ptp(solid.vertices, axis=0).max())
    cell = max(4 * slack, extent / _MOST_CELLS)
    import trimesh  # takes half a second, which processes without meshes can save

    fine: Any = trimesh.Trimesh(solid.vertices, solid.faces, process=False).subdivide_to_size(
        cell, 20
    )
    corners = np.asarray(fine.triangles)
    index = cells_of(corners.mean(axis=1), solid.vertices.min(axis=0), cell)
    _, owner = np.unique(index, axis=0, return_inverse=True)
    owner = owner.ravel()
    low, high = np.full((owner.max() + 1, 3), np.inf), np.full((owner.max() + 1, 3), -np.inf)
    np.minimum.at(low, owner, corners.min(axis=1))
    np.maximum.at(high, owner, corners.max(axis=1))
    centers = (low + high) / 2
    radii = np.zeros(len(centers))
    away = np.linalg.norm(corners - centers[owner][:, None], axis=2).max(axis=1)
    np.maximum.at(radii, owner, away)
    return Spheres(centers, radii)


def _countable(count: float) -> int:
    if count > _MOST_SPHERES:
        raise InputError(
            "a link is so large or so thin that its cover by spheres would take "
            f"{count:.2g} of them, more than {_MOST_SPHERES}; is its size in metres?"
        )
    return int(count)


_MOST_CELLS = 12  # along the longest side of a mesh
_MOST_SPHERES = 50_000  # of a solid; those of the arms that ship have some dozens
