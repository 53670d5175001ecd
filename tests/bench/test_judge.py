"""The judge on hand-made paths with known truth."""

from __future__ import annotations

from itertools import pairwise
from time import perf_counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
import planners
from bench.judging.judge import Judge, Judgement
from bench.storage.record import MOST_WAYPOINTS, Verdict
from envs import Problem
from planners import Budget

ENV = envs.make("c3d:boxes=1")
BOX = ENV.obstacles[0]
JUDGE = Judge(ENV)
START = BOX.center + [0, 0, BOX.sides[2] / 2 + 0.5]
GOAL = BOX.center - [0, 0, BOX.sides[2] / 2 + 0.5]
SIDE = BOX.center + [BOX.sides[0] / 2 + 0.51, 0, 0]
PROBLEM = Problem(START, GOAL)


def around(gap: float) -> np.ndarray:
    """A path round the box that keeps `gap` from its surface, robot's radius included."""
    x, z = (BOX.sides[[0, 2]] / 2 + gap + ENV.robot.radius).tolist()
    corners = [[0, z], [x, z], [x, -z], [0, -z]]
    path = [BOX.center + [cx, 0, cz] for cx, cz in corners]
    return np.array([START, *path, GOAL])


def test_a_good_path_and_its_numbers() -> None:
    judged = JUDGE(PROBLEM, around(0.3))
    assert judged.verdict is Verdict.VALID
    assert judged.waypoints == 6
    assert judged.safety_margin == pytest.approx(0.3, abs=1e-3)
    assert judged.length == pytest.approx(
        np.linalg.norm(np.diff(around(0.3), axis=0), axis=1).sum()
    )


@pytest.mark.parametrize(
    ("path", "verdict", "reason"),
    [
        (None, Verdict.MALFORMED, "axes"),
        (np.zeros(3), Verdict.MALFORMED, "axes"),
        (np.zeros((2, 3, 1)), Verdict.MALFORMED, "axes"),
        (np.zeros((0, 3)), Verdict.MALFORMED, "waypoints"),
        (START[None], Verdict.MALFORMED, "at least 2"),
        (np.array([START[:2], GOAL[:2]]), Verdict.MALFORMED, "2 coordinates"),
        (np.array([START, SIDE * np.nan, GOAL]), Verdict.MALFORMED, "NaN"),
        (np.array([START, SIDE * np.inf, GOAL]), Verdict.MALFORMED, "infinite"),
        (np.array([START + 2e-6, SIDE, GOAL]), Verdict.WRONG_ENDPOINT, "start"),
        (np.array([START, SIDE, GOAL + 2e-6]), Verdict.WRONG_ENDPOINT, "goal"),
        (np.array([GOAL, SIDE, START]), Verdict.WRONG_ENDPOINT, "start"),
        (np.array([START, [0, 0, 10.001], GOAL]), Verdict.OUT_OF_BOUNDS, "waypoint 1 of 3"),
        (np.array([START, [1e300, 0, 0], GOAL]), Verdict.OUT_OF_BOUNDS, "waypoint 1 of 3"),
        (np.array([START, BOX.center, GOAL]), Verdict.COLLISION, "not proved free"),
        (np.array([START, GOAL]), Verdict.COLLISION, "not proved free"),
        (around(-0.01), Verdict.COLLISION, "not proved free"),
        (around(0.0), Verdict.COLLISION, "not proved free"),
    ],
)
def test_bad_paths(path: np.ndarray | None, verdict: Verdict, reason: str) -> None:
    judged = JUDGE(PROBLEM, path)
    assert judged.verdict is verdict
    assert reason in judged.reason
    assert judged.safety_margin is None


def test_ends_may_be_off_by_rounding() -> None:
    path = around(0.3)
    path[0] += 5e-7
    path[-1] -= 5e-7
    assert JUDGE(PROBLEM, path).verdict is Verdict.VALID


