"""Points on the surface of obstacles, for learners that look at the scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from envs.collision.shapes import Box, Obstacle
from envs.problem import Array

SURFACE_POINTS = 20_000
"""How many learners look at, as in the paper."""


def surface_points(obstacles: Sequence[Obstacle], n: int, seed: int) -> Array:
    """`n` points (n, 3), uniform by area over the obstacles' surfaces, in the workspace frame.

    Where obstacles overlap, surface that lies within another is sampled as well.
    """
    mesh = trimesh.util.concatenate([triangulated(obstacle) for obstacle in obstacles])
    points, _ = trimesh.sample.sample_surface(mesh, n, seed=seed)
    return np.asarray(points, dtype=np.float64)


def triangulated(obstacle: Obstacle) -> trimesh.Trimesh:
    """An obstacle's surface, in the workspace frame."""
    if isinstance(obstacle, Box):
        box: trimesh.Trimesh = trimesh.creation.box(obstacle.sides)
        box.apply_translation(obstacle.center)
        return box
    return trimesh.Trimesh(obstacle.vertices, obstacle.faces, process=False)
