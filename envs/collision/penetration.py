"""How deep two shapes are in each other, for messages."""

from __future__ import annotations

import numpy as np
import trimesh
from trimesh import remesh

from envs.collision.mesh import queries
from envs.collision.shapes import Mesh, Solid
from envs.problem import Array

_FINENESS = 40
"""Points of a surface are no farther apart than this part of the shape's size."""


def penetration_depth(one: Solid, other: Solid, one_pose: Array, other_pose: Array) -> float:
    """How far the deepest of many points of either's surface is within the other, in workspace
    units; 0 where none is.

    Args:
        one, other: two solids.
        one_pose, other_pose: (3, 4), from their frames to the workspace.

    Example:
        >>> from envs.collision.shapes import Box
        >>> cube, still, moved = Box([0, 0, 0], [2, 2, 2]), np.eye(3, 4), np.eye(3, 4)
        >>> moved[0, 3] = 1.75
        >>> round(penetration_depth(cube.solid, cube.solid, still, moved), 6)
        0.25
    """
    surfaces = [_surface(one, one_pose), _surface(other, other_pose)]
    return max(_depth(a, b) for a, b in (surfaces, surfaces[::-1]))


def _surface(solid: Solid, pose: Array) -> trimesh.Trimesh:
    surface = solid.triangulate().copy()
    surface.apply_transform(np.vstack([pose, [0, 0, 0, 1]]))
    return surface


def _depth(points_of: trimesh.Trimesh, within: trimesh.Trimesh) -> float:
    """Of the first's points in the second."""
    longest = float(points_of.scale) / _FINENESS
    divided = remesh.subdivide_to_size(  # type: ignore[no-untyped-call]
        points_of.vertices, points_of.faces, longest
    )
    points = divided[0]
    near = ((points >= within.bounds[0]) & (points <= within.bounds[1])).all(axis=1)
    if not near.any():
        return 0.0
    about = queries(Mesh(within.vertices, within.faces))
    inside = about.is_inside(points[near])
    return float(about.distance(points[near][inside]).max(initial=0.0))
