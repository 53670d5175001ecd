"""RRT-Connect that is compiled with its proofs."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

import envs
import planners
from bench.conformance.trials import WalledIn, unsolvable_problem
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import InputError, Problem
from planners import Budget, Status


@pytest.mark.parametrize(
    "text", ["c3d", "arm4", "arm6", "rigid:body=l,space=se2", "rigid:body=cross,space=se3"]
)
def test_the_judge_takes_its_paths(text: str) -> None:
    env, planner = envs.make(text), planners.make("rrtconnect-fast")
    planner.setup(env, seed=1)
    judge = Judge(env)
    for problem in env.sample_problems(20, 3):
        result = planner.solve(problem, Budget(perf_counter() + 10))
        assert result.status is Status.EXACT_SOLUTION
        judged = judge(problem, np.asarray(result.path))
        assert judged.verdict is Verdict.VALID, judged.reason


def test_the_same_seed_gives_the_same_path() -> None:
    env, planner = envs.make("c3d"), planners.make("rrtconnect-fast")
    planner.setup(env, seed=1)
    [problem] = (p for p in env.sample_problems(6, 3)[5:])
    paths = [np.asarray(planner.solve(problem, Budget(np.inf)).path) for _ in range(2)]
    assert np.array_equal(*paths)


def test_what_has_no_solution_ends_in_time_with_larger_trees() -> None:
    planner = planners.make("rrtconnect-fast:range=0.5")
    planner.setup(WalledIn(), seed=1)
    begin = perf_counter()
    result = planner.solve(unsolvable_problem(), Budget(begin + 0.5))
    assert result.status is Status.TIMEOUT
    assert perf_counter() - begin < 1.0
    assert result.stats["nodes"] > 2048


def test_any_of_several_goals_will_do() -> None:
    env, planner = envs.make("c3d"), planners.make("rrtconnect-fast")
    planner.setup(env, seed=1)
    a, b = env.sample_problems(2, 3)
    goals = np.array([b.goal, a.goal])
    result = planner.solve(Problem(a.start, goals[0], goals=goals), Budget(np.inf))
    assert any(np.array_equal(result.path[-1], goal) for goal in goals)


@pytest.mark.parametrize("range", ["0", "-1", "inf", "nan"])
def test_ranges_that_are_none_are_refused(range: str) -> None:
    with pytest.raises(InputError, match="range"):
        planners.make(f"rrtconnect-fast:range={range}")
