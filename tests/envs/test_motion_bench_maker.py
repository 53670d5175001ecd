"""MotionBenchMaker's sets, by small files of the same form and by the real ones where they are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mbm_files as made
import numpy as np
import pytest
from conftest import Cli, has_data, records_of

import envs
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import InputError
from envs.errors import UnknownNameError
from envs.files.problem_archive import read_problem_files
from envs.scenes.motion_bench_maker import MotionBenchMaker
from envs.scenes.motion_bench_maker_sets import SETS

WALL, POST = (
    made.box("wall", made.pose(-0.6, 0), 0.1, 0.4, 1),
    made.box("post", made.pose(0, 0.6), 0.1, 0.1, 1),
)
BLOCK = made.box("block", made.pose(0, -0.6), 0.1, 0.1, 1)
PAIRS = [
    (made.scene(), made.request([0.0, 0.0], [1.0, -0.5])),
    (made.scene(WALL), made.request([0.0, 0.5], [-2.5, 4.0])),
    (made.scene(POST, BLOCK), made.request([3.000005, 0.5], [-2.0, 0.0])),
]


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with files of a robot, and a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCH_DATA", str(tmp_path / "data"))
    made.write(tmp_path / "data" / "mbm" / "panda", {"box_panda": PAIRS})
    yield tmp_path / "data" / "mbm" / "panda"


def boxes() -> MotionBenchMaker:
    env = envs.make("mbm:robot=panda,set=box")
    assert isinstance(env, MotionBenchMaker)
    return env


@pytest.mark.usefixtures("data")
def test_problems_are_the_requests_in_their_scenes() -> None:
    env = boxes()
    problems = env.sample_problems(3, 0)
    assert [problem.index for problem in problems] == [0, 1, 2]
    assert problems[0].goal.tolist() == [1.0, -0.5]
    assert problems[1].goal == pytest.approx([-2.5, 4.0 - 2 * np.pi]), "wraps"
    assert problems[2].start[0] == 3.0, "beyond its limit by rounding"
    assert [len(env.scene_of(problem).obstacles) for problem in problems] == [0, 1, 2]
    names = list(env.scene_of(problems[2]).obstacle_names)
    assert names == ["obstacle 'post'", "obstacle 'block'"]
    assert env.scene_of(problems[2]).robot is env.scene_of(problems[1]).robot
    for a, b in zip(problems, env.sample_problems(2, 5), strict=False):
        assert a.start.tolist() == b.start.tolist()
        assert a.seed != b.seed
    with pytest.raises(InputError, match="box_panda has 3 problems, not 4"):
        env.sample_problems(4, 0)


@pytest.mark.usefixtures("data")
def test_other_joints_stand_as_in_the_request_and_links_may_touch_as_told() -> None:
    env = boxes()
    finger = env.robot.links.index("finger")
    [pose] = env.robot.poses(np.zeros(2))[[finger]]
    assert pose[:, 3] == pytest.approx([1.05, 0, 0])
    lower = env.robot.links.index("lower")
    assert (finger, lower) not in env.robot.pairs
    assert (lower, finger) not in env.robot.pairs


def matrix(*pairs: tuple[str, str], **more: Any) -> dict[str, Any]:
    """In which these may touch, and no others that are named."""
    names = sorted({name for pair in pairs for name in pair})
    values = [[(a, b) in pairs or (b, a) in pairs for b in names] for a in names]
    return {"entry_names": names, "entry_values": values, **more}


def test_links_may_touch_objects_that_the_scenes_matrix_names(data: Path) -> None:
    """The lower arm goes through the wall; the upper one must not."""
    may = [
        matrix(("lower", "wall"), ("finger", "wall"), ("lower", "nothing"), ("finger", "lower")),
        matrix(("lower", "wall"), ("finger", "wall"), ("upper", "wall")),
        matrix(default_entry_names=["wall"], default_entry_values=[True]),
        matrix(("lower", "post")),
    ]
    objects = made.box("wall", made.pose(-0.5, 0), 0.1, 0.4, 1), POST
    scenes = [made.scene(*objects, allowed_collision_matrix=one) for one in may]
    request = made.request([2.5, 1.5], [2.5, -1.5])
    made.write(data, {"box_panda": [(one, request) for one in (made.scene(*objects), *scenes)]})
    env = boxes()
    problems = env.sample_problems(5, 0)
    judge, verdicts = Judge(env), []
    for problem in problems:
        path = np.array([problem.start, problem.goal])
        found = judge.with_contact(judge(problem, path), problem, path)
        verdicts.append(found.verdict.value)
        world = env.scene_of(problem)
        assert found.contact is None or "wall" in str(found.contact)
        assert world.collision_model().segment_is_free(*path) == (found.verdict is Verdict.VALID)
    assert verdicts == ["COLLISION", "VALID", "VALID", "VALID", "COLLISION"]
    without, lower, both, default, other = (env.scene_of(problem) for problem in problems)
    assert without.may_touch is None
    into = np.array([2.9, 0.1])  # the upper arm comes to the wall as well
    valid = [one.collision_model().is_valid(into) for one in (without, lower, both, default, other)]
    assert valid == [False, False, True, True, False]
    assert lower.robot is not both.robot, "other links may touch"
    assert both.robot is without.robot
    assert len({one.fingerprint for one in (without, lower, both, other)}) == 4
    alone = envs.make("mbm:robot=panda,set=box,scene=2")
    assert alone.may_touch is not None
    assert lower.may_touch is not None
    assert (alone.may_touch == lower.may_touch).all()


def test_a_name_of_a_link_and_an_object_is_the_links(data: Path) -> None:
    block = {**BLOCK, "id": "upper"}
    may = matrix(("lower", "upper"), ("finger", "block"))
    scene = made.scene(block, allowed_collision_matrix=may)
    made.write(data, {"box_panda": [(scene, made.request([0, 0], [1, 1]))]})
    env = envs.make("mbm:robot=panda,set=box,scene=1")
    assert env.may_touch is None


@pytest.mark.usefixtures("data")
def test_a_scene_alone_has_problems_of_its_own() -> None:
    env = envs.make("mbm:robot=panda,set=box,scene=3")
    assert not env.scenes_differ
    assert len(env.obstacles) == 2
    problems = env.sample_problems(3, 0)
    assert all(env.clearance(np.array([p.start, p.goal])).min() >= 0.02 for p in problems)
    assert env.fingerprint != boxes().fingerprint


def test_what_changes_a_problem_changes_the_fingerprint(data: Path) -> None:
    before = boxes().fingerprint
    assert boxes().fingerprint == before
    made.write(data, {"box_panda": [*PAIRS[:2], (made.scene(WALL), PAIRS[2][1])]})
    assert boxes().fingerprint != before


def test_archives_are_unpacked_once(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    archive = data / "problems.tar.bz2"
    first = read_problem_files(archive, "box_panda")
    from envs.files import problem_archive

    problem_archive._read.cache_clear()
    monkeypatch.setattr(problem_archive, "_of_archive", None)  # is not asked again
    again = read_problem_files(archive, "box_panda")
    assert again.digest == first.digest
    assert again.numbers == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mbm:robot=pander", "no robot is called 'pander'; did you mean 'panda'"),
        ("mbm:robot=panda,set=boks", "panda has no set 'boks'; did you mean 'box'"),
        ("mbm:robot=panda,set=cage", "unknown set"),
        ("mbm:robot=panda,set=box,scene=9", "there is no scene0009.yaml"),
    ],
)
@pytest.mark.usefixtures("data")
def test_what_is_not_there_is_said_in_a_line(text: str, said: str) -> None:
    with pytest.raises((InputError, UnknownNameError)) as caught:
        envs.make(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_request_of_another_group_and_a_damaged_archive_are_named(data: Path) -> None:
    less = made.request([0, 0], [1])
    made.write(data, {"box_panda": [PAIRS[0], (made.scene(), less)]})
    with pytest.raises(
        InputError, match=r"request0002.yaml: its goal does not say where .*'elbow'"
    ):
        boxes().sample_problems(2, 0)
    elsewhere = made.request([0, 0], [1, 1], grip=0.01)
    made.write(data, {"box_panda": [PAIRS[0], (made.scene(), elsewhere)]})
    with pytest.raises(InputError, match=r"request0002.yaml: joint 'grip' stands elsewhere"):
        boxes().sample_problems(2, 0)
    other = {**PAIRS[0][1], "group_name": "hand"}
    made.write(data, {"box_panda": [(made.scene(), other)]})
    with pytest.raises(InputError, match="group 'hand'"):
        boxes()
    (data / "problems.tar.bz2").write_bytes(b"BZh9 and no more")
    with pytest.raises(InputError, match="no archive of problems, or is damaged"):
        boxes()


@pytest.mark.slow
@pytest.mark.usefixtures("data", "in_process_workers")
def test_a_run_plans_and_judges_each_problem_in_its_scene(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "mbm-panda-box", "--planners", "rrtconnect", "--stop", "first")
    code, out, _ = bench(*run, "--problems", 3, "--out", tmp_path / "run")
    assert code == 0, out
    rows = records_of(tmp_path / "run")
    assert rows["outcome"].tolist() == ["VALID"] * 3
    assert rows["scene_s"].notna().all()


def test_groups_have_the_sets_of_a_robot() -> None:
    for robot, names in SETS.items():
        ids = [entry.id for entry in envs.REGISTRY.entries(f"mbm-{robot}")]
        assert ids == [f"mbm-{robot}-{name.replace('_', '-')}" for name in names]


@pytest.mark.slow
def test_real_problems_of_panda_are_valid_as_others_find_them() -> None:
    """By Pinocchio and coal all are."""
    if not has_data("mbm/panda/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    for name in SETS["panda"]:
        env = envs.make(f"mbm:robot=panda,set={name}")
        for problem in env.sample_problems(10, 0):
            model = env.scene_of(problem).collision_model()
            assert model.is_valid(problem.start), (name, problem.index)
            assert model.is_valid(problem.goal), (name, problem.index)
            assert env.contains(np.array([problem.start, problem.goal])).all()
