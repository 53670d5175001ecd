"""How far parts of made trees come apart, and whether they keep apart, against all distances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_trees import made_tree

from envs.collision.separation import separations
from envs.collision.shapes import Mesh, PlacedShape
from envs.problem import Array
from envs.robots import allowed_collisions
from envs.robots.allowed_collisions import FAR
from envs.robots.arm import Arm, Part
from envs.robots.urdf import read_urdf

SEEDS = range(8)


def made_arm(folder: Path, seed: int) -> Arm:
    """Of a made tree, a third of whose solids are meshes."""
    file = folder / f"{seed}.urdf"
    file.write_text(made_tree(seed))
    tree, parts = read_urdf(file)
    rng = np.random.default_rng(seed)
    made = [Part(p.body, as_mesh(p.placed) if rng.random() < 1 / 3 else p.placed) for p in parts]
    return Arm(tree, made, self_collision=True)


def as_mesh(placed: PlacedShape) -> PlacedShape:
    surface = placed.solid.triangulate()
    return PlacedShape(Mesh(surface.vertices, surface.faces), placed.pose)


def distances(arm: Arm, i: int, j: int, q: Array) -> Array:
    """Of two parts at configurations (n, d), (n,)."""
    bodies = [arm.parts[part].body for part in (i, j)]
    poses = np.array([arm.body_poses(one)[bodies] for one in q])
    return np.asarray(separations(arm.arrays.shapes, i, j, poses, np.inf))


@pytest.mark.parametrize("far", [FAR, 0.5, 10.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_parts_come_as_far_apart_as_in_any_configuration(
    seed: int, far: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(allowed_collisions, "_SAMPLES", 300)
    monkeypatch.setattr(allowed_collisions, "FAR", far)
    arm = made_arm(tmp_path, seed)
    q = allowed_collisions._random_configurations(arm.tree)
    found = arm.link_pairs.farthest
    for pair in arm.pairs:
        assert found[pair] == found[pair[::-1]] == min(distances(arm, *sorted(pair), q).max(), far)
    assert (found[~arm.link_pairs.checked] == 0).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_parts_keep_apart_where_all_of_their_distances_say_so(seed: int, tmp_path: Path) -> None:
    arm = made_arm(tmp_path, seed)
    rng = np.random.default_rng(seed)
    q = rng.uniform(arm.tree.lower, arm.tree.upper, (100, arm.tree.dimension))
    kept = rng.uniform(0.0, FAR, (len(arm.parts),) * 2)
    expected = np.ones(len(q), dtype=np.bool_)
    for pair in arm.pairs:
        expected &= distances(arm, *pair, q) >= kept[pair]
    assert arm.links_keep(kept, q).tolist() == expected.tolist()
