"""`--simplify`: the same shortcuts for every planner's paths."""

from __future__ import annotations

import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, Refused

import envs
from bench.judging.judge import Judge
from bench.judging.simplification import Simplifier
from bench.storage.record import Verdict
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld
from planners.compiled.shortcuts import Shortener

OPTIONS = ("--problems", "6", "--seed", "3", "--stop", "first", "--planners")


def test_lengths_after_it_compare_and_the_planners_own_stay(bench: Cli, tmp_path: Path) -> None:
    planners = "rrtconnect:range=1,random-detours"
    without, with_it = tmp_path / "without", tmp_path / "with"
    for folder, more in ((without, ()), (with_it, ("--simplify", "1"))):
        code, out, err = bench(
            "run", "--env", "c3d", *OPTIONS, planners, *more, "--out", str(folder)
        )
        assert code == 0, err
    assert "simplified length units" in out
    before, after = (pd.read_csv(folder / "summary.csv") for folder in (without, with_it))
    assert before["length_mean"].tolist() == after["length_mean"].tolist()
    assert before["simplified_length_mean"].isna().all()
    assert (after["simplified_length_mean"] < after["length_mean"]).all()
    assert ((after["simplify_s_mean"] > 0) & (after["simplify_s_mean"] < 1.2)).all()
    settings = json.loads((with_it / "manifest.json").read_text())["settings"]
    assert settings["simplify_s"] == 1


@pytest.mark.parametrize("seconds", ["-1", "nan", "inf", "1e9", "soon"])
def test_times_that_are_none_are_refused(refused: Refused, seconds: str) -> None:
    said = refused("run", "--env", "c3d", "--planners", "rrtconnect", "--simplify", seconds)
    assert "--simplify" in said


def test_what_it_makes_is_shorter_valid_and_repeats() -> None:
    env = envs.make("c3d")
    judge = Judge(env)
    shaking = np.random.default_rng(0).normal(size=(30, 3)) * 0.02
    shaking[[0, -1]] = 0
    problem, shaken = next(
        (problem, path)
        for problem in env.sample_problems(20, 3)
        for path in [np.linspace(problem.start, problem.goal, 30) + shaking]
        if judge(problem, path).verdict is Verdict.VALID
    )
    made = [Simplifier(5.0)(env, problem, shaken) for _ in range(2)]
    assert all(one is not None for one in made)
    first, second = (one.path for one in made if one is not None)
    assert np.array_equal(first, second)
    assert judge(problem, first).verdict is Verdict.VALID
    assert env.space.length(first) == pytest.approx(
        np.linalg.norm(problem.goal - problem.start), rel=1e-3
    )


def test_time_ends_it() -> None:
    env = envs.make("c3d")
    problem = env.sample_problems(1, 3)[0]
    path = np.array([problem.start, problem.goal])
    made = Simplifier(0.0)(env, problem, path)
    assert made is not None and np.array_equal(made.path, path)


def test_judges_of_several_planners_simplify_one_at_a_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Robots that several environments share have tables that proofs write to."""
    at_work, most = [0], [0]

    def improve(*_: Any) -> int:
        at_work[0] += 1
        most[0] = max(most[0], at_work[0])
        time.sleep(0.01)
        at_work[0] -= 1
        return 1

    monkeypatch.setattr(Shortener, "improve", improve)
    env = envs.make("c3d")
    problem = env.sample_problems(1, 3)[0]
    path = np.array([problem.start, problem.goal])
    with ThreadPoolExecutor(3) as pool:
        for made in pool.map(lambda _: Simplifier(0.1)(env, problem, path), range(3)):
            assert made is not None and 0.1 <= made.seconds < 0.2
    assert most == [1]


class InPython(BoxWorld):
    """Has no compiled proofs."""

    min_clearance, kind_of_problems, advice = 0.4, "in Python", ""

    def __init__(self) -> None:
        super().__init__([Box(np.zeros(3), np.ones(3))], 0.1)

    def motion_check(self, tolerance: float) -> Any:
        return None

    def definition(self) -> dict[str, Any]:
        return {"class": "InPython"}


def test_without_compiled_proofs_there_is_none() -> None:
    env = InPython()
    problem = env.sample_problems(1, 3)[0]
    assert Simplifier(1.0)(env, problem, np.array([problem.start, problem.goal])) is None
