"""Joints that turn for ever: the short way leads across half a turn."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from bad_urdfs import LIMIT, collision, joint, link, robot

import envs
from bench.judging.judge import Judge, Verdict
from bench.judging.metric import SolvedAttempt, measure
from bench.judging.metrics import METRICS
from bench.judging.traversal import RISE_S
from envs.problem import Problem
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld

BOOM = collision('<box size="0.5 0.05 0.05"/>', '<origin xyz="0.25 0 0"/>')
WALL = "obstacles: [{box: [0.3, 0.06, 0.5], position: [0.35, 0, 0]}]"


def turntable(folder: Path, scene: str = "", *more: str) -> ArmWorld:
    """A boom that turns about z for ever, at 1 rad/s, and whatever is on it."""
    limit = '<limit effort="1" velocity="1"/>'
    turn = joint("turn", "base", "boom", "continuous", limit, "0 0 1")
    (folder / "arm.urdf").write_text(robot(link("base", ""), link("boom", BOOM), turn, *more))
    (folder / "scene.yaml").write_text(scene or "obstacles: []")
    rest = f",scene={folder / 'scene.yaml'}" if scene else ""
    env = envs.make(f"arm:urdf={folder / 'arm.urdf'}{rest}")
    assert isinstance(env, ArmWorld)
    return env


def elbow(inside: str = LIMIT, type: str = "revolute", axis: str = "0 0 1") -> tuple[str, str]:
    hand = link("hand", collision('<sphere radius="0.04"/>', '<origin xyz="0.2 0 0"/>'))
    return hand, joint("elbow", "boom", "hand", type, '<origin xyz="0.5 0 0"/>' + inside, axis)


def test_the_short_way_across_half_a_turn_counts(tmp_path: Path) -> None:
    env = turntable(tmp_path, WALL)
    judge = Judge(env)
    start, goal = np.array([2.8]), np.array([-2.8])
    problem = Problem(start, goal)
    assert judge(problem, np.array([start, goal])).verdict is Verdict.VALID
    assert judge(problem, np.array([start, goal])).length == pytest.approx(2 * math.pi - 5.6)
    long = np.array([[2.8], [1.0], [0.0], [-1.0], [-2.8]])
    assert judge(problem, long).verdict is Verdict.COLLISION
    free = env.paths_are_free([np.array([start, goal]), long], 2e-3)
    assert free.tolist() == [True, False]


def test_problems_are_apart_the_short_way_and_joined_by_it(tmp_path: Path) -> None:
    env = turntable(tmp_path, WALL)
    problems = env.sample_problems(30, 0)
    judge = Judge(env)
    crossing = 0
    for problem in problems:
        ends = np.array([problem.start, problem.goal])
        assert env.space.length(ends) >= env.min_separation
        if abs(problem.goal[0] - problem.start[0]) > math.pi:
            crossing += 1
            assert judge(problem, ends).verdict is Verdict.VALID, "the wall is on the other side"
    assert crossing > 3


def test_the_motion_bound_is_of_the_short_way(tmp_path: Path) -> None:
    arm = turntable(tmp_path).robot
    bound = arm.motion_bound(np.array([3.0]), np.array([-3.0]))
    assert bound == pytest.approx((2 * math.pi - 6) * arm.rate_bound)
    assert bound == pytest.approx(arm.motion_bound(np.array([-3.0]), np.array([3.0])))


def test_paths_are_unwrapped_from_their_first_waypoint(tmp_path: Path) -> None:
    tree = turntable(tmp_path, "", *elbow()).robot.tree
    path = np.array([[3.0, 0.5], [-3.0, 1.0], [-1.0, -1.0], [3.0, 0.0]])
    turn = 2 * math.pi
    expected = np.array([[3.0, 0.5], [turn - 3, 1.0], [turn - 1, -1.0], [3.0, 0.0]])
    assert tree.space.unwrapped(path) == pytest.approx(expected, abs=1e-12)
    steps = np.diff(tree.space.unwrapped(path), axis=0)
    assert steps == pytest.approx(tree.space.difference(path[:-1], path[1:]), abs=1e-12)


def test_the_fastest_traversal_is_of_the_short_way(tmp_path: Path) -> None:
    """0.68 rad by a joint of 1 rad/s, which rises and falls within RISE_S."""
    env = turntable(tmp_path)
    start, goal = np.array([2.8]), np.array([-2.8])
    attempt = SolvedAttempt(None, None, 0.1, np.empty((0, 2)))
    found = measure(METRICS, env, Problem(start, goal), np.array([start, goal]), attempt)
    assert found["duration_s"] == pytest.approx(2 * math.pi - 5.6 + RISE_S, rel=1e-3)


def test_fingerprints_say_which_joints_wrap(tmp_path: Path) -> None:
    env = turntable(tmp_path, "", *elbow())
    assert env.definition()["wraps"] == [0]
    ends = f'<limit lower="{-math.pi!r}" upper="{math.pi!r}"/>'
    turn = joint("turn", "base", "boom", "revolute", ends, "0 0 1")
    (tmp_path / "arm.urdf").write_text(robot(link("base", ""), link("boom", BOOM), turn, *elbow()))
    limited = envs.make(f"arm:urdf={tmp_path / 'arm.urdf'}")
    assert limited.lower == pytest.approx(env.lower)
    assert "wraps" not in limited.definition()
    assert limited.fingerprint != env.fingerprint


@pytest.mark.parametrize(
    ("ratio", "type", "wraps"),
    [
        ("2", "revolute", True),
        ("-1", "revolute", True),
        ("0.5", "revolute", False),
        ("1", "prismatic", False),
    ],
)
def test_a_joint_wraps_only_if_all_that_follow_it_are_back_after_a_turn(
    ratio: str, type: str, wraps: bool, tmp_path: Path
) -> None:
    mimic = f'<mimic joint="turn" multiplier="{ratio}"/>'
    tree = turntable(tmp_path, "", *elbow(mimic, type)).robot.tree
    assert [one.wraps for one in tree.coordinates] == [wraps]
    assert tree.space.is_flat != wraps
    begin, end = tree.forward(np.array([tree.lower, tree.upper]))
    assert (np.abs(begin - end).max() < 1e-9) == wraps


@pytest.mark.parametrize("seed", range(3))
def test_accepted_motions_across_half_a_turn_are_free_all_along(seed: int, tmp_path: Path) -> None:
    env = turntable(tmp_path, WALL, *elbow())
    model, rng = env.collision_model(), np.random.default_rng(seed)
    accepted = 0
    for a in rng.uniform(env.lower, env.upper, (150, 2)):
        b = rng.uniform(env.lower, env.upper)
        compiled = bool(env.paths_are_free([np.array([a, b])], 2e-3)[0])
        exact = model.segment_is_free(a, b)
        assert exact or not compiled
        if exact:
            accepted += 1
            t = np.linspace(0, 1, 300)
            q = env.space.interpolate(np.tile(a, (300, 1)), np.tile(b, (300, 1)), t)
            assert (env.clearance(q) > 0).all()
    assert 15 < accepted < 135


def test_an_arm_without_such_joints_is_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(link("a"), link("b"), joint("ab", "a", "b")))
    tree, parts = read_urdf(tmp_path / "arm.urdf")
    env = ArmWorld(Arm(tree, parts, True), [], "arm")
    path = np.array([[-1.9], [1.4]])
    assert tree.space.unwrapped(path) is path
    assert env.space.is_flat
    assert not {"wraps", "tree"} & set(env.definition())