def test_repeated_waypoints_and_many_waypoints() -> None:
    path = around(0.3)
    assert JUDGE(PROBLEM, np.repeat(path, 3, axis=0)).verdict is Verdict.VALID
    t = np.linspace(0, 1, 5000)[:, None]
    fine = np.concatenate([a + t * (b - a) for a, b in pairwise(path)])
    judged = JUDGE(PROBLEM, fine)
    assert judged.verdict is Verdict.VALID
    assert judged.safety_margin == pytest.approx(0.3, abs=1e-3)
    assert judged.length == pytest.approx(JUDGE(PROBLEM, path).length)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.floats(-0.5, 0.5))
def test_the_verdict_follows_the_clearance(gap: float) -> None:
    judged = JUDGE(PROBLEM, around(gap))
    if gap <= 0:
        assert judged.verdict is Verdict.COLLISION
    if gap > 1.0001e-3:
        assert judged.verdict is Verdict.VALID
        assert judged.safety_margin == pytest.approx(min(gap, 0.49), abs=1.01e-3)


def there_and_back(times: int, gap: float) -> np.ndarray:
    """Along a face of the box, again and again."""
    x, z = (BOX.sides[[0, 2]] / 2).tolist()
    away = x + ENV.robot.radius + gap
    return BOX.center + np.array([[away, 0, (-1) ** i * 0.9 * z] for i in range(times)])


def verdict_of(path: np.ndarray) -> Judgement:
    return JUDGE(Problem(path[0], path[-1]), path)


def test_a_path_of_more_waypoints_than_anybody_needs_is_not_judged() -> None:
    path = np.repeat(START[None], MOST_WAYPOINTS + 1, axis=0)
    judged = verdict_of(path)
    assert judged.verdict is Verdict.NOT_JUDGED
    assert f"it has {MOST_WAYPOINTS + 1} waypoints" in judged.reason
    assert judged.safety_margin is None


def test_a_path_longer_than_anybody_needs_is_not_judged() -> None:
    judged = verdict_of(np.array([ENV.lower, ENV.upper] * 51))
    assert judged.verdict is Verdict.NOT_JUDGED
    assert "longer than 100 times" in judged.reason


def test_a_path_that_cannot_be_decided_in_time_is_not_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("bench.judging.judge._MOST_QUERIES", 3000)
    monkeypatch.setattr("bench.judging.judge.FIRST_QUERIES", 1000)
    for gap in (1.01e-3, 1.2e-3):
        judged = verdict_of(there_and_back(100, gap))
        assert judged.verdict is Verdict.NOT_JUDGED
        assert "3000 configurations on it do not decide" in judged.reason
    assert verdict_of(there_and_back(100, -1e-3)).verdict is Verdict.COLLISION
    proved = verdict_of(there_and_back(100, 0.5))
    assert proved.verdict is Verdict.VALID
    assert proved.safety_margin is not None
    assert 0.4 < proved.safety_margin <= 0.5 + 1e-3, "never above the truth by more than that"


@pytest.mark.parametrize("gap", [1.01e-3, 2e-3, 0.3])
def test_what_keeps_just_above_the_tolerance_all_the_way_is_decided(gap: float) -> None:
    judged = verdict_of(there_and_back(4, gap))
    assert judged.verdict is Verdict.VALID
    assert judged.safety_margin == pytest.approx(gap, abs=1e-3)


def test_dense_paths_are_judged_as_thin_ones_are() -> None:
    thin = around(0.3)
    t = np.linspace(0, len(thin) - 1, 60_000)
    dense = np.column_stack([np.interp(t, np.arange(len(thin)), axis) for axis in thin.T])
    dense[0], dense[-1] = START, GOAL
    one, other = JUDGE(PROBLEM, thin), JUDGE(PROBLEM, dense)
    assert other.verdict is one.verdict is Verdict.VALID
    assert other.safety_margin == pytest.approx(one.safety_margin, abs=1e-3)
    assert other.length == pytest.approx(one.length, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("text", ["c3d", "arm4"])
def test_what_planners_find_stays_far_within_the_budget(text: str) -> None:
    env = envs.make(text)
    judge, planner = Judge(env), planners.make("rrtconnect")
    planner.setup(env, seed=0)
    for problem in env.sample_problems(5, 7):
        path = planner.solve(problem, Budget(perf_counter() + 5)).path
        model = judge._models.of(problem)
        model.checks = 0
        assert judge(problem, path).verdict is Verdict.VALID
        assert 0 < model.checks < 2000
