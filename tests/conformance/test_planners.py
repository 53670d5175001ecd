"""What every registered planner must keep to, in an environment it supports."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest
from counted_checks import counted_checks
from shipped import set_up

import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from planners import Budget, Planner, PlannerResult, Status
from planners.baselines import StraightLine

IDS = [
    pytest.param(spec.id, marks=pytest.mark.slow if spec.id == "fmm" else ())
    for spec in planners.REGISTRY.specs()
]


@pytest.fixture(params=IDS, scope="module")
def planner(request: pytest.FixtureRequest, c3d: Environment) -> Planner:
    return set_up(request.param, c3d)


@pytest.fixture
def limit_s(request: pytest.FixtureRequest) -> float:
    """Fast marching takes seconds, and more where the machine is busy; others may use all."""
    return 30.0 if request.node.callspec.params["planner"] == "fmm" else 5.0


def test_it_solves_what_it_claims_to_solve(
    planner: Planner, c3d: Environment, limit_s: float
) -> None:
    judge = Judge(c3d)
    for problem in c3d.sample_problems(3, 8):
        begin = perf_counter()
        result = planner.solve(problem, Budget(begin + limit_s))
        assert perf_counter() - begin <= limit_s
        assert isinstance(result, PlannerResult)
        if made_to_fail(planner) and result.status is Status.APPROXIMATE_SOLUTION:
            continue
        assert result.status is Status.EXACT_SOLUTION
        judged = judge(problem, np.asarray(result.path))
        assert judged.verdict is Verdict.VALID, judged.reason


def test_it_counts_the_collision_checks_that_it_makes(
    planner: Planner, c3d: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = counted_checks(monkeypatch)
    [problem] = c3d.sample_problems(1, 9)
    told = planner.solve(problem, Budget(perf_counter() + 5)).stats.get("collision_checks")
    assert told == (len(asked) if asked else None)


def test_a_goal_may_be_where_the_start_is(planner: Planner, c3d: Environment) -> None:
    """Far from everything, and within a fiftieth of the distance at which the speed falls."""
    judge = Judge(c3d)
    q = np.random.default_rng(1).uniform(c3d.lower, c3d.upper, (20_000, c3d.dimension))
    clearance = c3d.clearance(q) / c3d.speed_model.d_max
    for far in (True, False):
        place = q[(clearance > 0.6) if far else (clearance > 0.004) & (clearance < 0.018)][0]
        problem = Problem(place, place.copy())
        # Near obstacles some find nothing, however long they search.
        result = planner.solve(problem, Budget(perf_counter() + (3 if far else 0.5)))
        if far:
            assert result.status is Status.EXACT_SOLUTION
        if result.status is Status.EXACT_SOLUTION:
            judged = judge(problem, np.asarray(result.path))
            assert judged.verdict is Verdict.VALID, judged.reason


def made_to_fail(planner: Planner) -> bool:
    """Whether it is here to show that its method falls short: it must not claim, though."""
    return getattr(planner, "name", "") == "eikonet" or isinstance(planner, StraightLine)


def test_it_costs_nothing_offline_that_it_does_not_report(planner: Planner) -> None:
    assert planner.train_s >= 0


def test_the_spec_describes_it() -> None:
    for spec in planners.REGISTRY.specs():
        assert issubclass(spec.load(), Planner)
        assert spec.description[0].islower() or spec.description.startswith("OMPL")
        assert len(spec.description) < 100
    paper = [spec.id for spec in planners.REGISTRY.group("paper")]
    assert paper == ["ntfields", "ief3d", "fmm", "mpnet", "rrtstar", "lazyprmstar"]
