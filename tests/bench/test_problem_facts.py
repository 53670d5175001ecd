"""Which problems cannot be solved as they are posed, why, and that runs leave them out."""

from __future__ import annotations

import json
import re
from pathlib import Path

import mbm_files as made
import numpy as np
import pandas as pd
import pytest
from conftest import Cli, has_data, records_of

import bench as package
import envs
from bench.analysis.summary import summarise, why_not_attempted
from bench.judging.judge import Judge
from bench.judging.metrics import REGISTERED
from bench.judging.problem_facts import problem_facts
from bench.storage.record import Verdict
from envs import Environment, Problem
from envs.collision.penetration import penetration_depth
from envs.collision.shapes import Box, Capsule, Mesh, Solid, Sphere

WALL = made.box("wall", made.pose(-0.6, 0), 0.1, 0.4, 1)
NEAR = made.box("near", made.pose(0.5, 0.08), 0.1, 0.1, 0.1)
PAIRS = [
    (made.scene(), made.request([0.0, 0.0], [1.0, -0.5])),
    (made.scene(WALL), made.request([0.0, 0.5], [3.0, 0.0])),  # the goal is in the wall
    (made.scene(), made.request([0.0, 0.0], [3.25, 0.5])),  # a joint's limit is 3
    (made.scene(NEAR), made.request([0.0, 0.0], [-1.0, 0.5])),  # the start is 10 mm from the box
    (made.scene(), made.request([-1.0, 0.0], [1.0, 0.5])),
]
INVALID = {1: "goal", 2: "goal"}


@pytest.fixture
def boxes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Environment:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCH_DATA", str(tmp_path / "data"))
    made.write(tmp_path / "data" / "mbm" / "panda", {"box_panda": PAIRS})
    return envs.make("mbm:robot=panda,set=box")


