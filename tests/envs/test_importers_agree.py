"""Real scenes of MotionBenchMaker's Panda, in the forms of other importers: they are the same."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import has_data
from scipy.spatial.transform import Rotation

import envs
from envs.collision.shapes import Box, Cylinder, Obstacle
from envs.environment import Environment
from envs.files.problem_archive import read_problem_files
from envs.problem import Problem

pytestmark = pytest.mark.slow

NUMBERS = (1, 17, 42)


@pytest.fixture(params=["box", "bookshelf_tall", "table_under_pick"])
def given(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[str, Environment, Sequence[Problem]]:
    """The name of a set, the set, and some of its problems."""
    if not has_data("mbm/panda/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    env = envs.make(f"mbm:robot=panda,set={request.param}")
    return request.param, env, env.problems_at([number - 1 for number in NUMBERS], 0)


def panda() -> Path:
    return Path(os.environ["BENCH_DATA"]) / "mbm" / "panda"


def arm(scene: Path) -> Environment:
    files = f"urdf={panda() / 'panda.urdf'},srdf={panda() / 'panda.srdf'}"
    return envs.make(f"arm:{files},group=panda_arm,scene={scene}")


def definitions(env: Environment) -> list[Any]:
    return [obstacle.definition() for obstacle in env.obstacles]


def test_scenes_of_users_arms_are_those_of_the_set(
    given: tuple[str, Environment, Sequence[Problem]], tmp_path: Path
) -> None:
    name, env, problems = given
    archive = read_problem_files(panda() / "problems.tar.bz2", f"{name}_panda")
    for number, problem in zip(NUMBERS, problems, strict=True):
        (tmp_path / "scene.yaml").write_bytes(archive.text("scene", number))
        theirs, ours = env.scene_of(problem), arm(tmp_path / "scene.yaml")
        assert definitions(ours) == definitions(theirs)
        assert list(ours.obstacle_names) == list(theirs.obstacle_names)
        assert (ours.may_touch is None) == (theirs.may_touch is None)
        if ours.may_touch is not None:
            assert (ours.may_touch == theirs.may_touch).all()
        q = ours.space.sample(np.random.default_rng(number), 40)
        ends = np.array([problem.start, problem.goal])
        model, other = ours.collision_model(), theirs.collision_model()
        assert all(model.is_valid(one) == other.is_valid(one) for one in (*q, *ends))


def numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)


def text_of(name: str, obstacle: Obstacle) -> str:
    """An object as MoveIt writes it, with the pose at the object."""
    solid, pose = obstacle.solid, obstacle.pose
    turn = Rotation.from_matrix(pose[:3, :3]).as_quat()
    if isinstance(solid, Box):
        shape = f"box\n{numbers(solid.sides)}"
    else:
        assert isinstance(solid, Cylinder)
        shape = f"cylinder\n{numbers((solid.radius, solid.length))}"
    placed = f"{numbers(pose[:3, 3])}\n{numbers(turn)}"
    return f"* {name}\n{placed}\n1\n{shape}\n0 0 0\n0 0 0 1\n0 0 0 0\n0\n"


def test_scenes_in_text_say_the_same(
    given: tuple[str, Environment, Sequence[Problem]], tmp_path: Path
) -> None:
    _, env, problems = given
    for problem in problems:
        theirs = env.scene_of(problem)
        objects = [text_of(f"object {n}", one) for n, one in enumerate(theirs.obstacles)]
        file = tmp_path / "scene.scene"
        file.write_text("".join(["(noname)+\n", *objects, ".\n"]))
        for ours, other in zip(arm(file).obstacles, theirs.obstacles, strict=True):
            assert ours.solid.definition() == other.solid.definition()
            assert ours.pose == pytest.approx(other.pose, abs=1e-12)


def posed(env: Environment, problem: Problem) -> dict[str, Any]:
    """A problem as robometrics has it."""
    kinds: dict[str, dict[str, Any]] = {"cuboid": {}, "cylinder": {}}
    for n, one in enumerate(env.scene_of(problem).obstacles):
        x, y, z, w = Rotation.from_matrix(one.pose[:3, :3]).as_quat().tolist()
        entry: dict[str, Any] = {"pose": [*one.pose[:3, 3].tolist(), w, x, y, z]}
        if isinstance(one.solid, Box):
            kinds["cuboid"][f"object {n}"] = {**entry, "dims": one.solid.sides.tolist()}
        else:
            assert isinstance(one.solid, Cylinder)
            sizes = {"radius": one.solid.radius, "height": one.solid.length}
            kinds["cylinder"][f"object {n}"] = {**entry, **sizes}
    return {
        "start": problem.start.tolist(),
        "goal_ik": [problem.goal.tolist()],
        "obstacles": kinds,
        "world_frame": "panda_link0",
    }


def test_problems_of_robometrics_are_the_same_ones(
    given: tuple[str, Environment, Sequence[Problem]], tmp_path: Path
) -> None:
    name, env, problems = given
    file = tmp_path / "mb_set.yaml"
    file.write_text(json.dumps({f"{name}_panda": [posed(env, problem) for problem in problems]}))
    again = envs.make(f"robometrics:file={file}")
    for ours, theirs in zip(again.sample_problems(len(NUMBERS), 0), problems, strict=True):
        assert ours.start.tolist() == theirs.start.tolist()
        assert ours.goal.tolist() == theirs.goal.tolist()
        here, there = again.scene_of(ours), env.scene_of(theirs)
        assert len(here.obstacles) == len(there.obstacles)
        boxes_first = sorted(there.obstacles, key=lambda one: isinstance(one.solid, Cylinder))
        for one, other in zip(here.obstacles, boxes_first, strict=True):
            assert one.solid.definition() == other.solid.definition()
            assert one.pose == pytest.approx(other.pose, abs=1e-12)
        model = here.collision_model()
        assert model.is_valid(ours.start)
        assert model.is_valid(ours.goal)
