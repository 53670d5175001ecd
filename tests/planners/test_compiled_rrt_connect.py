"""RRT-Connect that is compiled with its proofs."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest
from arms import arm_of, at, turning

import envs
import planners
from bench.conformance.trials import WalledIn, unsolvable_problem
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import InputError, Problem
from envs.collision.shapes import Box, PlacedShape
from envs.robots.arm import Part
from envs.scenes.arm_world import ArmWorld
from planners import Budget, Status
from planners.compiled.rrt_connect import CompiledRrtConnect


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


def slot() -> tuple[ArmWorld, Problem]:
    """An arm of thin bars that is to reach into a slot, from which most motions are in its way."""
    joints = [turning("z"), turning("z", at(0.5, 0, 0)), turning("z", at(0.4, 0, 0))]
    joints.append(turning("y", at(0.2, 0, 0)))
    bars = (
        Part(body, PlacedShape(Box((long / 2, 0, 0), (long, 0.04, 0.04)), np.eye(4)))
        for body, long in ((1, 0.5), (2, 0.4), (3, 0.2), (4, 0.2))
    )
    wall = Box((0, 0, 0), (0.6, 0.1, 0.6))
    walls = [PlacedShape(wall, at(1, side * 0.13, 0)) for side in (-1, 1)]
    start = np.array([2.5, 0.0, 0.0, 0.0])
    return ArmWorld(arm_of(joints, *bars), walls, "slot"), Problem(start, np.zeros(4), seed=2)


def test_ends_that_are_asked_about_together_change_no_path() -> None:
    world, problem = slot()
    results = []
    for one_by_one in (False, True):
        planner = planners.make("rrtconnect-fast")
        assert isinstance(planner, CompiledRrtConnect)
        planner.setup(world, seed=1)
        if one_by_one:
            planner._check = planner._check._replace(of_ends=0)
        results.append(planner.solve(problem, Budget(perf_counter() + 10)))
    together, alone = results
    assert together.stats == alone.stats
    assert together.stats["samples"] > 300
    assert np.array_equal(together.path, alone.path)


def test_out_of_narrow_places_some_motions_are_half_as_long() -> None:
    world, problem = slot()
    planner = planners.make("rrtconnect-fast:range=1")
    planner.setup(world, seed=1)
    path = np.asarray(planner.solve(problem, Budget(perf_counter() + 10)).path)
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert lengths.max() <= 1 + 1e-9
    assert np.isclose(lengths, 0.5).any()
    assert Judge(world)(problem, path).verdict is Verdict.VALID


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
