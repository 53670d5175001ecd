"""Points on the surface of obstacles, for learners that look at the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from envs.collision.shapes import Box, Cylinder, Obstacle, Placed, Solid, Sphere
from envs.problem import Array

if TYPE_CHECKING:
    import trimesh

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
    if isinstance(obstacle, Placed):
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
