"""Distances of balls from meshes, with leaves that may be near and without."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.collision.mesh import queries
from envs.collision.mesh_tree import Trees, trees_of
from envs.collision.point_to_mesh import ball_to_mesh
from envs.collision.shapes import Mesh
from envs.problem import Array


def bumpy(seed: int) -> Mesh:
    made = trimesh.creation.icosphere(subdivisions=2)
    points = made.vertices * np.random.default_rng(seed).uniform(0.5, 1.5, (len(made.vertices), 1))
    return Mesh(points, made.faces)


def asked(trees: Trees, points: Array, radius: float, most: float, hint: int) -> Array:
    return np.array([ball_to_mesh(trees, 0, *p, radius, most, hint)[0] for p in points])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.floats(0.0, 0.3), st.sampled_from([np.inf, 1.0, 0.2, 0.01]))
def test_they_are_libigls_whichever_leaf_is_looked_at_first(
    seed: int, radius: float, most: float
) -> None:
    mesh, rng = bumpy(seed), np.random.default_rng(seed)
    trees, _ = trees_of([mesh])
    points = rng.normal(size=(30, 3))
    exact = queries(mesh).distance(points)
    found = asked(trees, points, radius, most, -1)
    wanted = np.clip(exact - radius, 0, most)
    assert (found <= wanted + 1e-12).all()
    assert found == pytest.approx(wanted, abs=2e-7, rel=2e-7)
    leaves = np.flatnonzero(trees.child < 0)
    for hint in rng.choice(leaves, 5):
        again = asked(trees, points, radius, most, int(hint))
        assert (again <= wanted + 1e-12).all()
        assert again == pytest.approx(wanted, abs=2e-7, rel=2e-7)


def test_what_is_beyond_the_most_is_as_far_as_that() -> None:
    trees, _ = trees_of([bumpy(0)])
    for most in (0.1, 0.3, 1 / 3):
        found, nearest = ball_to_mesh(trees, 0, 9.0, 0.0, 0.0, 0.7, most, -1)
        assert found == most
        assert nearest == -1


def test_the_leaf_that_is_nearest_is_told() -> None:
    mesh = bumpy(3)
    trees, _ = trees_of([mesh])
    for point in np.random.default_rng(0).normal(size=(20, 3)):
        found, leaf = ball_to_mesh(trees, 0, *point, 0.0, np.inf, -1)
        face = mesh.faces[-1 - trees.child[leaf]]
        alone = Mesh(mesh.vertices[face], np.array([[0, 1, 2]]))
        assert queries(alone).distance(point[None])[0] == pytest.approx(found, abs=2e-7)
