"""Worlds of arms: their problems, the cluttered tables, arms and scenes of users."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from bad_urdfs import LIMIT, collision, joint, link, robot
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from envs import Environment, InputError
from envs.collision.fcl_model import CollisionModel
from envs.collision.primitives import nearest, view_of
from envs.collision.shapes import Box, Cylinder, Placed, Sphere
from envs.collision.surface import surface_points
from envs.robots import connection
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from envs.scenes.tabletop import tabletop

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
    census = env.census(30, 2)
    assert census["share_of_straight_lines_blocked"] >= 0.6
    assert census["share_of_straight_lines_blocked"] == pytest.approx(1 - np.mean(free), abs=0.15)
    assert census["pairs_dropped_as_unsolved"] >= 0


def test_at_least_three_of_five_straight_lines_are_blocked() -> None:
    for name in ARMS:
        env = envs.make(name)
        model = exact(env)
        free = [model.segment_is_free(p.start, p.goal) for p in env.sample_problems(30, 2)]
        for first in range(0, 30, 5):
            assert sum(free[first : first + 5]) <= 2


def test_no_problems_are_none() -> None:
    assert envs.make("arm4").sample_problems(0, 0) == []


def test_ends_are_joined(env: Environment) -> None:
    """By a search that draws other samples than the one that chose them."""
    assert isinstance(env, ArmWorld)
    rng = np.random.default_rng(4)
    for problem in env.sample_problems(8, 5):
        samples = rng.uniform(env.lower, env.upper, (10_000, env.dimension))
        view, scene = env.robot.view, env.scene
        assert connection.joined(view, scene, problem.start, problem.goal, samples)


def post(x: float, radius: float = 0.05) -> Placed:
    pose = np.eye(4)
    pose[0, 3] = x
    return Placed(Cylinder(radius, 1.0), pose)


def arm_file(folder: Path, *elements: str) -> Path:
    file = folder / "arm.urdf"
    file.write_text(robot(*elements))
    return file


TURNING_HAND = (
    link("base", ""),
    link("hand", collision('<sphere radius="0.05"/>', '<origin xyz="0.5 0 0"/>')),
    joint("turn", "base", "hand", "continuous", "", "0 0 1"),
)


def test_what_a_wall_parts_is_not_joined(tmp_path: Path) -> None:
    """A hand that turns about a post does not get from one side of another post to its other."""
    chain, parts = read_urdf(arm_file(tmp_path, *TURNING_HAND))
    world = ArmWorld(Arm(chain, parts, False), [post(0.5)], "test")
    view, scene = world.robot.view, world.scene
    samples = np.random.default_rng(0).uniform(world.lower, world.upper, (200, 1))
    left, right, behind = np.array([[0.6], [-0.6], [3.0]])
    assert connection.joined(view, scene, left, behind, samples)
    assert not connection.joined(view, scene, left, right, samples)
    model = world.collision_model()
    assert model.segment_is_free(left, behind)
    assert not model.segment_is_free(left, right)


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
    view, scene = world.robot.view, world.scene
    left, right = np.array([[0.6, 0.5], [-0.6, 0.5]])
    assert not world.collision_model().segment_is_free(left, right)
    for seed in range(5):
        samples = np.random.default_rng(seed).uniform(world.lower, world.upper, (1000, 2))
        assert connection.joined(view, scene, left, right, samples)


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
    wrist = robot.chain.forward(np.zeros((1, 6)))[0, -1]
    assert wrist[:3, 3] == pytest.approx([-0.8172, -0.2329, 0.0628], abs=1e-9)
    upright = robot.chain.forward(np.array([[0, -math.pi / 2, 0, 0, 0, 0]]))[0]
    assert upright[3, :3, 3] == pytest.approx([0, 0, 0.1625 + 0.425], abs=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_tables_keep_clear_of_the_arm_and_stand_on_the_table(scene: int) -> None:
    table, *things = tabletop(scene)
    assert isinstance(table.solid, Box)
    top = table.pose[2, 3] + table.solid.sides[2] / 2
    assert top == pytest.approx(-0.05)
    view = view_of(things, np.full(3, -2.0), np.full(3, 2.0))
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
        assert 0.2 < (env.rough_clearance(q) > 0).mean() < 0.8
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
    expected = env.rough_clearance(q), env.clearance(q)
    again = pickle.loads(pickle.dumps(envs.make("arm5")))
    assert (again.rough_clearance(q) == expected[0]).all()
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


# Arms and scenes of users


def test_a_users_arm_among_a_users_solids(tmp_path: Path) -> None:
    file = arm_file(tmp_path, *TURNING_HAND)
    (tmp_path / "scene.yaml").write_text("obstacles: [{sphere: 0.1, position: [0.5, 0, 0]}]")
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    assert [*env.lower, *env.upper] == [-math.pi, math.pi]
    (obstacle,) = env.obstacles
    assert isinstance(obstacle, Placed)
    assert obstacle.solid == Sphere(0.1)
    found = env.clearance(np.array([[0.0], [math.pi / 2], [math.pi]]))
    assert found == pytest.approx([0, 0.5 * 2**0.5 - 0.15, 0.85], abs=1e-6)
    for problem in env.sample_problems(5, 0):
        assert env.clearance(np.array([problem.start, problem.goal])).min() >= 0.02
    assert isinstance(env.robot, Arm)
    assert env.robot.self_collision, "unless told otherwise"


def test_with_nothing_about_all_is_free(tmp_path: Path) -> None:
    env = envs.make(f"arm:urdf={arm_file(tmp_path, *TURNING_HAND)}")
    q = np.array([[0.0], [1.0]])
    assert np.isposinf(env.clearance(q)).all()
    assert np.isposinf(env.rough_clearance(q)).all()
    assert env.speed(q).tolist() == [1, 1]
    model = env.collision_model()
    assert model.segment_is_free(env.lower, env.upper)
    assert model.min_clearance(np.array([env.lower, env.upper])) > 1e9


def test_with_nothing_about_there_are_problems(tmp_path: Path) -> None:
    env = envs.make(f"arm:urdf={arm_file(tmp_path, *TURNING_HAND)}")
    assert len(env.sample_problems(7, 0)) == 7
    assert env.census(7, 0)["share_of_straight_lines_blocked"] == 0


def test_too_little_room_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("obstacles: [{box: [2, 2, 2]}]")
    file = arm_file(tmp_path, *TURNING_HAND)
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    with pytest.raises(InputError, match="found only 0 of 3 problems") as caught:
        env.sample_problems(3, 0)
    assert "\n" not in str(caught.value)


def test_ends_that_cannot_be_joined_are_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two posts part the one way there is, and in neither half are ends far enough apart."""
    monkeypatch.setattr(connection, "ITERATIONS", 20)
    entries = [f"{{sphere: 0.1, position: [{x}, {y}, 0]}}" for x, y in ((0.5, 0), (-0.5, 0))]
    (tmp_path / "scene.yaml").write_text(f"obstacles: [{', '.join(entries)}]")
    file = arm_file(tmp_path, *TURNING_HAND)
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    env.min_separation = 2.6  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="joined") as caught:
        env.sample_problems(3, 0)
    assert "\n" not in str(caught.value)


