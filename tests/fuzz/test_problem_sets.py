"""Scenes, requests and problems that others have made."""

from __future__ import annotations

import bz2
import json
import random
from collections.abc import Callable, Sequence
from pathlib import Path

import mbm_files
import numpy as np
import pytest
import robometrics_files
import yaml
from fuzzing import flipped, fuzzed
from hypothesis import strategies as st
from mutations import contents

from bench.storage.problem_file import GivenProblems
from envs.collision.shapes import PlacedShape
from envs.files.moveit_request import MotionRequest, read_motion_request
from envs.files.moveit_text import read_scene_text
from envs.files.moveit_yaml import read_planning_scene
from envs.files.planning_scene import PlanningScene
from envs.files.problem_archive import ProblemFiles, read_problem_files
from envs.files.robometrics_file import RobometricsProblem, read_robometrics

MATRIX = {"entry_names": ["a", "wall"], "entry_values": [[True, False], [False, True]]}
FRAMES = [
    {
        "child_frame_id": "corner",
        "transform": {"translation": [1, 2, 3], "rotation": [0, 0, 0, 1]},
    }
]
WALL = mbm_files.box("wall", mbm_files.pose(-0.6, 0), 0.1, 0.4, 1)
CAN = {
    "id": "can",
    "header": {"frame_id": "corner"},
    "pose": mbm_files.pose(0, 1),
    "primitives": [
        {"type": "cylinder", "dimensions": [0.4, 0.1]},
        {"type": "sphere", "dimensions": [0.1]},
        {"type": 4, "dimensions": [0.3, 0.1]},
    ],
    "primitive_poses": [mbm_files.pose(0, 0)] * 3,
}
MESH = {
    "id": "rock",
    "meshes": [
        {
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], {"x": 0, "y": 0, "z": 1}],
            "triangles": [[0, 2, 1], {"vertex_indices": [0, 1, 3]}, [0, 3, 2], [1, 2, 3]],
        }
    ],
    "mesh_poses": [mbm_files.pose(0, 0)],
}
SCENES = (
    yaml.safe_dump(
        mbm_files.scene(WALL, CAN, allowed_collision_matrix=MATRIX, fixed_frame_transforms=FRAMES)
    ),
    json.dumps(mbm_files.scene(MESH, WALL, name="")),
)

TEXTS = (
    """scene
* wall
1
box
0.1 0.4 1
-0.6 0 0
0 0 0 1
0 0 0 0
* ball
1
sphere
0.5
0 0 0
0 0 0 1
1 0 0 1
.
""",
    """(noname)+
* can
0 0 1
0 0 0 1
2
cylinder
0.1 0.4
0 0 0
0 0 0 1
0 0 0 0
cone
0.1 0.4
0 0 0
0 0.6 0 0.8
0 0 0 0
1
top
0 0 1
0 0 0 1
* rock
0 0 0
0 0 0 1
1
mesh
4 4
0 0 0
1 0 0
0 1 0
0 0 1
0 2 1
0 1 3
0 3 2
1 2 3
0 0 0
0 0 0 1
0 0 0 0
0
.
""",
)


def check_placed(obstacles: Sequence[PlacedShape], names: Sequence[str]) -> None:
    assert len(obstacles) == len(names)
    for placed in obstacles:
        turn = placed.pose[:3, :3]
        assert np.isfinite(placed.pose).all()
        assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-9)
        assert placed.definition()


def check_scene(scene: PlanningScene) -> None:
    check_placed(scene.obstacles, scene.names)
    assert all(len(pair) <= 2 for pair in scene.allowed.pairs(["a", "b", "wall"]))


def test_planning_scenes() -> None:
    def parse(text: bytes) -> PlanningScene:
        return read_planning_scene(text, {"base": np.eye(4)})

    fuzzed("planning scenes", contents(SCENES), parse, check_scene)


def test_scenes_in_text() -> None:
    fuzzed("scenes in text", contents(TEXTS), read_scene_text, check_scene)


def test_motion_requests() -> None:
    request = mbm_files.request([0.1, 0.2], [1, 2])
    samples = json.dumps(request), yaml.safe_dump(request)

    def check(found: MotionRequest) -> None:
        assert found.goal
        for values in (found.start, found.goal):
            assert np.isfinite(list(values.values())).all()

    fuzzed("motion requests", contents(samples), read_motion_request, check)


