"""Checks of motions against Pinocchio and coal: a share of `benchmarks/motions_against_coal.py`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compared_robots import comparison, of_arm
from conftest import has_data
from exact_robots import ExactArm, RobotFiles
from made_robots import let_links_touch_obstacles, made_tree_world
from motion_agreement import Agreement

from envs.robots.arm import Arm
from envs.robots.rigid_body import RigidBody


def compared(name: str, folder: Path, draws: int, seed: int = 0) -> Agreement:
    return comparison(name, folder)(draws, np.random.default_rng(seed))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        *(f"tree {n}" for n in range(100, 105)),
        *(f"touching {n}" for n in range(100, 104)),
        *("body 100", "body 101", "ur5", "baxter_left"),
    ],
)
def test_no_answer_is_wrong(name: str, tmp_path: Path) -> None:
    found = compared(name, tmp_path, 20)
    assert found.wrong == 0, found
    assert 0 < found.accepted < found.motions


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "fetch"])
def test_no_answer_about_a_robot_of_motionbenchmaker_is_wrong(name: str, tmp_path: Path) -> None:
    if not has_data(f"mbm/{name}/{name}.urdf"):
        pytest.skip("BENCH_DATA has no robots")
    found = compared(f"mbm/{name}", tmp_path, 4)
    assert found.wrong == 0, found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "bound", "name"),
    [(RigidBody, "motion_bound", "body 1"), (Arm, "_reach", "tree 104")],
)
def test_speeds_taken_for_half_of_what_they_are_are_noticed(
    robot: Any, bound: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = getattr(robot, bound)
    monkeypatch.setattr(robot, bound, lambda *args: 0.5 * whole(*args))
    found = compared(name, tmp_path, 40)
    assert found.false_accepts > 0
    assert found.cases[0].startswith("accepted by ")


@pytest.mark.slow
def test_contacts_that_only_one_check_allows_are_noticed(tmp_path: Path) -> None:
    text, files = made_tree_world(tmp_path, 100)
    strict = of_arm(text, files)
    contacts = let_links_touch_obstacles(tmp_path, 100)
    lenient = of_arm(text, files, contacts)
    strict.exact, lenient.exact = lenient.exact, strict.exact
    too_strict, too_lenient = (one(20, np.random.default_rng(0)) for one in (strict, lenient))
    assert too_strict.wrongly_invalid > 0
    assert too_strict.false_rejects > 0
    assert too_strict.false_accepts == 0
    assert too_lenient.wrongly_valid > 0
    assert too_lenient.false_accepts > 0


def test_a_pair_of_links_that_is_not_asked_is_noticed(tmp_path: Path) -> None:
    exact = comparison("tree 1", tmp_path).exact
    assert isinstance(exact, ExactArm)
    among = exact.pairs[(exact.pairs < len(exact.links)).all(axis=1)]
    every = exact.names(among)
    assert exact.leave_out_all_but(every) == []
    assert exact.leave_out_all_but(every[1:]) == every[:1]
    assert len(exact.pairs) == len(among) - 1 + (exact.pairs[:, 1] >= len(exact.links)).sum()


@pytest.mark.slow
def test_a_mesh_of_several_materials_is_what_its_file_has(tmp_path: Path) -> None:
    """A Panda's sixth link, here 6 mm deep in a cylinder: coal's reader makes it smaller, so that
    it would be 15 mm away."""
    if not has_data("mbm/panda/panda.urdf"):
        pytest.skip("BENCH_DATA has no robots")
    panda = Path(os.environ["BENCH_DATA"]) / "mbm/panda"
    scene = tmp_path / "scene.yaml"
    scene.write_text("obstacles:\n  - {cylinder: [0.05, 1.2], position: [0.1, 0.6, 0.6]}")
    files = f"urdf={panda / 'panda.urdf'},srdf={panda / 'panda.srdf'},group=panda_arm"
    both = of_arm(
        f"arm:{files},scene={scene}", RobotFiles(panda / "panda.urdf", panda / "panda.srdf")
    )
    q = np.array([2.7165, 1.647, -1.3364, -2.2147, 1.1422, 2.305, -0.2439])
    assert not both.env.collision_model().is_valid(q)
    assert both.exact.touches(both.exact.frames(q))
