"""AORRTC, and the compiled pieces that it is made of."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pytest

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from envs.compiled import njit_cached
from envs.compiled_space import space_arrays
from envs.spaces import Coordinates, Rotations, Space
from planners import Budget, Planner, Status
from planners.compiled.informed_set import draw_informed
from planners.compiled.shortcuts import Waypoints, length, shorten
from planners.compiled.trees import Trees


def of(text: str) -> tuple[Environment, Planner]:
    env, planner = envs.make(text), planners.make("aorrtc")
    planner.setup(env, seed=1)
    return env, planner


def compiled_check(env: Environment) -> Any:
    check = env.motion_check(env.planning_tolerance)
    assert check is not None
    KEPT.append(check)
    return check.compiled


KEPT: list[Any] = []
"""What compiled code points to."""


def is_straight(env: Environment, problem: Problem) -> bool:
    model = env.collision_model(env.planning_tolerance)
    return model.segment_is_free(problem.start, problem.goal)


@pytest.mark.parametrize("text", ["c3d", "arm4", "rigid:body=cross,space=se3"])
def test_its_paths_become_shorter_and_the_judge_takes_them(text: str) -> None:
    env, planner = of(text)
    judge = Judge(env)
    firsts = shorter = 0
    blocked = [p for p in env.sample_problems(30, 3) if not is_straight(env, p)]
    for problem in blocked[:4]:
        begin = perf_counter()
        result = planner.solve(problem, Budget(begin + 0.3, stop_cost=0))
        assert perf_counter() - begin < 0.4
        assert result.status is Status.EXACT_SOLUTION
        path = np.asarray(result.path)
        judged = judge(problem, path)
        assert judged.verdict is Verdict.VALID, judged.reason
        times, lengths = np.array(result.stats["cost_history"]).T
        assert (np.diff(times) >= 0).all() and (np.diff(lengths) < 0).all()
        assert env.space.length(path) == pytest.approx(lengths[-1])
        firsts, shorter = firsts + lengths[0], shorter + lengths[-1]
    assert 0 < shorter < 0.95 * firsts


def test_it_stops_at_the_first_path_that_is_short_enough() -> None:
    env, planner = of("c3d")
    for problem in env.sample_problems(6, 3):
        firsts = [planner.solve(problem, Budget(perf_counter() + 5)) for _ in range(2)]
        assert np.array_equal(firsts[0].path, firsts[1].path), "the first, which repeats"
        assert len(firsts[0].stats["cost_history"]) == 1
        first = env.space.length(np.asarray(firsts[0].path))
        straight = float(np.linalg.norm(problem.goal - problem.start))
        wanted = straight + 0.5 * (first - straight)
        begin = perf_counter()
        shorter = planner.solve(problem, Budget(begin + 5, stop_cost=wanted))
        if first > 1.01 * straight:
            assert perf_counter() - begin < 4
            assert straight <= env.space.length(np.asarray(shorter.path)) <= wanted


def test_it_comes_near_the_optimum() -> None:
    """About a wall: past the nearer of its edges, two straight lines."""
    env = envs.make("box:robot_radius=0.05")
    planner = planners.make("aorrtc")
    planner.setup(env, seed=1)
    [box] = (obstacle for obstacle in env.obstacles)
    lower, upper = box.center - box.sides / 2, box.center + box.sides / 2
    across = (upper - lower)[0]
    start = np.array([lower[0] - 0.3 * across, upper[1] - 0.02 * across, box.center[2]])
    goal = start * [1, 1, 1]
    goal[0] = upper[0] + 0.3 * across
    problem = Problem(start, goal)
    result = planner.solve(problem, Budget(perf_counter() + 1.0, stop_cost=0))
    found = env.space.length(np.asarray(result.path))
    rise = upper[1] - start[1]  # without the ball's radius: no way is shorter
    assert found >= across + 2 * np.hypot(0.3 * across, rise)
    rise += 0.1
    assert found <= 1.02 * (across + 2 * np.hypot(0.3 * across, rise))


SPACES = {
    "R^2": Space([Coordinates([-1, -1], [1, 1], weight=0.5)]),
    "R^6": Space([Coordinates([-2] * 6, [2] * 6)]),
    "SE(2)": Space([Coordinates([0, 0], [4, 4]), Coordinates([-np.pi], [np.pi], [True], 0.5)]),
    "SE(3)": Space([Coordinates([0] * 3, [4] * 3), Rotations(2.0)]),
}


@njit_cached
def some_informed(space: Any, trees: Any, bound: float, q: Any) -> int:
    found = 0
    for _ in range(len(q)):
        if draw_informed(space, trees, bound, q[found]):
            found += 1
    return found


@pytest.mark.parametrize("share", [1.05, 1.5, 20.0])
@pytest.mark.parametrize("name", SPACES)
def test_informed_draws_are_those_of_the_space_that_may_help(name: str, share: float) -> None:
    space = SPACES[name]
    rng = np.random.default_rng(4)
    start, goal = space.sample(rng, 2)
    least = float(space.distance(start[None], goal[None])[0])
    trees = Trees.with_room(4, space.size)
    trees.begin(start, goal[None], 8)
    q = np.empty((4000, space.size))
    count = some_informed(space_arrays(space), trees, share * least, q)
    q = q[:count]
    assert space.contains(q).all()
    total = space.distance(start[None], q) + space.distance(q, goal[None])
    assert (total < share * least).all()
    every = space.sample(rng, 100_000)
    wanted = every[
        space.distance(start[None], every) + space.distance(every, goal[None]) < share * least
    ]
    if len(wanted) > 400 and count > 400:
        far = (space.upper - space.lower).max()
        assert q.mean(axis=0) == pytest.approx(wanted.mean(axis=0), abs=0.05 * far)
        assert q.std(axis=0) == pytest.approx(wanted.std(axis=0), abs=0.05 * far)


def test_what_no_path_can_be_shorter_than_draws_nothing() -> None:
    space = SPACES["R^6"]
    trees = Trees.with_room(4, space.size)
    trees.begin(np.zeros(6), np.ones((1, 6)), 8)
    assert not some_informed(space_arrays(space), trees, 6**0.5 - 1e-9, np.empty((5, 6)))


def test_shortcuts_keep_the_ends_and_what_is_free() -> None:
    env = envs.make("c3d")
    space, check = space_arrays(env.space), compiled_check(env)
    planner = planners.make("rrtconnect-fast:range=0.3")
    planner.setup(env, seed=1)
    model = env.collision_model(env.planning_tolerance / 4)
    for problem in env.sample_problems(5, 3):
        path = np.asarray(planner.solve(problem, Budget(np.inf)).path)
        waypoints = Waypoints.of(path, 3)
        before = length(space, waypoints)
        assert before == pytest.approx(env.space.length(path))
        taken = shorten(check, space, waypoints, 400)
        after = waypoints.path
        assert np.array_equal(after[[0, -1]], path[[0, -1]])
        assert length(space, waypoints) == pytest.approx(env.space.length(after))
        assert env.space.length(after) < before if taken else np.array_equal(after, path)
        assert all(map(model.segment_is_free, after, after[1:]))


def test_without_room_for_more_waypoints_shortcuts_that_need_none_are_taken() -> None:
    env = envs.make("c3d")
    space, check = space_arrays(env.space), compiled_check(env)
    corner = env.lower + 0.02 * (env.upper - env.lower)
    side = np.array([0.02, 0, 0]) * (env.upper - env.lower)
    zigzag = np.array([corner + n * side / 10 + (n % 2) * side[[1, 0, 2]] / 10 for n in range(9)])
    full = Waypoints(zigzag.copy(), np.array([9]), np.array([3], np.uint64))
    shorten(check, space, full, 2000)
    assert full.used[0] <= 9
    assert env.space.length(full.path) < env.space.length(zigzag)
