"""Convex hulls of meshes: what is apart from the hull is apart from the mesh, and no solid that is
apart from the hull of another lies within it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from envs.collision import shapes
from envs.collision.hull_support import corners_by_cell
from envs.collision.mesh import queries
from envs.collision.shapes import Mesh
from envs.problem import Array

_MOST_CORNERS = 320
"""Of a hull that is taken as it is; all are looked at in each step of a search."""

_DIRECTIONS = 128
"""In which corners are sought of a hull that has more."""

_ROUNDING = 1e-12
"""By how much a hull is larger than computed, by the size of the mesh's numbers."""

_SAME = 1e-9
"""By how much, of itself, the area of a convex mesh may be off that of its hull."""


@dataclass(frozen=True, eq=False)
class Hull:
    """All points no farther than a radius from a convex core, which hold a mesh.

    Attributes:
        corners: (k, 3) of the core, in the mesh's frame.
        radius: in the mesh's units.
        is_surface: whether the hull's boundary is the mesh itself, so that what is apart from the
            hull is as far from the mesh.
    """

    corners: Array
    radius: float
    is_surface: bool

    @cached_property
    def by_cell(self) -> tuple[Array, NDArray[np.int64]]:
        """See `corners_by_cell`."""
        return corners_by_cell(self.corners)


_known: WeakKeyDictionary[Mesh, Hull] = WeakKeyDictionary()


def hull_of(mesh: Mesh) -> Hull:
    """Made once for as long as there is the mesh."""
    if mesh not in _known:
        _known[mesh] = _hull(mesh)
    return _known[mesh]


def _hull(mesh: Mesh) -> Hull:
    from scipy.spatial import ConvexHull, QhullError  # which processes without meshes can save

    rounding = _ROUNDING * float(np.abs(mesh.vertices).max())
    try:
        whole = ConvexHull(mesh.vertices)
    except QhullError:  # flat, a line or a point
        return _box(mesh, rounding)
    corners = mesh.vertices[whole.vertices]
    if len(corners) <= _MOST_CORNERS:
        area, volume = _area_and_volume(mesh)
        same = math.isclose(area, whole.area, rel_tol=_SAME)
        same = same and math.isclose(volume, whole.volume, rel_tol=_SAME)
        return Hull(corners, rounding, is_surface=same)
    few = corners[np.unique((corners @ _directions().T).argmax(axis=0))]
    try:
        core = shapes.ConvexHull.of_points(few)
    except ValueError:  # nearly flat, and of these corners flat
        return _box(mesh, rounding)
    beyond = float(queries(core).distance(corners).max())  # of all corners, none lies within it
    return Hull(few, beyond * (1 + _ROUNDING) + rounding, is_surface=False)


def _box(mesh: Mesh, rounding: float) -> Hull:
    """That of the box about a mesh."""
    sides = np.stack(np.meshgrid(*np.stack(mesh.bounds, axis=1)), axis=-1)
    return Hull(sides.reshape(-1, 3), rounding, is_surface=False)


def _area_and_volume(mesh: Mesh) -> tuple[float, float]:
    """Of the faces together; the volume is that of the solid if they close it and are wound alike,
    whichever way."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0), 1, 0)
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1).sum() / 2
    return float(area), abs(float(np.einsum("ni,ni->", a, cross))) / 6


def _directions() -> Array:
    """(k, 3), evenly on the sphere: a spiral whose turns are as far apart as its points."""
    n = np.arange(_DIRECTIONS) + 0.5
    height = 1 - 2 * n / _DIRECTIONS
    angle = math.pi * (1 + math.sqrt(5)) * n
    aside = np.sqrt(1 - height**2)
    return np.stack([aside * np.cos(angle), aside * np.sin(angle), height], axis=1)
