"""The judge on hand-made paths with known truth."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from bench.judge import Judge
from bench.record import Verdict
from envs import Problem

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
    assert judged.travel_time is not None
    assert judged.travel_time > judged.length
    assert judged.smoothness is not None
    assert judged.smoothness > 0


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


@settings(max_examples=50, deadline=None)
@given(st.floats(-0.5, 0.5))
def test_the_verdict_follows_the_clearance(gap: float) -> None:
    judged = JUDGE(PROBLEM, around(gap))
    if gap <= 0:
        assert judged.verdict is Verdict.COLLISION
    if gap > 1.0001e-3:
        assert judged.verdict is Verdict.VALID
        assert judged.safety_margin == pytest.approx(min(gap, 0.49), abs=1.01e-3)