def placed(x: float, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    pose = np.eye(3, 4)
    pose[:, 3] = x, y, z
    return pose


def cube(side: float) -> Solid:
    return Box([0, 0, 0], [side] * 3).solid


@pytest.mark.parametrize(
    ("one", "other", "at", "depth"),
    [
        (cube(2), cube(2), placed(1.9), 0.1),
        (cube(2), cube(0.5), placed(1.0), 0.25),
        (Sphere(1.0), cube(2), placed(1.7), 0.3),
        (Capsule(0.5, 2.0), cube(2), placed(0, 1.25), 0.25),
        (cube(2), cube(2), placed(2.5), 0.0),
    ],
)
def test_depths_are_those_of_the_deepest_points(
    one: Solid, other: Solid, at: np.ndarray, depth: float
) -> None:
    assert penetration_depth(one, other, placed(0), at) == pytest.approx(depth, abs=0.01)
    assert penetration_depth(other, one, at, placed(0)) == pytest.approx(depth, abs=0.01)


def test_a_mesh_is_as_deep_as_the_box_that_it_is() -> None:
    box = cube(2).triangulate()
    mesh = Mesh(box.vertices, box.faces)
    assert penetration_depth(mesh, cube(2), placed(0), placed(1.9)) == pytest.approx(0.1, abs=1e-6)


def test_ends_are_refused_with_the_reason(boxes: Environment) -> None:
    facts = problem_facts(boxes, boxes.sample_problems(5, 0))
    assert {end.index: end.end for end in facts.invalid_ends} == INVALID
    in_wall, beyond = facts.invalid_ends
    # It goes right through the wall, which is 0.1 m thick.
    assert in_wall.reason == "link 'lower' is 0.05 m deep in obstacle 'wall'"
    assert beyond.reason == "joint 'shoulder' is 0.25 rad beyond its upper limit of 3"
    assert facts.straight_lines[0] == "F"
    assert [facts.straight_lines[number] for number in INVALID] == ["B", "B"]


@pytest.mark.usefixtures("boxes")
def test_a_contact_that_is_allowed_is_no_reason(tmp_path: Path) -> None:
    """The lower arm may touch the wall, and not a board in the same place."""
    may = {"entry_names": ["lower", "wall"], "entry_values": [[False, True], [True, False]]}
    board = {**WALL, "id": "board"}
    pairs = [
        (made.scene(*objects, allowed_collision_matrix=may), PAIRS[1][1])
        for objects in ((WALL,), (WALL, board))
    ]
    made.write(tmp_path / "data" / "mbm" / "panda", {"box_panda": pairs})
    env = envs.make("mbm:robot=panda,set=box")
    [end] = problem_facts(env, env.sample_problems(2, 0)).invalid_ends
    assert end.index == 1
    assert end.reason == "link 'lower' is 0.05 m deep in obstacle 'board'"


def test_what_is_refused_no_path_can_solve(boxes: Environment) -> None:
    """And the rest is solved where the straight line is free."""
    problems = boxes.sample_problems(5, 0)
    facts, judge = problem_facts(boxes, problems), Judge(boxes)
    for problem, letter in zip(problems, facts.straight_lines, strict=True):
        found = judge(problem, np.array([problem.start, problem.goal]))
        assert (found.verdict is Verdict.VALID) == (letter == "F")
        assert letter == "B" or problem.index not in facts.invalid


def test_a_point_in_an_obstacle_and_one_out_of_bounds_are_told(c3d: Environment) -> None:
    inside = Problem(c3d.sample_problems(1, 0)[0].start, c3d.obstacles[3].center, 7)
    outside = Problem(np.array([-11.0, 0, 12]), inside.start, 8)
    in_box, beyond = problem_facts(c3d, [inside, outside]).invalid_ends
    assert (in_box.index, in_box.end) == (7, "goal")
    assert "the robot" in in_box.reason
    assert "obstacle 4 (a box)" in in_box.reason
    assert (beyond.index, beyond.end) == (8, "start")
    assert beyond.reason == (
        "coordinate 1 is 1 units beyond its lower limit of -10; "
        "coordinate 3 is 2 units beyond its upper limit of 10"
    )


@pytest.mark.usefixtures("boxes")
def test_the_census_is_a_table_or_json(bench: Cli) -> None:
    code, out, _ = bench("problems", "--env", "mbm-panda-box")
    assert code == 0
    assert "goal: joint 'shoulder' is 0.25 rad beyond" in out
    code, out, _ = bench("problems", "--env", "mbm-panda-box,c3d", "--problems", 3, "--json")
    assert code == 0
    of_mbm, of_c3d = json.loads(out)
    assert (of_mbm["env"], of_mbm["problems"], of_mbm["valid"]) == ("mbm-panda-box", 3, 1)
    assert [(one["index"], one["end"]) for one in of_mbm["invalid"]] == list(INVALID.items())
    assert of_c3d == {"env": "c3d", "problems": 3, "valid": 3, "invalid": []}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--env", "mbm-panda-bx"), "mbm-panda-box"),
        (("--env", "mbm-panda-box", "--problems", 6), "has 5 problems, not 6"),
        (("--env", "mbm-panda-box", "--problems", 0), "--problems must be between"),
        (("--env", "mbm-panda-box", "--seed", -1), "--seed must be between"),
    ],
)
@pytest.mark.usefixtures("boxes")
def test_what_there_is_not_is_one_line(bench: Cli, options: tuple[object, ...], said: str) -> None:
    code, out, err = bench("problems", *options)
    assert (code, out) == (2, "")
    assert said in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.usefixtures("boxes", "in_process_workers")
def test_runs_leave_invalid_problems_out_unless_told(bench: Cli, tmp_path: Path) -> None:
    options = ("--planners", "rrtconnect", "--stop", "first", "--time-limit", 1)
    run = ("run", "--env", "mbm-panda-box", *options, "--out", tmp_path / "run")
    code, out, _ = bench(*run)  # all of its problems, as none is named
    assert code == 0
    assert "5 problems an environment" in out
    assert re.search(r"\| +problems \| +invalid \|", out)
    rows = records_of(tmp_path / "run").set_index("problem")
    for index, end in INVALID.items():
        assert rows.loc[index, "outcome"] == "INVALID_PROBLEM"
        assert rows.loc[index, "error"].startswith(f"{end}: ")
        assert np.isnan(rows.loc[index, "solve_s"])
    [row] = pd.read_csv(tmp_path / "run" / "summary.csv").to_dict("records")
    counts = row["problems"], row["attempted"], row["solved"], row["invalid_problems"]
    assert counts == (5, 3, 3, 2)
    assert row["success_rate"] == 1
    code, out, _ = bench(*run, "--keep-invalid")
    assert code == 0
    rows = package.load(tmp_path / "run").attempts
    assert len(rows) == 5
    assert "INVALID_PROBLEM" not in set(rows["outcome"])
    [row] = pd.read_csv(tmp_path / "run" / "summary.csv").to_dict("records")
    assert (row["attempted"], row["solved"], row["invalid_problems"]) == (5, 3, 0)
    assert bench(*run)[0] == 0, "what was measured so is still there"
    assert (records_of(tmp_path / "run")["outcome"] == "INVALID_PROBLEM").sum() == 2


