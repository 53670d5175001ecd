"""The checks of arms against Pinocchio and coal: a share of `benchmarks/arms_against_coal.py`."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from arm_agreement import agreement
from conftest import has_data
from exact_arms import ExactArm
from made_arms import made_arm
from real_arms import ROBOTS, real_arm

import envs
from envs.scenes.arm_world import ArmWorld


def check(text: str, folder: Path, configurations: int, motions: int) -> None:
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    exact = ExactArm(folder / "arm.urdf", env.obstacles, [folder])
    robot = env.robot
    pairs = {frozenset((robot.links[i], robot.links[j])) for i, j in robot.pairs}
    assert pairs == exact.pairs_of_links
    found = agreement(env, exact, configurations, motions, 0)
    assert found.wrong == 0, found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 106))
def test_no_answer_is_wrong(seed: int, tmp_path: Path) -> None:
    check(made_arm(tmp_path, seed), tmp_path, 100, 15)


def robot(name: str, folder: Path) -> str:
    """The text of a real robot's environment."""
    if not has_data(f"mbm/{name}/{name}.urdf"):
        pytest.skip("BENCH_DATA has no robots")
    return real_arm(Path(os.environ["BENCH_DATA"]) / "mbm", folder, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_no_answer_about_a_real_robot_is_wrong(name: str, tmp_path: Path) -> None:
    check(robot(name, tmp_path), tmp_path, 30, 4)


@pytest.mark.slow
def test_a_mesh_of_several_materials_is_what_its_file_has(tmp_path: Path) -> None:
    """A Panda's sixth link, here 6 mm deep in the scene's cylinder: coal's reader makes it smaller,
    so that it would be 15 mm away."""
    env = envs.make(robot("panda", tmp_path))
    exact = ExactArm(tmp_path / "arm.urdf", env.obstacles, [tmp_path])
    q = np.array([2.7165, 1.647, -1.3364, -2.2147, 1.1422, 2.305, -0.2439])
    assert not env.collision_model().is_valid(q)
    assert exact.touches(q)
