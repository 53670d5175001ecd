"""Whether parts that are meshes stay apart on motions, against their distances all along."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, turning
from made_trees import distances_of, made_arm

from envs.collision.shapes import Mesh, PlacedShape
from envs.problem import Array
from envs.robots import allowed_collisions, swept_pairs
from envs.robots.arm import Arm, Part
from envs.robots.motion_bounds import motion_bounds

STEPS = 200


def moved_apart(arm: Arm, pair: Array, a: Array, b: Array, tolerance: float) -> bool:
    return bool(swept_pairs.motion_keeps_apart(arm.arrays, pair[None], a, b, tolerance))


def nearing(arm: Arm, pair: Array, a: Array, b: Array) -> float:
    """How much nearer the two come at most on a motion."""
    found = np.empty(1)
    one = arm.arrays._replace(branches=pair[None])
    motion_bounds(one, a, b, np.empty(arm.moving), found)
    return float(found[0])


@pytest.mark.parametrize("tolerance", [2e-3, 0.05])
@pytest.mark.parametrize("seed", range(6))
def test_motions_keep_apart_where_distances_all_along_do(
    seed: int, tolerance: float, tmp_path: Path
) -> None:
    arm = made_arm(tmp_path, seed, meshes=1)
    rng = np.random.default_rng(seed)
    for pair in arm.arrays.branches:
        for a, b in rng.uniform(arm.tree.lower, arm.tree.upper, (3, 2, arm.tree.dimension)):
            q = a + np.linspace(0, 1, STEPS + 1)[:, None] * (b - a)
            least = distances_of(arm, *pair[:2], q).min()
            if moved_apart(arm, pair, a, b, tolerance):
                assert least > tolerance / 2
            else:
                assert least <= tolerance + nearing(arm, pair, a, b) / (2 * STEPS)


def swinging(height: float) -> Arm:
    """A thin blade that swings past a thin post, so high above it."""
    blade, post = trimesh.creation.box((0.3, 0.002, 0.002)), trimesh.creation.box((0.002,) * 3)
    return arm_of(
        [turning("z"), turning("z")],
        Part(2, PlacedShape(Mesh(blade.vertices, blade.faces), at(0.4, 0, height + 0.002))),
        Part(1, PlacedShape(Mesh(*plate()), at(0, 0, -1))),
        Part(0, PlacedShape(Mesh(post.vertices, post.faces), at(0.5, 0, 0))),
        self_collision=True,
    )


def plate() -> tuple[Array, Array]:
    """Of a link between the two, so that they are no neighbours."""
    box = trimesh.creation.box((0.01,) * 3)
    return box.vertices, box.faces


@pytest.mark.parametrize(("height", "apart"), [(0.0, False), (9e-4, False), (2.1e-3, True)])
def test_nothing_thin_is_slipped_through(height: float, apart: bool) -> None:
    """Far from each other at either end, and in the middle, too."""
    arm = swinging(height)
    [pair] = [row for row in arm.arrays.branches if set(row[:2]) == {0, 2}]
    a, b = np.array([-1.1, -0.7]), np.array([1.9, 1.1])
    middle = distances_of(arm, *pair[:2], np.array([a, (a + b) / 2, b]))
    assert middle.min() > 0.05
    assert moved_apart(arm, pair, a, b, 2e-3) is apart
    assert moved_apart(arm, pair, b, a, 2e-3) is apart


def test_meshes_that_are_always_near_are_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And all other pairs are asked for their distances."""
    monkeypatch.setattr(allowed_collisions, "_SAMPLES", 300)
    monkeypatch.setattr(allowed_collisions, "FAR", 1.0)  # at 0.05 all made ones come that far apart
    monkeypatch.setattr(swept_pairs, "FAR", 0.5)
    kinds = set()
    for seed in range(4):
        arm = made_arm(tmp_path, seed, meshes=0.7)
        others, swept = swept_pairs.split(arm)
        assert sorted(map(tuple, [*others, *swept])) == sorted(map(tuple, arm.arrays.branches))
        for rows, are_swept in ((others, False), (swept, True)):
            for i, j, _ in rows:
                meshes = all(isinstance(arm.shapes[n], Mesh) for n in (i, j))
                near = bool(arm.link_pairs.farthest[i, j] < 0.5)
                assert (meshes and near) == are_swept
                kinds.add((meshes, near))
    assert len(kinds) == 4


def test_a_path_of_one_configuration_is_asked_there() -> None:
    arm = swinging(0.0)
    q = np.array([[0.0, 0.0], [0.5, 0.5]])
    pairs = arm.arrays.branches
    kept = [swept_pairs.path_keeps_apart(arm.arrays, pairs, one[None], 2e-3) for one in q]
    assert kept == [False, True]
    assert not swept_pairs.path_keeps_apart(arm.arrays, pairs, q, 2e-3)
