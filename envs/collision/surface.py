"""Points on the surface of obstacles, for learners that look at the scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from envs.collision.shapes import Box
from envs.problem import Array


def surface_points(obstacles: Sequence[Box], n: int, seed: int) -> Array:
    """`n` points (n, 3), uniform by area over the obstacles' surfaces, in the workspace frame.

    Where obstacles overlap, surface that lies within another is sampled as well.
    """
    solids = [trimesh.creation.box(box.sides).apply_translation(box.center) for box in obstacles]
    mesh = trimesh.util.concatenate(solids)
    points, _ = trimesh.sample.sample_surface(mesh, n, seed=seed)
    return np.asarray(points, dtype=np.float64)
