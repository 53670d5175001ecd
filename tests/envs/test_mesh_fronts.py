"""Distances of two meshes from pose to pose by what was known before, beside searches anew."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from envs.collision import mesh_fronts
from envs.collision.mesh_distance import mesh_to_mesh
from envs.collision.mesh_fronts import NO_FRONT, distance_by_front, fronts_for, take_front
from envs.collision.mesh_tree import trees_of
from envs.collision.shapes import Mesh
from envs.problem import Array


def bowl() -> Mesh:
    """A ball without its top."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.07)
    below = ball.triangles_center[:, 2] < 0.03
    return Mesh(np.asarray(ball.vertices), np.asarray(ball.faces)[below])


def rod() -> Mesh:
    made = trimesh.creation.cylinder(0.02, 0.1, sections=24)
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces))


def poses(rng: np.random.Generator, n: int, step: float) -> Array:
    """(n, 3, 4), each near the one before, of a rod in and about a bowl."""
    turns, places = [Rotation.identity()], [np.array([0.0, 0.0, 0.01])]
    for _ in range(n - 1):
        turns.append(Rotation.from_rotvec(rng.normal(size=3) * 10 * step) * turns[-1])
        places.append(places[-1] * 0.99 + rng.normal(size=3) * step)
    pairs = zip(turns, places, strict=True)
    return np.array([np.column_stack([turn.as_matrix(), place]) for turn, place in pairs])


@pytest.mark.parametrize("step", [1e-5, 1e-3, 1e-2])
@pytest.mark.parametrize("most", [np.inf, 0.02])
def test_distances_are_those_of_a_search(step: float, most: float) -> None:
    trees, roots = trees_of([bowl(), rod()])
    fronts = fronts_for(1)
    assert take_front(fronts, *roots) == 0
    touching = apart = 0
    for pose in poses(np.random.default_rng(1), 400, step):
        expected = mesh_to_mesh(trees, roots[0], trees, roots[1], pose, most, 0.0)
        found = distance_by_front(trees, fronts, 0, pose, most)
        if expected >= most:
            assert found >= most
        else:
            assert found == pytest.approx(expected, abs=1e-12)
        touching += expected == 0.0
        apart += 0.0 < expected < most
    assert apart > 20
    assert touching > 20 or step < 1e-2


def test_a_front_that_grows_too_large_begins_anew() -> None:
    trees, roots = trees_of([bowl(), rod()])
    fronts = fronts_for(1)
    take_front(fronts, *roots)
    sizes = []
    for pose in poses(np.random.default_rng(2), 2000, 1e-3):
        distance_by_front(trees, fronts, 0, pose, np.inf)
        sizes.append(fronts.sizes[0, 0])
    assert (np.diff(sizes) < 0).sum() > 2


def test_without_room_none_is_told_and_the_next_one_is() -> None:
    trees, roots = trees_of([bowl(), rod()])
    fronts = fronts_for(1)
    take_front(fronts, *roots)
    pose = np.eye(3, 4)
    fronts.nodes[0, :], fronts.levels[0] = roots, -np.inf
    fronts.reaches[0], fronts.sizes[0] = 0.0, (mesh_fronts._MOST, -1, mesh_fronts._MOST)
    assert distance_by_front(trees, fronts, 0, pose, np.inf) < 0
    expected = mesh_to_mesh(trees, roots[0], trees, roots[1], pose, np.inf, 0.0)
    assert distance_by_front(trees, fronts, 0, pose, np.inf) == pytest.approx(expected, abs=1e-12)


def test_there_are_so_many_fronts_and_no_more() -> None:
    fronts = fronts_for(2)
    assert [take_front(fronts, n, n) for n in range(4)] == [0, 1, NO_FRONT, NO_FRONT]
