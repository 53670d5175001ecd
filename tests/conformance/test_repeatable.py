"""With the same seed and time enough, a planner finds the same path twice."""

from __future__ import annotations

import math
from time import perf_counter

import numpy as np
import pytest
from shipped import set_up

import planners
from envs import Environment, Problem
from planners import Budget, Planner, PlannerResult

SPECS = planners.REGISTRY.specs()
IDS = [
    pytest.param(spec.id, marks=pytest.mark.slow if spec.id == "fmm" else ())
    for spec in SPECS
    if not spec.not_repeatable
]
ENOUGH_S = 30


def solved(planner: Planner, problem: Problem) -> PlannerResult:
    result = planner.solve(problem, Budget(perf_counter() + ENOUGH_S, stop_cost=math.inf))
    assert result.status is not planners.Status.TIMEOUT
    return result


@pytest.mark.parametrize("id", IDS)
def test_the_same_seed_gives_the_same_path_whatever_was_solved_before(
    id: str, c3d: Environment
) -> None:
    problems = c3d.sample_problems(2, 8)
    first, second = set_up(id, c3d), set_up(id, c3d)
    found = [solved(first, problem) for problem in problems]
    again = [solved(second, problem) for problem in reversed(problems)][::-1]
    for a, b in zip(found, again, strict=True):
        assert a.status is b.status
        assert (a.path is None) == (b.path is None)
        if a.path is not None:
            np.testing.assert_array_equal(np.asarray(a.path), np.asarray(b.path))


def test_another_seed_gives_another_path(c3d: Environment) -> None:
    """So that the test above could fail."""
    problem = c3d.sample_problems(1, 8)[0]
    planner = set_up("rrtconnect", c3d)
    a, b = (
        np.asarray(solved(planner, Problem(problem.start, problem.goal, 0, seed)).path)
        for seed in (1, 2)
    )
    assert a.shape != b.shape or not np.array_equal(a, b)


def test_exceptions_are_declared_with_a_reason() -> None:
    declared = {spec.id: spec.not_repeatable for spec in SPECS if spec.not_repeatable}
    assert sorted(declared) == ["ompl2-prmstar", "prmstar"], "a thread of OMPL's in both"
    assert all(len(reason.split()) > 5 for reason in declared.values())
