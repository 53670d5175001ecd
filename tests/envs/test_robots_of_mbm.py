"""The robots of MotionBenchMaker, as they are, where the folder of real data has them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from conftest import has_data
from made_trees import assert_as_in_pinocchio

import envs
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld

GROUPS = {
    "panda": ("panda_arm", 7),
    "ur5": ("manipulator", 6),
    "fetch": ("arm_with_torso", 8),
    "baxter": ("both_arms", 14),
}

BOXES = "obstacles: [{box: [0.3, 0.3, 0.2], position: [0.9, 0.4, 0.4]}]"


def files_of(name: str) -> tuple[Path, Path]:
    if not has_data(f"mbm/{name}/{name}.urdf"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    folder = Path(os.environ["BENCH_DATA"]) / "mbm" / name
    return folder / f"{name}.urdf", folder / f"{name}.srdf"


@pytest.mark.parametrize("name", GROUPS)
def test_links_are_where_pinocchio_has_them(name: str) -> None:
    urdf, srdf = files_of(name)
    group, joints = GROUPS[name]
    env = envs.make(f"arm:urdf={urdf},srdf={srdf},group={group},self_collision=false")
    assert isinstance(env, ArmWorld)
    assert env.dimension == joints
    tree, parts = read_urdf(urdf)
    assert len(parts) > joints
    text = urdf.read_text()
    for one in (tree, env.robot.tree):
        q = np.random.default_rng(0).uniform(one.lower, one.upper, (10, one.dimension))
        assert_as_in_pinocchio(text, one, q)


@pytest.mark.slow(minutes=2)
@pytest.mark.parametrize("name", GROUPS)
def test_there_are_problems_whose_ends_touch_nothing(name: str, tmp_path: Path) -> None:
    urdf, srdf = files_of(name)
    (tmp_path / "scene.yaml").write_text(BOXES)
    scene = f"scene={tmp_path / 'scene.yaml'}"
    env = envs.make(f"arm:urdf={urdf},srdf={srdf},group={GROUPS[name][0]},{scene}")
    problems = env.sample_problems(10, 0)
    assert len(problems) == 10
    model = env.collision_model()
    assert all(model.is_valid(p.start) and model.is_valid(p.goal) for p in problems)


@pytest.mark.slow
@pytest.mark.parametrize("name", GROUPS)
@pytest.mark.parametrize("step", [0.02, 1.0])
def test_clearances_along_paths_are_those_of_single_configurations(
    name: str, step: float, tmp_path: Path
) -> None:
    """Of meshes that are always near each other, and of others."""
    urdf, srdf = files_of(name)
    (tmp_path / "scene.yaml").write_text(BOXES)
    scene = f"scene={tmp_path / 'scene.yaml'}"
    env = envs.make(f"arm:urdf={urdf},srdf={srdf},group={GROUPS[name][0]},{scene}")
    ends = env.space.sample(np.random.default_rng(1), 8)
    t = np.linspace(0, step, 60)
    pairs = zip(ends[::2], ends[1::2], strict=True)
    q = np.concatenate(
        [env.space.interpolate(*np.repeat([[a], [b]], 60, axis=1), t) for a, b in pairs]
    )
    model = env.collision_model()
    expected, found = np.array([model.clearance(one) for one in q]), env.clearance(q)
    free = expected > 0
    assert (free == (found > 0)).all()
    assert free.any()
    assert found[free] == pytest.approx(expected[free], abs=1e-9)
