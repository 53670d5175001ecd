"""Surface points of obstacles."""

from __future__ import annotations

import numpy as np
import pytest

from envs import Environment
from envs.collision.distance_fields import signed_distance_to_boxes
from envs.collision.shapes import Box, surface_points


def test_points_lie_on_surfaces_in_proportion_to_their_area() -> None:
    cube, slab = Box(np.zeros(3), np.ones(3)), Box(np.full(3, 5.0), np.array([2.0, 2, 0.5]))
    points = surface_points([cube, slab], 20_000, seed=1)
    assert points.shape == (20_000, 3)
    on_cube = np.abs(signed_distance_to_boxes(points, [cube])) < 1e-9
    on_slab = np.abs(signed_distance_to_boxes(points, [slab])) < 1e-9
    assert (on_cube | on_slab).all()
    assert on_cube.mean() == pytest.approx(6 / (6 + 12), abs=0.01)


def test_a_seed_gives_the_same_points(c3d: Environment) -> None:
    first, again, other = (surface_points(c3d.obstacles, 100, seed) for seed in (0, 0, 1))
    assert (first == again).all()
    assert (first != other).any()