def test_archives_of_problems(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of another content, of which nothing is kept."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    pair = mbm_files.scene(WALL), mbm_files.request([0, 0], [1, 1])
    mbm_files.write(tmp_path / "panda", {"box_panda": [pair] * 2})
    file = tmp_path / "problems.tar.bz2"
    packed = (tmp_path / "panda" / file.name).read_bytes()
    plain = bz2.decompress(packed)  # which tarfile takes as well, and has sums of heads alone

    def parse(content: bytes) -> ProblemFiles:
        file.write_bytes(content)
        return read_problem_files(file, "box_panda")

    def check(found: ProblemFiles) -> None:
        assert all(0 <= number <= 9999 for number in found.numbers)

    def changed(seed: bytes) -> bytes:
        return flipped(seed, random.Random(seed).choice([plain, plain, packed]))

    inputs = [st.binary(min_size=8, max_size=8).map(changed)]
    fuzzed("archives of problems", inputs, parse, check)


def test_problems_of_robometrics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    half = [0.1, 0.2, 0.3, 0.5, 0.5, 0.5, 0.5]
    among = {
        "cuboid": {"a": {"dims": [1, 2, 0.5], "pose": half}},
        "cylinder": {"b": {"height": 0.5, "radius": 0.25, "pose": half}},
    }
    goals = [[0.5, *[0.0] * 6], [-0.25, *[0.5] * 6]]
    content = {"box_panda": [robometrics_files.problem(goals, among)]}
    file = tmp_path / "mb_set.yaml"

    def parse(text: bytes) -> list[RobometricsProblem]:
        file.write_bytes(text)
        found = read_robometrics(file)
        return [one for name in found.scenes for one in found.problems(name, 7)]

    def check(problems: list[RobometricsProblem]) -> None:
        for one in problems:
            check_placed(one.obstacles, one.names)
            assert one.start.shape == (7,)
            assert one.goals.shape[1:] == (7,)
            assert np.isfinite(one.start).all()
            assert np.isfinite(one.goals).all()

    samples = yaml.safe_dump(content), json.dumps(content)
    fuzzed("problems of robometrics", contents(samples), parse, check)


PROBLEMS = (
    '[{"start": [0, 0.5, 0], "goal": [1, 2, 3], "name": "to the shelf"},\n'
    ' {"start": [0, 1e-3, 0], "goals": [[1, 2, 3], [3, 2, 1]]}]\n',
    '{"problems": [{"start": [1.5], "goal": [-2]}]}',
)
POSED = {
    "json": PROBLEMS,
    "yaml": (*PROBLEMS, "problems:\n- {start: [0, 1], goal: [2, 3], name: a}\n- start: [0, 2]\n"
    "  goals:\n  - [1, 2.5]\n  - [3, 4]\n"),
    "csv": (
        "name,start_1,start_2,goal_1,goal_2\na,0,0,1,1.5\na,0,0,2,2\nb,1,0,4,4\n",
        "0,0,1,1e-3\n\n0,0.5,2,2\n",
    ),
}  # fmt: skip


def reader(file: Path) -> Callable[[bytes], GivenProblems]:
    def parse(content: bytes) -> GivenProblems:
        file.write_bytes(content)
        return GivenProblems.read(file)

    return parse


def check_given(given: GivenProblems) -> None:
    assert given.posed
    for one in given.posed:
        assert len(one.goals) > 0
        assert np.isfinite(one.start).all()
        assert np.isfinite(one.goals).all()
        assert one.goals.shape[1] == len(one.start)
    same = GivenProblems.of_data(json.loads(json.dumps(given.data)))
    assert same.digest == given.digest


def test_problems_as_json(tmp_path: Path) -> None:
    parse = reader(tmp_path / "own.json")
    fuzzed("problems as JSON", contents(POSED["json"]), parse, check_given)


def test_problems_as_yaml(tmp_path: Path) -> None:
    parse = reader(tmp_path / "own.yaml")
    fuzzed("problems as YAML", contents(POSED["yaml"]), parse, check_given)


def test_problems_as_csv(tmp_path: Path) -> None:
    parse = reader(tmp_path / "own.csv")
    fuzzed("problems as CSV", contents(POSED["csv"]), parse, check_given)
