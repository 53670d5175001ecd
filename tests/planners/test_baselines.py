"""Baselines do what they say, no more and no less."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

import envs
import planners
from bench.judge import Judge
from bench.record import Verdict
from envs import Environment
from planners import Budget, Planner, PlannerResult, Status


def ready(name: str, env: Environment) -> Planner:
    planner = planners.make(name)
    planner.setup(env, seed=1)
    return planner


def results(name: str, env: Environment, n: int) -> list[PlannerResult]:
    planner = ready(name, env)
    return [planner.solve(p, Budget(perf_counter() + 3)) for p in env.sample_problems(n, 3)]


@pytest.mark.parametrize("env", ["c3d", "arm4"])
def test_a_straight_line_is_solved_exactly_where_it_is_free(env: str) -> None:
    world = envs.make(env)
    judge = Judge(world)
    problems = world.sample_problems(30, 3)
    claimed = []
    for problem, result in zip(problems, results("straight-line", world, 30), strict=True):
        path = np.array([problem.start, problem.goal])
        assert (np.asarray(result.path) == path).all()
        claimed.append(result.status is Status.EXACT_SOLUTION)
        assert claimed[-1] == (judge(problem, path).verdict is Verdict.VALID)
        assert claimed[-1] or result.status is Status.APPROXIMATE_SOLUTION
    assert 0 < sum(claimed) < 30


def test_random_detours_are_found_by_the_seed_and_hold(c3d: Environment) -> None:
    judge = Judge(c3d)
    found, again = (results("random-detours", c3d, 30) for _ in range(2))
    lengths = set()
    for problem, a, b in zip(c3d.sample_problems(30, 3), found, again, strict=True):
        assert a.status is Status.EXACT_SOLUTION
        assert (np.asarray(a.path) == np.asarray(b.path)).all()
        assert judge(problem, np.asarray(a.path)).verdict is Verdict.VALID
        lengths.add(len(a.path))
    assert {2, 3} <= lengths <= {2, 3, 4, 5}


def test_random_detours_end_with_the_time(c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, 3)
    walled = envs.Problem(problem.start, c3d.obstacles[0].center)  # type: ignore[attr-defined]
    begin = perf_counter()
    result = ready("random-detours", c3d).solve(walled, Budget(begin + 0.2))
    assert result.status is Status.TIMEOUT
    assert result.path is None
    assert perf_counter() - begin < 1


def test_they_are_among_all_and_are_called_baselines() -> None:
    described = {spec.id: spec.description for spec in planners.REGISTRY.group("all")}
    for name in ("straight-line", "random-detours"):
        assert described[name].startswith("baseline:")
