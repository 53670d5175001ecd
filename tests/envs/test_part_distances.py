"""How far parts of made trees come apart, and whether they keep apart, against all distances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_trees import distances_of, made_arm

from envs.robots import allowed_collisions
from envs.robots.allowed_collisions import FAR

SEEDS = range(8)


@pytest.mark.parametrize("far", [FAR, 0.5, 10.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_parts_come_as_far_apart_as_in_any_configuration(
    seed: int, far: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(allowed_collisions, "_SAMPLES", 300)
    monkeypatch.setattr(allowed_collisions, "FAR", far)
    arm = made_arm(tmp_path, seed, meshes=1 / 3)
    q = allowed_collisions._random_configurations(arm.tree)
    found = arm.link_pairs.farthest
    for pair in arm.pairs:
        assert (
            found[pair] == found[pair[::-1]] == min(distances_of(arm, *sorted(pair), q).max(), far)
        )
    assert (found[~arm.link_pairs.checked] == 0).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_parts_keep_apart_where_all_of_their_distances_say_so(seed: int, tmp_path: Path) -> None:
    arm = made_arm(tmp_path, seed, meshes=1 / 3)
    rng = np.random.default_rng(seed)
    q = rng.uniform(arm.tree.lower, arm.tree.upper, (100, arm.tree.dimension))
    kept = rng.uniform(0.0, FAR, (len(arm.parts),) * 2)
    expected = np.ones(len(q), dtype=np.bool_)
    for pair in arm.pairs:
        expected &= distances_of(arm, *pair, q) >= kept[pair]
    assert arm.links_keep(kept, q).tolist() == expected.tolist()
