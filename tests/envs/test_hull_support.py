"""The corner of a hull that is furthest along a direction, beside a look at all corners."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from envs.collision.hull_support import CELLS, corners_by_cell, furthest
from envs.problem import Array

HULLS = {
    "ball": trimesh.creation.icosphere(subdivisions=2),
    "box": trimesh.creation.box((0.1, 2.0, 0.3)),
    "rod": trimesh.creation.cylinder(0.02, 0.4, sections=80),
    "cone": trimesh.creation.cone(0.1, 0.2, sections=50),
}


def directions(rng: np.random.Generator) -> Array:
    """(n, 3): any, along axes and diagonals, and on and about the sides of cells."""
    few = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    grid = rng.integers(-4, 5, size=(2000, 3)) / 4.0
    about = grid + rng.normal(size=grid.shape) * 1e-12
    return np.concatenate([rng.normal(size=(2000, 3)), few, grid, about])


@pytest.mark.parametrize("name", HULLS)
def test_the_furthest_corner_is_that_of_all(name: str) -> None:
    rng = np.random.default_rng(0)
    corners = np.asarray(HULLS[name].vertices) + rng.normal(size=3)
    by_cell, firsts = corners_by_cell(corners)
    assert len(firsts) == CELLS + 1
    assert firsts[-1] == len(by_cell)
    for way in directions(rng):
        found = np.array(furthest((by_cell, firsts), *way))
        assert found @ way >= (corners @ way).max() - 1e-15 * np.abs(corners).max()
        assert (corners == found).all(axis=1).any()


def test_few_corners_are_asked() -> None:
    corners = np.asarray(trimesh.creation.icosphere(subdivisions=2).vertices)
    assert len(corners_by_cell(corners)[0]) < 0.1 * CELLS * len(corners)