def test_a_table_with_no_blocked_line_has_too_few_problems(tmp_path: Path) -> None:
    class Demanding(ArmWorld):
        most_free_of_five = 2

    chain, parts = read_urdf(arm_file(tmp_path, *TURNING_HAND))
    far = np.eye(4)
    far[0, 3] = 9
    world = Demanding(Arm(chain, parts, False), [Placed(Sphere(0.1), far)], "test")
    with pytest.raises(InputError, match="found only 2 of 3 problems") as caught:
        world.sample_problems(3, 0)
    assert "straight lines" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("arm", "urdf=FILE is needed"),
        ("arm:scene=x.yaml", "urdf=FILE is needed"),
        ("arm:urdf=FOLDER/none.urdf", "none.urdf: no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER/none.yaml", "none.yaml: no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER", "no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER/arm.urdf", "arm.urdf: "),
        ("arm:urdf=FOLDER/bad.urdf", "no limits"),
        ("arm:file=FOLDER/arm.urdf", "has no argument 'file'"),
        ("arm4:scene=-1", "scene must be between"),
        ("arm6:scene=4294967296", "scene must be between"),
        ("arm6:self_collision=perhaps", "not of type bool"),
        ("arm5:model=arm4", "has no argument 'model'"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    arm_file(tmp_path, *TURNING_HAND)
    (tmp_path / "bad.urdf").write_text(
        robot(link("a"), link("b"), joint("j", "a", "b", inside="", axis="0 0 1"))
    )
    with pytest.raises(InputError) as caught:
        envs.make(text.replace("FOLDER", str(tmp_path)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_fingerprints_of_users_worlds_follow_content(tmp_path: Path) -> None:
    chains = {}
    for limit in (LIMIT, LIMIT.replace("1.5", "1.6")):
        file = arm_file(tmp_path, link("a"), link("b"), joint("j", "a", "b", inside=limit))
        for self_collision in ("true", "false"):
            env = envs.make(f"arm:urdf={file},self_collision={self_collision}")
            chains[limit, self_collision] = env.fingerprint
    assert len(set(chains.values())) == 4
    copy = tmp_path / "copy.urdf"
    copy.write_bytes(file.read_bytes())
    assert envs.make(f"arm:urdf={copy}").fingerprint == chains[limit, "true"]
