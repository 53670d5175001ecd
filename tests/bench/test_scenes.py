"""Problems that have scenes of their own: planned, judged, drawn and made again in them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import many_scenes
import numpy as np
import pandas as pd
import pytest
from conftest import Cli, records_of
from many_scenes import SCENES

import bench as package
import envs
import planners
from bench.analysis.run_results import RunResults
from bench.judging.judge import Judge
from bench.judging.problem_facts import problem_facts
from bench.report.html.problems import columns, problem_sets_of, problems_data
from bench.storage.record import Verdict
from envs import Environment, Problem, Spec
from planners import Budget, Planner, PlannerResult, Status

TESTS = Path(many_scenes.__file__).parent


@pytest.fixture(autouse=True)
def many(monkeypatch: pytest.MonkeyPatch) -> Iterator[Environment]:
    """Known by name, here and in processes."""
    monkeypatch.setenv("PYTHONPATH", f"{TESTS}:{Path(package.__file__).parents[1]}")
    envs.REGISTRY.register(Spec("many", "many_scenes:ManyScenes", "three scenes"))
    for name in ("straight", "refuses"):
        spec = Spec(name, f"many_scenes:{name.title()}", "the straight line", in_all=False)
        planners.REGISTRY.register(spec)
    yield envs.make("many")
    envs.REGISTRY.unregister("many")
    for name in ("straight", "refuses"):
        planners.REGISTRY.unregister(name)


def boxes_of(scene: int) -> list[list[float]]:
    return [box.center.tolist() for box in envs.make(f"c3d:scene={scene}").obstacles]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_each_problem_is_planned_and_judged_in_its_scene(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "many", "--planners", "straight,rrtconnect", "--stop", "first")
    code, out, _ = bench(*run, "--problems", 9, "--out", tmp_path)
    assert code == 0
    assert "scene s" in out
    rows = records_of(tmp_path)
    straight = rows[rows["planner"] == "straight"]
    for number, stats in zip(straight["problem"], straight["stats"], strict=True):
        assert json.loads(stats)["boxes"] == boxes_of(number % SCENES)
    lines = RunResults.read(tmp_path).selections[0]["envs"][0]["straight_lines"]
    assert set(lines) == {"B", "F"}
    claimed = (straight["status"] == Status.EXACT_SOLUTION.value).tolist()
    assert claimed == [letter == "F" for letter in lines]
    assert (straight["verdict"] == Verdict.VALID.value).tolist() == claimed
    assert (rows.loc[rows["planner"] == "rrtconnect", "solved"] == 1).all()
    assert (rows["scene_s"] > 0).all()
    summary = pd.read_csv(tmp_path / "summary.csv").set_index("planner")
    assert (summary["scene_s_median"] > 0).all()


def test_the_judge_looks_at_the_scene_of_the_problem(many: Environment) -> None:
    problems = many.sample_problems(6, 1)
    judge = Judge(many)
    verdicts = []
    for problem in problems:
        line = np.array([problem.start, problem.goal])
        alone = Judge(many.scene_of(problem))(problem, line)
        assert judge(problem, line) == alone
        told = judge.with_contact(alone, problem, line)
        assert (told.contact is None) == (alone.verdict is Verdict.VALID)
        verdicts.append(alone.verdict)
    assert set(verdicts) == {Verdict.VALID, Verdict.COLLISION}
    free = [verdict is Verdict.VALID for verdict in verdicts]
    assert problem_facts(many, problems).straight_lines == "".join("BF"[one] for one in free)


def test_without_scenes_of_their_own_nothing_is_timed_for_them(c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, 0)
    assert c3d.scene_of(problem) is c3d
    assert not c3d.scenes_differ


def test_setting_a_scene_is_setting_up_again_unless_a_planner_says_otherwise() -> None:
    class Noting(Planner):
        def __init__(self) -> None:
            self.seen: list[tuple[Environment, int]] = []

        def setup(self, env: Environment, *, seed: int) -> None:
            self.seen.append((env, seed))

        def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
            return PlannerResult(Status.TIMEOUT)

    planner, scenes = Noting(), [envs.make(f"c3d:scene={n}") for n in (0, 1)]
    for scene in (*scenes, scenes[0]):
        planner.set_scene(scene)
    (first, seed), (second, other), (_, again) = planner.seen
    assert (first, second) == tuple(scenes)
    assert seed == again != other


@pytest.mark.slow
def test_in_processes_a_scene_that_fails_is_the_outcome_of_its_problems(
    bench: Cli, tmp_path: Path
) -> None:
    """One raises an error in one scene, and ends its process in another."""
    run = ("run", "--env", "many", "--planners", "refuses,straight", "--stop", "first")
    assert bench(*run, "--problems", 6, "--out", tmp_path)[0] == 0
    rows = records_of(tmp_path)
    refused = rows[rows["planner"] == "refuses"].set_index("problem")
    straight = rows[rows["planner"] == "straight"].set_index("problem")
    for number in (0, 3):
        assert refused.loc[number, "status"] == straight.loc[number, "status"]
    for number, said in (
        (1, "no such scene"),
        (4, "no such scene"),
        (2, "SystemError"),
        (5, "SystemError"),
    ):
        assert refused.loc[number, "status"] == "ERROR"
        assert "set_scene" in refused.loc[number, "error"]
        assert said in refused.loc[number, "error"]
    for number, stats in straight["stats"].items():
        assert json.loads(stats)["boxes"] == boxes_of(number % SCENES)
    code, out, _ = bench("replay", tmp_path, "--planner", "straight", "--problem", 4)
    assert code == 0
    assert "same path" in out


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_pages_and_pictures_show_the_scene_of_the_problem(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "many", "--planners", "rrtconnect", "--stop", "first", "--problems", 4)
    assert bench(*run, "--out", tmp_path)[0] == 0
    results = RunResults.read(tmp_path)
    [problem_set] = problem_sets_of(results)
    data = problems_data(problem_set, columns(results))
    many = [data["problems"][number]["obstacles"] for number in range(4)]
    assert many[0] == many[3]
    assert many[0] != many[1] != many[2]
    assert {one["many"] for one in many} == {120}
    pictures = []
    for number in (0, 1, 3):
        file = tmp_path / f"{number}.png"
        assert bench("show", "--env", "many", "--problem", number, "--out", file)[0] == 0
        pictures.append(file.read_bytes())
    assert pictures[0] == pictures[2] != pictures[1]
    file = tmp_path / "paths.png"
    assert bench("show", "--env", "many", "--paths", tmp_path, "--out", file)[0] == 0


@pytest.mark.parametrize("name", ["ntfields", "ief3d", "eikonet", "mpnet"])
def test_planners_with_weights_for_a_scene_say_so(name: str, many: Environment) -> None:
    reason = planners.make(name).unsupported(many)
    assert reason is not None
    assert "scene" in reason


def test_test_planner_tries_it_in_the_scenes(bench: Cli) -> None:
    code, out, _ = bench("test-planner", "straight", "--env", "many")
    assert code == 0, out
