"""The planner, the environment and the robots that docs/ shows work as written."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import plugins
import pytest
import trimesh
from conftest import Cli
from documents import ROOT, block_after, blocks

from envs.registry.spec import load_class
from envs.robots import example_robot_data

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def points_of(text: str) -> dict[str, str]:
    """By "group name", the entry points that a pyproject.toml declares."""
    announced = tomllib.loads(text)["project"]["entry-points"]
    return {
        f"{group} {name}": value for group, of in announced.items() for name, value in of.items()
    }


def carry_out(commands: str, folder: Path, site: Path) -> str:
    """Has a shell's commands done in a folder, with the packages of a site; returns what they
    print."""
    printed = ""
    for line in commands.splitlines():
        name, *command = shlex.split(line)
        assert name == "bench"
        done = subprocess.run(
            [sys.executable, "-m", "bench", *command],
            env={**os.environ, "PYTHONPATH": f"{site}{os.pathsep}{ROOT}"},
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        printed += done.stdout
    return printed


@pytest.mark.slow
def test_the_planner_is_short_passes_its_checks_and_solves_problems(
    bench: Cli, tmp_path: Path
) -> None:
    text = block_after("planner")
    assert text.count("\n") < 25
    file = tmp_path / "detours.py"
    file.write_text(text, encoding="utf-8")
    code, out, err = bench("test-planner", f"{file}:Detours", "--time-limit", 1)
    assert code == 0, out + err
    code, out, err = bench(
        *("run", "--env", "c3d", "--planners", "detours", "--planner-file", file),
        *("--problems", 3, "--stop", "first", "--out", tmp_path / "run"),
    )
    assert code == 0, err
    assert pd.read_csv(tmp_path / "run" / "summary.csv")["solved"].tolist() == [3]
    code, out, err = bench(
        *("replay", tmp_path / "run", "--planner", "detours", "--problem", 2),
        *("--planner-file", file),
    )
    assert code == 0, out + err


def test_the_planner_can_be_in_a_package(tmp_path: Path) -> None:
    text = block_after("planner") + block_after("packaged planner")
    plugins.install(
        tmp_path, "my_planners", text, points_of(block_after("entry points of planners"))
    )
    assert "random detours" in carry_out("bench list planners", tmp_path, tmp_path)


@pytest.mark.slow
def test_the_environment_is_found_and_planned_in_once_it_is_installed(tmp_path: Path) -> None:
    points = points_of(block_after("entry points"))
    site = tmp_path / "site"
    site.mkdir()
    plugins.install(site, "slalom", block_after("environment"), points)
    carry_out(block_after("environment commands"), tmp_path, site)
    assert (tmp_path / "slalom.png").stat().st_size > 0
    summary = pd.read_csv(tmp_path / "results" / "runs" / "slalom" / "summary.csv")
    assert summary["env"].tolist() == ["slalom:walls=5"]
    assert summary["solved"].tolist() == [3]


def test_bars_lie_where_their_clearance_says(tmp_path: Path) -> None:
    file = tmp_path / "bars.py"
    file.write_text(block_after("environment of bars"), encoding="utf-8")
    env = load_class(f"{file}:Bars")(bars=4)
    q = env.space.sample(np.random.default_rng(0), 300)
    model = env.collision_model()
    assert [model.is_valid(one) for one in q] == (env.clearance(q) > 0).tolist()
    assert len(env.sample_problems(3, seed=0)) == 3


@pytest.mark.slow
def test_robots_that_a_package_announces_have_names(tmp_path: Path) -> None:
    site = tmp_path / "site"
    site.mkdir()
    text, points = block_after("named robots"), block_after("entry points of robots")
    assert text.count("\n") <= 10
    plugins.install(site, "lab_robots", text, points_of(points))
    [robot] = blocks("xml")
    (site / "two_joints.urdf").write_text(robot, encoding="utf-8")
    printed = carry_out(block_after("commands of named robots"), tmp_path, site)
    assert "shoulder and elbow, 2 joints, lab_robots" in printed
    assert (tmp_path / "two_joints.png").stat().st_size > 0


@pytest.mark.slow(minutes=1)
def test_robots_by_name_are_drawn_and_planned_for(tmp_path: Path) -> None:
    if example_robot_data.robots()[0].missing:
        pytest.skip('example-robot-data is not installed: pip install "plannerbench[robots]"')
    [scene] = blocks("yaml")
    (tmp_path / "my_scene.yaml").write_text(scene, encoding="utf-8")
    trimesh.creation.box((200, 50, 300)).export(tmp_path / "shelf.ply")
    assert "panda" in carry_out(block_after("robots by name"), tmp_path, tmp_path)
    assert (tmp_path / "panda.png").stat().st_size > 0
    [summary] = tmp_path.glob("results/runs/*/summary.csv")
    assert pd.read_csv(summary)["solved"].tolist() == [5]