@pytest.mark.usefixtures("boxes", "in_process_workers")
def test_environments_have_problems_of_their_own_number(bench: Cli, tmp_path: Path) -> None:
    options = ("--planners", "straight-line", "--out", tmp_path)
    assert bench("run", "--env", "mbm-panda-box,box", *options)[0] == 0
    assert records_of(tmp_path)["env"].value_counts().to_dict() == {"box": 50, "mbm-panda-box": 5}
    run = package.load(tmp_path)
    assert "5 of mbm-panda-box, 50 of box problems" in run.results.caption


@pytest.mark.usefixtures("in_process_workers")
def test_lists_may_leave_numbers_out(boxes: Environment, bench: Cli, tmp_path: Path) -> None:
    """Problems have the numbers of their requests less one: here 2, 4, 6, 8 and 10."""
    assert boxes.problem_count == len(PAIRS)
    made.write(tmp_path / "data" / "mbm" / "panda", {"box_panda": PAIRS}, first=3)
    run = ("run", "--env", "mbm-panda-box", "--planners", "straight-line,rrtconnect")
    out = tmp_path / "run"
    assert bench(*run, "--stop", "first", "--time-limit", 1, "--out", out)[0] == 0
    rows = records_of(out)
    straight = rows[rows["planner"] == "straight-line"].set_index("problem")
    assert straight.index.tolist() == [2, 4, 6, 8, 10]
    assert straight.loc[[4, 6], "outcome"].tolist() == ["INVALID_PROBLEM"] * 2
    summary = pd.read_csv(out / "summary.csv").set_index("planner").loc["straight-line"]
    blocked = (straight["outcome"] != "VALID").sum() - 2
    assert (summary["blocked_attempted"], summary["blocked_solved"]) == (blocked, 0)
    told = bench("replay", out, "--planner", "rrtconnect", "--problem", 10)
    assert told[0] == 0, told
    assert bench("report", out, "--format", "html")[0] == 0
    assert bench(*run[:3], "--planners", "straight-line", "--problems", 6)[0] == 2


def test_a_planner_of_invalid_problems_alone_has_no_rate() -> None:
    row = {"status": "INVALID_PROBLEM", "error": "goal: somewhere"}
    assert why_not_attempted(pd.DataFrame([row, {"status": "TIMEOUT", "error": ""}])) is None
    said = why_not_attempted(pd.DataFrame([row, row]))
    assert said is not None
    assert "no problem is valid as posed" in said
    left_out = {"status": "UNSUPPORTED", "error": "no joints"}
    assert why_not_attempted(pd.DataFrame([row, left_out])) == "no joints"
    assert summarise(pd.DataFrame(columns=["env", "planner"]), [], tuple(REGISTERED)).empty


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "valid"), [("panda", 490), ("ur5", 490), ("fetch", 481)])
def test_the_census_of_the_real_sets(bench: Cli, robot: str, valid: int) -> None:
    """Of the first 70 problems of each set, by an independent check of all: those of Fetch whose
    head touches its upper arm, or shoulder its torso, are invalid."""
    if not has_data(f"mbm/{robot}/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    code, out, _ = bench("problems", "--env", f"mbm-{robot}", "--json")
    assert code == 0
    census = json.loads(out)
    assert sum(one["problems"] for one in census) == 490
    assert sum(one["valid"] for one in census) == valid
    for end in (end for one in census for end in one["invalid"]):
        assert "'head_pan_link'" in end["reason"] or "'torso_lift_link" in end["reason"]
