"""Planning with a time field that is a metric."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment
from planners import Budget, Status
from planners.fast_marching import SpeedGrid
from planners.fields.methods import method
from planners.fields.planner import FieldPlanner


@pytest.mark.parametrize("name", ["c3d", "gibson-generated", "arm4", "maze"])
def test_what_is_planned_with_is_a_metric_whatever_the_network_is_told(name: str) -> None:
    """Untrained, through the planner's own times: symmetric, and never more by way of a place."""
    env = envs.make(name)
    made = planners.make("ntrl")
    assert isinstance(made, FieldPlanner)
    net = method("ntrl", env).network(env)
    method("ntrl", env).survey(net, 0)
    made._use(env, net)
    assert_is_a_metric(made, env)


def assert_is_a_metric(planner: FieldPlanner, env: Environment) -> None:
    q = np.random.default_rng(4).uniform(env.lower, env.upper, (40, env.dimension))
    times = np.stack([planner.times_and_speeds(source, q)[0] for source in q])
    assert times == pytest.approx(times.T, rel=1e-4, abs=1e-5)
    assert (times[~np.eye(40, dtype=bool)] > 0).all()
    by_way = (times[:, :, None] + times[None]).min(axis=1)
    assert (times <= by_way * (1 + 1e-4) + 1e-5).all()
    assert times.std() > 0.1 * times.mean(), "not all the same, which would be a metric, too"


@pytest.fixture(scope="module")
def shipped(c3d: Environment) -> FieldPlanner:
    made = planners.make("ntrl")
    assert isinstance(made, FieldPlanner)
    made.setup(c3d, seed=1)
    return made


def test_the_shipped_field_is_a_metric(shipped: FieldPlanner, c3d: Environment) -> None:
    assert_is_a_metric(shipped, c3d)


def test_the_shipped_field_finds_the_way_round_what_is_in_the_way(
    shipped: FieldPlanner, c3d: Environment
) -> None:
    """Problems whose straight line is blocked, each in a single attempt, in paths that are not
    much longer than they must be; the other way round of a field would lead away from the goal."""
    blocked = [
        problem
        for problem in c3d.sample_problems(60, 515)
        if not c3d.paths_are_free([np.array([problem.start, problem.goal])], c3d.tolerance)[0]
    ]
    assert len(blocked) > 20
    results = shipped.solve_batch(blocked)
    judge = Judge(c3d)
    for problem, result in zip(blocked, results, strict=True):
        assert result.status is Status.EXACT_SOLUTION
        assert judge(problem, np.asarray(result.path)).verdict is Verdict.VALID
    lengths = [np.linalg.norm(np.diff(r.path, axis=0), axis=-1).sum() for r in results]
    straight = [np.linalg.norm(p.start - p.goal) for p in blocked]
    assert np.mean(np.divide(lengths, straight)) < 1.5
    assert np.mean([r.stats["attempts"] == 1 for r in results]) > 0.9


def test_one_at_a_time_is_nearly_the_same_as_together(
    shipped: FieldPlanner, c3d: Environment
) -> None:
    """At the field's kinks rounding decides which way a step goes, and where loops are cut."""
    problems = c3d.sample_problems(30, seed=77)
    ratios = []
    for problem, wanted in zip(problems, shipped.solve_batch(problems), strict=True):
        found = shipped.solve(problem, Budget(perf_counter() + 5))
        assert found.status is wanted.status is Status.EXACT_SOLUTION
        lengths = [np.linalg.norm(np.diff(r.path, axis=0), axis=-1).sum() for r in (found, wanted)]
        ratios.append(lengths[0] / lengths[1])
    assert np.median(ratios) == pytest.approx(1, abs=0.01)
    assert np.quantile(ratios, [0.1, 0.9]) == pytest.approx(1, abs=0.1)


def test_the_shipped_times_are_near_fast_marchings(shipped: FieldPlanner, c3d: Environment) -> None:
    """Which they have never been told."""
    grid = SpeedGrid(c3d, 50, 2)
    rng = np.random.default_rng(3)
    q = rng.uniform(c3d.lower, c3d.upper, (2000, 3))
    q = q[c3d.clearance(q) > 0]
    source = q[np.argmax(c3d.clearance(q))]
    q = q[np.linalg.norm(q - source, axis=-1) > 2]
    truth = grid.times_at(grid.arrival_times(source), source, q)
    straight = np.linalg.norm(q - source, axis=-1)
    hindered = truth > 1.2 * straight
    assert hindered.sum() > 100
    times, _ = shipped.times_and_speeds(source, q)
    assert np.median(np.abs(times / truth - 1)) < 0.08
    error, of_distance = (np.abs(t / truth - 1)[hindered] for t in (times, straight))
    assert np.median(error) < 0.5 * np.median(of_distance)
