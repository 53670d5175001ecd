"""The checks of arms against Pinocchio and coal: a share of `benchmarks/arms_against_coal.py`."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from arm_agreement import agreement
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


@pytest.mark.parametrize("seed", range(100, 106))
def test_no_answer_is_wrong(seed: int, tmp_path: Path) -> None:
    check(made_arm(tmp_path, seed), tmp_path, 100, 15)


@pytest.mark.skipif("BENCH_DATA" not in os.environ, reason="BENCH_DATA names no folder of robots")
@pytest.mark.parametrize("name", ROBOTS)
def test_no_answer_about_a_real_robot_is_wrong(name: str, tmp_path: Path) -> None:
    check(real_arm(Path(os.environ["BENCH_DATA"]) / "mbm", tmp_path, name), tmp_path, 30, 4)
