"""robometrics' sets, by small files of the same form."""

from __future__ import annotations

import json
import logging
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import robometrics_files as made
from conftest import Cli, has_data, records_of
from documents import block_after

import envs
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import InputError
from envs.collision.shapes import Box, Cylinder, Sphere
from envs.environment import Environment
from envs.errors import tell_once
from envs.files.robometrics_file import read_robometrics
from envs.scenes import robometrics
from envs.scenes.arm_world import ArmWorld
from envs.scenes.robometrics_scenes import SCENES

AHEAD, LEFT, RIGHT = [0.0] * 7, [0.5, *[0.0] * 6], [-0.5, *[0.0] * 6]
BENT = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """One of its own, and nothing said before."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    tell_once.cache_clear()
    yield tmp_path / "cache"


def make(file: Path, **more: Any) -> Environment:
    arguments = {"file": file, "urdf": file.parent / "panda.urdf", **more}
    return envs.make("robometrics:" + ",".join(f"{k}={v}" for k, v in arguments.items()))


SETS = {
    "box_panda": [made.problem([LEFT, RIGHT]), made.problem([BENT], made.obstacles(a=(0.3, 0.5)))],
    "cage_panda": [made.problem([RIGHT], made.obstacles(b=(0.3, 0.5), c=(0.3, -0.6)))],
}


def test_problems_are_those_of_the_file_in_their_scenes(tmp_path: Path) -> None:
    env = make(made.write(tmp_path, SETS))
    problems = env.sample_problems(3, 0)
    assert [problem.index for problem in problems] == [0, 1, 2]
    assert problems[0].goals is not None
    assert problems[0].goals.tolist() == [LEFT, RIGHT]
    assert problems[1].goals is None
    assert problems[1].goal.tolist() == BENT
    assert problems[1].start.tolist() == AHEAD
    scenes = [env.scene_of(problem) for problem in problems]
    assert [list(scene.obstacle_names) for scene in scenes] == [
        [],
        ["obstacle 'a'"],
        ["obstacle 'b'", "obstacle 'c'"],
    ]
    assert env.problem_count == 3
    assert env.problem_statistics(3, 0) == {}
    assert len({env.fingerprint, *(scene.fingerprint for scene in scenes)}) == 4
    with pytest.raises(InputError, match=r"robometrics: mb_set.yaml has 3 problems, not 4"):
        env.sample_problems(4, 0)


def test_a_scene_has_its_problems_alone(tmp_path: Path) -> None:
    env = make(made.write(tmp_path, SETS), scene="cage_panda")
    [problem] = env.sample_problems(1, 0)
    assert (problem.index, problem.goal.tolist()) == (0, RIGHT)
    assert len(env.scene_of(problem).obstacles) == 2
    assert env.fingerprint != make(tmp_path / "mb_set.yaml", scene="box_panda").fingerprint


def test_a_problems_scene_alone_has_problems_of_its_own(tmp_path: Path) -> None:
    file = made.write(tmp_path, SETS)
    env = make(file, scene="box_panda", problem=1)
    assert not env.scenes_differ
    assert list(env.obstacle_names) == ["obstacle 'a'"]
    problems = env.sample_problems(2, 0)
    assert (env.clearance(np.array([p.start for p in problems])) >= 0.02).all()


def test_obstacles_are_in_full_lengths_and_quaternions_begin_with_w(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    turned = [0.1, 0.2, 0.3, half, 0, 0, half]  # a quarter about z
    among = {
        "cuboid": {"plate": {"dims": [1, 2, 3], "pose": turned}},
        "cylinder": {"can": {"height": 0.4, "radius": 0.1, "pose": made.pose(1, 0)}},
        "sphere": {"ball": {"radius": 0.2, "pose": made.pose(2, 0)}},
    }
    file = made.write(tmp_path, {"box_panda": [made.problem([LEFT], among)]})
    [problem] = read_robometrics(file).problems("box_panda", 7)
    plate, can, ball = problem.obstacles
    assert isinstance(plate.solid, Box)
    assert plate.solid.sides.tolist() == [1, 2, 3]
    assert plate.pose[:3, 3].tolist() == [0.1, 0.2, 0.3]
    assert plate.pose[:3, 0].round(9).tolist() == [0, 1, 0]
    assert can.solid == Cylinder(0.1, 0.4)
    assert ball.solid == Sphere(0.2)


def test_joints_are_told_by_their_names_and_fingers_stand_as_the_set_has_them(
    tmp_path: Path,
) -> None:
    file = made.write(tmp_path, {"any": [made.problem([BENT])]})
    for name, opening in (("mb", 0.04), ("mpinets", 0.025)):
        env = make(file, set=name)
        finger = list(env.shape_names).index("link 'panda_finger'")
        assert env.robot.poses(np.zeros(7))[finger][:, 3] == pytest.approx([0.85, opening, 0])
    (tmp_path / "backward.urdf").write_text(made.urdf(backward=True))
    [problem] = make(file, urdf=tmp_path / "backward.urdf").sample_problems(1, 0)
    assert problem.goal.tolist() == BENT[::-1]


def test_obstacles_are_in_the_frame_of_the_link_that_is_the_worlds(tmp_path: Path) -> None:
    near = made.obstacles(a=(0.3, 0.5, 0.2))
    file = made.write(tmp_path, {"any": [made.problem([BENT], near)]})
    (tmp_path / "on_table.urdf").write_text(made.urdf(on_table=True))
    env = make(file, urdf=tmp_path / "on_table.urdf")
    [problem] = env.sample_problems(1, 0)
    assert env.scene_of(problem).obstacles[0].pose[:3, 3].tolist() == [0.3, 0.5, 1.2]
    without = {**made.problem([BENT], near), "world_frame": ""}
    env = make(made.write(tmp_path, {"any": [without]}))
    [problem] = env.sample_problems(1, 0)
    assert env.scene_of(problem).obstacles[0].pose[:3, 3].tolist() == [0.3, 0.5, 0.2]


def test_problems_without_goals_are_left_out_and_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    without = made.problem([], collision_buffer_ik=-0.01)
    file = made.write(
        tmp_path, {"box_panda": [made.problem([LEFT]), without, without, made.problem([RIGHT])]}
    )
    with caplog.at_level(logging.INFO):
        env = make(file)
    [line] = [record.message for record in caplog.records if "goal_ik" in record.message]
    assert line.endswith("problems of mb_set.yaml without goals (goal_ik) are left out: 1, 2")
    assert [problem.index for problem in env.sample_problems(2, 0)] == [0, 3]
    assert env.problem_statistics(2, 0) == {
        "problems_without_goals": 2,
        "negative_collision_buffers": 2,
    }
    with pytest.raises(InputError, match="has no problem 1"):
        env.problems_at([1], 0)
    with pytest.raises(InputError, match=r"robometrics: mb_set.yaml has no problem 1 with goals"):
        make(file, problem=1)
    alone = made.write(tmp_path, {"box_panda": [without]})
    with pytest.raises(InputError, match=r"no problem of mb_set.yaml has a goal_ik"):
        make(alone)


def test_a_path_may_end_in_any_goal_of_which_those_in_contact_are_said(
    tmp_path: Path, bench: Cli
) -> None:
    """A cube is where the first goal is."""
    among = made.obstacles(cube=(0.6, 0.3))
    file = made.write(tmp_path, {"box_panda": [made.problem([LEFT, RIGHT], among)]})
    env = make(file)
    [problem] = env.sample_problems(1, 0)
    judge = Judge(env)
    assert judge(problem, np.array([AHEAD, RIGHT])).verdict is Verdict.VALID
    assert judge(problem, np.array([AHEAD, LEFT])).verdict is Verdict.COLLISION
    assert judge(problem, np.array([AHEAD, BENT])).verdict is Verdict.WRONG_ENDPOINT
    text = f"robometrics:file={file},urdf={tmp_path / 'panda.urdf'}"
    code, out, _ = bench("problems", "--env", text, "--json")
    assert code == 0
    [found] = json.loads(out)
    assert (found["problems"], found["valid"]) == (1, 1)
    [end] = found["invalid"]
    assert end["end"] == "goal 1"
    assert "obstacle 'cube'" in end["reason"]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_run_plans_to_any_goal(bench: Cli, tmp_path: Path) -> None:
    file = made.write(tmp_path, SETS)
    text = f"robometrics:file={file},urdf={tmp_path / 'panda.urdf'}"
    run = ("run", "--env", text, "--planners", "rrtconnect", "--stop", "first")
    code, _, err = bench(*run, "--out", tmp_path / "run")
    assert code == 0, err
    rows = records_of(tmp_path / "run")
    assert rows["outcome"].tolist() == ["VALID"] * 3


def test_what_was_parsed_is_kept_and_what_changes_is_read_again(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from envs.files import robometrics_file

    file = made.write(tmp_path, SETS)
    before = make(file).fingerprint
    [kept] = (cache / "plannerbench" / "problems").iterdir()
    robometrics_file._scenes.cache_clear()
    with monkeypatch.context() as patched:
        patched.setattr(robometrics_file, "parsed_yaml", None)  # is not asked again
        assert make(file).fingerprint == before
    kept.write_text("[]")  # is none
    robometrics_file._scenes.cache_clear()
    assert make(file).fingerprint == before
    made.write(tmp_path, {**SETS, "cage_panda": [made.problem([LEFT])]})
    assert make(file).fingerprint != before


def test_the_file_is_sought_where_the_data_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCH_DATA", str(tmp_path))
    robot = f"urdf={tmp_path / 'robometrics' / 'panda.urdf'}"
    with pytest.raises(InputError, match=r"file=mb_set.yaml is needed.*Git LFS"):
        envs.make(f"robometrics:urdf={made.write(tmp_path, {}).parent / 'panda.urdf'}")
    made.write(tmp_path / "robometrics", SETS)
    assert envs.make(f"robometrics:{robot}").problem_count == 3
    assert envs.make(f"robometrics-mb-box:{robot}").problem_count == 2


def test_groups_have_the_scenes_of_a_set() -> None:
    for name, scenes in SCENES.items():
        ids = [entry.id for entry in envs.REGISTRY.entries(f"robometrics-{name}")]
        assert len(ids) == len(scenes)
    assert "robometrics-mb-box-panda-flipped" not in ids
    assert "robometrics-mpinets-merged-cubby-task-oriented" in ids


LFS = "version https://git-lfs.github.com/spec/v1\noid sha256:37d8\nsize 2895799\n"

BAD_FILES = {
    "pointer": (LFS, "it is a pointer to a file in Git LFS; get that by `git lfs pull`"),
    "empty": ("", "its content must be a mapping"),
    "rubbish": (b"\x80\x04\x95\xff\x00\xfe", "not YAML"),
    "list": ("[1]", "its content must be a mapping"),
    "truncated": ("box_panda: [{start: [0", "not YAML"),
    "a huge name": ("? 0x" + "f" * 5000 + "\n: 3", "scene int with too many digits must be a list"),
    "deep": ("[" * 100_000, "not YAML"),
    "odd scalar": ("box_panda: !!timestamp 1", "not YAML"),
    "overflow": ("box_panda: " + ":".join(["1"] * 300) + ".5", "not YAML"),
    "twice": ("a: []\na: []", "'a' is given twice"),
    "merged": ("a: &a {b: 1}\nc: {<<: *a}", "'<<' in the mapping at line 2"),
    "no problems": ("box_panda: []", "it has no problems"),
    "no list": ("box_panda: {}", "scene 'box_panda' must be a list"),
    "no mapping": ("box_panda: [1]", "box_panda, problem 0: a problem must be a mapping"),
}


def refusal(file: Path, **more: Any) -> str:
    with pytest.raises(InputError) as caught:
        make(file, **more)
    said = str(caught.value)
    assert "\n" not in said
    return said


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, said = BAD_FILES[name]
    file = made.write(tmp_path, {})
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    message = refusal(file)
    assert said in message
    assert message.startswith(str(file))


def cuboid(**more: Any) -> dict[str, Any]:
    return {"obstacles": {"cuboid": {"a": {"dims": [1, 1, 1], "pose": made.pose(1, 1), **more}}}}


def cylinder(**more: Any) -> dict[str, Any]:
    can = {"height": 1, "radius": 1, "pose": made.pose(1, 1), **more}
    return {"obstacles": {"cylinder": {"a": can}}}


BAD_PROBLEMS = {
    "no start": ({"start": None}, "start must be a list"),
    "short start": ({"start": [0] * 6}, "start must be 7 numbers, not 6"),
    "fingers too": ({"start": [0] * 9}, "start must be 7 numbers, not 9"),
    "word": ({"start": ["a", *[0] * 6]}, "start must be a number"),
    "NaN": ({"start": [float("nan"), *[0] * 6]}, "start must be a number"),
    "huge": ({"start": [1e300, *[0] * 6]}, "start must be a number of at most 1e+06"),
    "truth": ({"start": [True, *[0] * 6]}, "start must be a number"),
    "goals of numbers": ({"goal_ik": [0] * 7}, "a goal_ik must be a list"),
    "short goal": ({"goal_ik": [AHEAD, [0]]}, "a goal_ik must be 7 numbers, not 1"),
    "infinite goal": ({"goal_ik": [[float("inf"), *[0] * 6]]}, "a goal_ik must be a number"),
    "no mapping": ({"obstacles": []}, "obstacles must be a mapping"),
    "kind": (
        {"obstacles": {"cubiod": {}}},
        "obstacles are no 'cubiod' here; did you mean 'cuboid'",
    ),
    "mesh": (
        {"obstacles": {"mesh": {"a": {}}}},
        "obstacles are no 'mesh' here; choose from: cuboid",
    ),
    "list": ({"obstacles": {"cuboid": [1]}}, "cuboid must be a mapping"),
    "number": ({"obstacles": {"cuboid": {"a": 1}}}, "cuboid 'a' must be a mapping"),
    "no dims": (cuboid(dims=None), "dims of cuboid 'a' must be a list"),
    "two dims": (cuboid(dims=[1, 1]), "dims of cuboid 'a' must be 3 numbers, not 2"),
    "flat": (cuboid(dims=[1, 0, 1]), "dims of cuboid 'a' must be above 0"),
    "no pose": (cuboid(pose=None), "pose of cuboid 'a' must be a list"),
    "short pose": (cuboid(pose=[0] * 6), "pose of cuboid 'a' must be 7 numbers, not 6"),
    "no turn": (cuboid(pose=[0] * 7), "the end of pose of cuboid 'a' is a quaternion, and not 0"),
    "no height": (cylinder(height=None), "height of cylinder 'a' must be a number"),
    "no radius": (cylinder(radius=-1), "radius of cylinder 'a' must be above 0, not -1"),
    "number as frame": ({"world_frame": 3}, "world_frame must be the name of a link"),
    "buffer": ({"collision_buffer_ik": "a"}, "collision_buffer_ik must be a number"),
}


@pytest.mark.parametrize("name", BAD_PROBLEMS)
def test_bad_problems_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    change, said = BAD_PROBLEMS[name]
    bad = {**made.problem([LEFT]), **change}
    message = refusal(made.write(tmp_path, {"box_panda": [made.problem([LEFT]), bad]}))
    assert f"box_panda, problem 1: {said}" in message


@pytest.mark.parametrize("key", ["start", "goal_ik", "obstacles"])
def test_what_each_problem_has_is_asked_for(key: str, tmp_path: Path) -> None:
    bad = made.problem([LEFT])
    del bad[key]
    assert f"problem 0: it has no {key}" in refusal(made.write(tmp_path, {"a": [bad]}))


def test_what_is_not_there_is_said_in_a_line(tmp_path: Path) -> None:
    file = made.write(tmp_path, SETS)
    assert "no set is called 'mbm'; did you mean 'mb'" in refusal(file, set="mbm")
    assert "no scene is called 'boks_panda'; did you mean 'box_panda'" in refusal(
        file, scene="boks_panda"
    )
    assert "no such file" in refusal(tmp_path / "none.yaml", urdf=tmp_path / "panda.urdf")
    assert "has no problem 9" in refusal(file, problem=9)
    assert "give one of them" in refusal(file, robot="panda")
    assert "has scenes of the set 'mb'; say set=mb" in refusal(file, set="mpinets")
    (tmp_path / "other.urdf").write_text(made.urdf().replace("panda_joint7", "wrist"))
    assert "'panda_joint7'" in refusal(file, urdf=tmp_path / "other.urdf")
    (tmp_path / "empty.urdf").write_text("")
    assert str(tmp_path / "empty.urdf") in refusal(file, urdf=tmp_path / "empty.urdf")
    odd = made.write(tmp_path, {"a": [made.problem([LEFT], world_frame="panda_link9")]})
    assert "'panda_link9' is no link that stands still; did you mean 'panda_link0'" in refusal(odd)


@pytest.mark.slow
def test_the_default_robot_is_motion_bench_makers(tmp_path: Path) -> None:
    if not has_data("mbm/panda/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    ready = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
    posed = made.problem([[0.5, *ready[1:]]], made.obstacles(a=(0, 0.9, 0.3)), start=ready)
    env = envs.make(f"robometrics:file={made.write(tmp_path, {'box_panda': [posed]})}")
    assert isinstance(env, ArmWorld)
    [problem] = env.sample_problems(1, 0)
    straight = np.array([problem.start, problem.goal])
    assert Judge(env)(problem, straight).verdict is Verdict.VALID
    assert "panda_hand" in env.robot.links


def test_commands_of_the_documentation_name_environments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes = {**SETS, "box_panda": [made.problem([LEFT])] * 8}
    made.write(tmp_path, scenes)
    made.write(tmp_path, {"dresser_task_oriented": [made.problem([LEFT])]}, "mpinets_set.yaml")
    (tmp_path / "panda.srdf").write_text('<robot name="p"/>')
    monkeypatch.setattr(robometrics, "robot_folder", lambda name: tmp_path)
    monkeypatch.chdir(tmp_path)
    counts = []
    for line in block_after("robometrics").splitlines():
        words = shlex.split(line)
        entries = envs.REGISTRY.entries(words[words.index("--env") + 1])
        counts += [entry.make().problem_count for entry in entries]
    assert counts == [9, 1, 8, 1, None]
