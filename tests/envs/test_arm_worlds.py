"""Worlds of arms: their problems, and the arms and cluttered tables that ship."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from arms import TURNING_HAND, arm_file
from bad_urdfs import collision, joint, link
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from envs import Environment, InputError
from envs.collision.fcl_model import CollisionModel
from envs.collision.primitive_sdf import nearest, scene_arrays
from envs.collision.shapes import Box, Cylinder, PlacedShape, surface_points
from envs.robots import rrt_connect
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from envs.scenes.arms import tabletop

ARMS = {"arm4": 4, "arm5": 5, "arm6": 6}


@pytest.fixture(params=ARMS, scope="module")
def env(request: pytest.FixtureRequest) -> Environment:
    return envs.make(request.param)


def exact(env: Environment) -> CollisionModel:
    return CollisionModel(env.robot, env.obstacles, allowed=env.allowed)


# Problems


def test_problems_keep_their_promises(env: Environment) -> None:
    problems = env.sample_problems(25, 3)
    model = exact(env)
    assert [p.index for p in problems] == list(range(25))
    assert len({p.seed for p in problems}) == 25
    for problem in problems:
        assert env.contains(np.array([problem.start, problem.goal])).all()
        assert model.clearance(problem.start) >= 0.02
        assert model.clearance(problem.goal) >= 0.02
        assert np.linalg.norm(problem.goal - problem.start) >= 1


def test_more_problems_begin_with_the_fewer(env: Environment) -> None:
    few, many = env.sample_problems(10, 1), env.sample_problems(15, 1)
    assert (len(few), len(many)) == (10, 15)
    again = envs.make(str(env.definition()["problems"][-2])).sample_problems(10, 1)
    for a, b, c in zip(few, many, again, strict=False):
        assert (a.start == b.start).all()
        assert (a.goal == b.goal).all()
        assert (a.start == c.start).all()
        assert (a.goal == c.goal).all()
        assert a.seed == b.seed == c.seed


def test_seeds_and_scenes_have_their_own_problems() -> None:
    starts = {
        tuple(envs.make(f"arm4:scene={scene}").sample_problems(1, seed)[0].start)
        for scene in (0, 1)
        for seed in (0, 1)
    }
    assert len(starts) == 4


def test_most_straight_lines_are_blocked(env: Environment) -> None:
    problems = env.sample_problems(30, 2)
    model = exact(env)
    free = [model.segment_is_free(p.start, p.goal) for p in problems]
    assert any(free), "some are open"
    assert sum(free) <= 12, "60 % are blocked"
    assert env.problem_statistics(30, 2)["pairs_dropped_as_unsolved"] >= 0


def test_at_least_three_of_five_straight_lines_are_blocked() -> None:
    for name in ARMS:
        env = envs.make(name)
        model = exact(env)
        free = [model.segment_is_free(p.start, p.goal) for p in env.sample_problems(30, 2)]
        for first in range(0, 30, 5):
            assert sum(free[first : first + 5]) <= 2


def test_no_problems_are_none() -> None:
    assert envs.make("arm4").sample_problems(0, 0) == []


@pytest.mark.slow
def test_ends_are_joined(env: Environment) -> None:
    """By a search that draws other samples than the one that chose them."""
    assert isinstance(env, ArmWorld)
    rng = np.random.default_rng(4)
    for problem in env.sample_problems(8, 5):
        samples = rng.uniform(env.lower, env.upper, (10_000, env.dimension))
        view, scene = env.robot.arrays, env.scenes
        ends = problem.start, problem.goal
        assert rrt_connect.is_connected(view, scene, *ends, samples, env.planning_tolerance)


def post(x: float, radius: float = 0.05) -> PlacedShape:
    pose = np.eye(4)
    pose[0, 3] = x
    return PlacedShape(Cylinder(radius, 1.0), pose)


def test_what_a_wall_parts_is_not_connected(tmp_path: Path) -> None:
    """A hand that turns about a post does not get from one side of another post to its other, if it
    cannot go round behind."""
    limits = '<limit lower="-3.1" upper="3.1"/>'
    limited = *TURNING_HAND[:2], joint("turn", "base", "hand", "revolute", limits, "0 0 1")
    chain, parts = read_urdf(arm_file(tmp_path, *limited))
    world = ArmWorld(Arm(chain, parts, False), [post(0.5)], "test")
    view, scene = world.robot.arrays, world.scenes
    samples = np.random.default_rng(0).uniform(world.lower, world.upper, (200, 1))
    left, right, behind = np.array([[0.6], [-0.6], [3.0]])
    assert rrt_connect.is_connected(view, scene, left, behind, samples, world.planning_tolerance)
    assert not rrt_connect.is_connected(view, scene, left, right, samples, world.planning_tolerance)
    model = world.collision_model()
    assert model.segment_is_free(left, behind)
    assert not model.segment_is_free(left, right)


def test_what_lies_behind_half_a_turn_is_connected(tmp_path: Path) -> None:
    """The same hand without limits, and what would be straight in numbers is blocked."""
    chain, parts = read_urdf(arm_file(tmp_path, *TURNING_HAND))
    world = ArmWorld(Arm(chain, parts, False), [post(0.5)], "test")
    view, scene = world.robot.arrays, world.scenes
    samples = np.random.default_rng(0).uniform(world.lower, world.upper, (200, 1))
    for left, right in np.array([[[0.6], [-0.6]], [[2.8], [-2.8]]]):
        ends = left, right, samples, world.planning_tolerance
        assert rrt_connect.is_connected(view, scene, *ends)
    walled = ArmWorld(Arm(chain, parts, False), [post(0.5), post(-0.5)], "test")
    assert not rrt_connect.is_connected(view, walled.scenes, left, right, *ends[2:])


def test_ways_around_are_found(tmp_path: Path) -> None:
    """A hand on a slide draws back from the post, turns and reaches out again."""
    file = arm_file(
        tmp_path,
        link("base", ""),
        link("bar", ""),
        link("hand", collision('<sphere radius="0.05"/>')),
        joint("turn", "base", "bar", "continuous", "", "0 0 1"),
        joint("reach", "bar", "hand", "prismatic", '<limit lower="0.1" upper="0.6"/>', "1 0 0"),
    )
    chain, parts = read_urdf(file)
    world = ArmWorld(Arm(chain, parts, False), [post(0.5)], "test")
    view, scene = world.robot.arrays, world.scenes
    left, right = np.array([[0.6, 0.5], [-0.6, 0.5]])
    assert not world.collision_model().segment_is_free(left, right)
    for seed in range(5):
        samples = np.random.default_rng(seed).uniform(world.lower, world.upper, (1000, 2))
        assert rrt_connect.is_connected(view, scene, left, right, samples, world.planning_tolerance)


# The arms and tables that ship


def test_bounds_are_nine_tenths_of_half_a_turn(env: Environment) -> None:
    assert env.dimension == len(env.lower) in ARMS.values()
    assert env.upper == pytest.approx(0.9 * math.pi, abs=1e-12)
    assert (env.lower == -env.upper).all()


@pytest.mark.parametrize("name", ARMS)
def test_an_arm_has_as_many_joints_as_its_name_says(name: str) -> None:
    assert envs.make(name).dimension == ARMS[name]


def test_the_wrist_of_the_sixth_is_where_that_of_a_ur5e_is() -> None:
    robot = envs.make("arm6").robot
    assert isinstance(robot, Arm)
    wrist = robot.tree.forward(np.zeros((1, 6)))[0, -1]
    assert wrist[:3, 3] == pytest.approx([-0.8172, -0.2329, 0.0628], abs=1e-9)
    upright = robot.tree.forward(np.array([[0, -math.pi / 2, 0, 0, 0, 0]]))[0]
    assert upright[3, :3, 3] == pytest.approx([0, 0, 0.1625 + 0.425], abs=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_tables_keep_clear_of_the_arm_and_stand_on_the_table(scene: int) -> None:
    table, *things = tabletop(scene)
    assert isinstance(table.solid, Box)
    top = table.pose[2, 3] + table.solid.sides[2] / 2
    assert top == pytest.approx(-0.05)
    view = scene_arrays(things, np.full(3, -2.0), np.full(3, 2.0))
    away = [nearest(view, 0.0, 0.0, z, np.inf)[0] for z in np.arange(-0.05, 2, 0.01)]
    assert min(away) >= 0.15 + 0.005  # between two of them as well
    points = surface_points(things, 2000, 0)
    assert points[:, 2].min() >= top - 1e-9
    assert np.abs(points[:, :2]).max() < 1.2, "on the table"
    kinds = [type(thing.solid) for thing in things]
    assert (kinds.count(Cylinder), kinds.count(Box), len(things)) == (3, 8, 11)


def test_tables_are_the_same_again_and_no_two_alike() -> None:
    made = [[one.definition() for one in tabletop(scene)] for scene in range(20)]
    assert made == [[one.definition() for one in tabletop(scene)] for scene in range(20)]
    assert len({str(one) for one in made}) == 20


@pytest.mark.parametrize("name", ARMS)
def test_arms_can_stand_upright_and_reach_things(name: str) -> None:
    for scene in range(3):
        env = envs.make(f"{name}:scene={scene}")
        q = np.random.default_rng(scene).uniform(env.lower, env.upper, (3000, env.dimension))
        assert 0.2 < (env.approximate_clearance(q) > 0).mean() < 0.8
        upright = np.zeros((1, env.dimension))
        if name == "arm6":  # at 0 it is stretched out
            upright[0, [1, 3]] = -math.pi / 2
        assert env.clearance(upright)[0] > 0.05


def test_fingerprints_tell_worlds_apart() -> None:
    texts = [f"{name}{rest}" for name in ARMS for rest in ("", ":scene=1", ":self_collision=true")]
    assert len({envs.make(text).fingerprint for text in texts}) == len(texts)
    assert envs.make("arm4:scene=0,self_collision=false").fingerprint == (
        envs.make("arm4").fingerprint
    )


def test_worlds_survive_pickling() -> None:
    env = envs.make("arm5")
    assert isinstance(env, ArmWorld)
    q = np.random.default_rng(0).uniform(env.lower, env.upper, (20, 5))
    expected = env.approximate_clearance(q), env.clearance(q)
    again = pickle.loads(pickle.dumps(envs.make("arm5")))
    assert (again.approximate_clearance(q) == expected[0]).all()
    assert (again.clearance(q) == expected[1]).all()
    assert again.fingerprint == env.fingerprint


def test_speeds_follow_clearances() -> None:
    env = envs.make("arm4")
    q = np.random.default_rng(1).uniform(env.lower, env.upper, (200, 4))
    clearance = env.clearance(q)
    assert env.speed(q) == pytest.approx(env.speed_model(clearance))
    assert (env.speed(q)[clearance > 0.125] == 1).all()
    assert env.speed(q)[clearance < 0] == pytest.approx(0.02)
    assert (env.speed_on_grid(q) <= env.speed(q) + 1e-9).all()


@pytest.mark.parametrize("text", ["arm4", "arm5", "arm6"])
def test_arms_that_may_not_touch_themselves_have_problems(text: str) -> None:
    env = envs.make(f"{text}:self_collision=true")
    assert len(env.sample_problems(5, 0)) == 5


def test_posts_are_as_many_as_asked_and_all_else_stays() -> None:
    def made(posts: int) -> list[object]:
        return [one.definition() for one in tabletop(5, posts)]

    usual = [one.definition() for one in tabletop(5)]
    assert made(3) == usual
    assert len(made(0)) == len(usual) - 3 and all(one in usual for one in made(0))
    assert made(10)[: len(usual)] == usual and len(made(10)) == len(usual) + 7
    assert made(12)[:-2] == made(10)


def test_arms_among_many_posts_have_problems() -> None:
    env = envs.make("arm6:posts=12")
    assert len(env.sample_problems(3, 0)) == 3
    with pytest.raises(InputError, match="posts must be between 0 and 40, not 41"):
        envs.make("arm4:posts=41")
