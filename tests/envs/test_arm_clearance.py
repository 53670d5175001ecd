"""How near arms are to obstacles, and paths that are proved free."""

from __future__ import annotations

import fcl
import numpy as np
import pytest
from arms import (
    ARMS,
    arm_of,
    at,
    configurations,
    fcl_only,
    turning,
    within,
)

import envs
from envs import Environment
from envs.collision.checked_pairs import CheckedPairs
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Box, Cylinder, PlacedShape
from envs.problem import Array
from envs.robots import arm_clearance
from envs.robots.arm import Part
from envs.robots.swept_pairs import NONE
from envs.scenes.arm_world import ArmWorld


@pytest.mark.parametrize("scene", [0, 3])
@pytest.mark.parametrize("name", ARMS)
def test_fcl_finds_clearances_between_those_of_spheres_about_and_within(
    name: str, scene: int
) -> None:
    env = envs.make(f"{name}:scene={scene}")
    model = fcl_only(env)
    q = configurations(env, 800, 3)
    exact = np.array([model.clearance(one) for one in q])
    rough = env.approximate_clearance(q)
    above = arm_clearance.clearances(within(env.robot), env.scenes, q)
    free = exact > 0
    assert 200 < free.sum() < 700
    assert (rough[free] <= exact[free] + 1e-9).all()
    assert (rough[~free] <= 0).all()
    assert (above[free] > 0).all()
    assert (exact[free] <= above[free] + 1e-3).all(), "FCL may be a little off among cylinders"
    gap = (exact - rough)[free]
    assert np.median(gap) < 0.002
    assert np.quantile(gap, 0.99) < 0.015
    assert gap.max() < 0.02


@pytest.mark.parametrize("text", ["arm4", "arm6:scene=1", "arm5:self_collision=true"])
def test_a_collision_model_agrees_with_fcl_and_with_each_pair(text: str) -> None:
    env = envs.make(text)
    model, pairs = env.collision_model(), CheckedPairs(env.robot, env.obstacles)
    q = configurations(env, 500, 4)
    valid = np.array([model.is_valid(one) for one in q])
    assert 100 < sum(valid) < 400
    assert [fcl_finds_nothing(env, one) for one in q] == valid.tolist()
    exact = np.array([pairs.nearest(one)[1] for one in q])
    assert ((exact > 0) == valid).all()
    found = np.array([model.clearance(one) for one in q])
    assert found[valid] == pytest.approx(exact[valid], abs=1e-12)
    assert (found[~valid] <= 0).all()
    capped = np.array([model.clearance(one, 0.03) for one in q])
    assert capped[valid] == pytest.approx(np.minimum(found[valid], 0.03), abs=1e-12)
    assert (capped[~valid] <= 0).all()


def fcl_finds_nothing(env: Environment, q: Array) -> bool:
    """Asked of every pair that must not touch, without a broad phase."""
    placed = [
        fcl.CollisionObject(solid.fcl_geometry(), transform(pose, solid.offset))
        for solid, pose in [
            *zip(env.robot.shapes, env.robot.poses(q), strict=True),
            *((obstacle.solid, obstacle.pose) for obstacle in env.obstacles),
        ]
    ]
    return not any(
        fcl.collide(placed[a], placed[b], fcl.CollisionRequest(), fcl.CollisionResult())
        for a, b in CheckedPairs(env.robot, env.obstacles).numbers
    )


def transform(pose: Array, offset: Array | None) -> fcl.Transform:
    shift = pose[:3, 3] if offset is None else pose[:3, 3] + pose[:3, :3] @ offset
    return fcl.Transform(pose[:3, :3], shift)


def test_clearances_of_many_are_those_of_each() -> None:
    env = envs.make("arm4")
    q = configurations(env, 10_000, 5)  # several blocks
    whole = env.approximate_clearance(q)
    picked = np.random.default_rng(0).choice(len(q), 100)
    for text in ("arm4", "arm4:self_collision=true"):
        each = envs.make(text)
        parts = np.empty(each.robot.moving)
        found = each.approximate_clearance(q[picked])
        for one, least in zip(q[picked], found, strict=True):
            view = each.robot.arrays
            assert (
                arm_clearance.part_clearances(view, each.scenes, one, parts, np.inf) == parts.min()
            )
            capped = np.empty(len(parts))
            arm_clearance.part_clearances(view, each.scenes, one, capped, 0.1)
            assert capped == pytest.approx(np.minimum(parts, 0.1), abs=1e-12)
            assert least == pytest.approx(parts.min(), abs=1e-12)
    assert env.approximate_clearance(q[picked]) == pytest.approx(whole[picked], abs=1e-12)
    assert env.approximate_clearance(q[:0]).shape == (0,)


@pytest.mark.parametrize("text", ["arm5", "arm6:self_collision=true"])
def test_an_arm_keeps_so_much_exactly_where_its_clearance_is_more(text: str) -> None:
    world = envs.make(text)
    assert isinstance(world, ArmWorld)
    arm, kept = world.robot.arrays, 5e-3
    q = configurations(world, 2000, 2)
    order = np.arange(arm.moving)
    told = [arm_clearance.keeps(arm, world.scenes, NONE, one, kept, order) for one in q]
    assert told == (arm_clearance.clearances(arm, world.scenes, q) > kept).tolist()
    assert 0.05 < np.mean(told) < 0.95
    assert sorted(order) == list(range(arm.moving)), "each is still asked"


def test_a_box_with_a_centre_of_its_own_is_where_it_says() -> None:
    """And so are spheres that cover it; obstacles as well."""
    off = Box(np.array([1.0, 0, 0]), np.full(3, 0.2))
    obstacle = PlacedShape(Box(np.array([0.0, 0, 0.5]), np.full(3, 0.2)), at(2, 0, -0.5))
    world = ArmWorld(
        arm_of([turning("z")], Part(1, PlacedShape(off, np.eye(4)))), [obstacle], "test"
    )
    q = np.zeros((1, 1))
    assert 0.6 < world.approximate_clearance(q)[0] <= 0.8
    assert fcl_only(world).clearance(q[0]) == pytest.approx(0.8, abs=1e-6)


def test_clearances_are_never_above_the_truth() -> None:
    """Between a rod and a board, points of which are 0.0839206 apart."""
    rod, board = Cylinder(0.04, 0.26), Box(np.zeros(3), np.array([0.3, 0.6, 0.02]))
    there = at(-0.011, -0.374, -0.046, -0.878, 0.426, -0.672)
    arm = arm_of([turning("z")], Part(1, PlacedShape(rod, np.eye(4))))
    model = CollisionModel(arm, [PlacedShape(board, there)])
    assert model.clearance(np.zeros(1)) < 0.0839206 + 1e-4


@pytest.mark.parametrize("name", ["arm4", "arm6"])
def test_paths_that_are_proved_free_are_free(name: str) -> None:
    env = envs.make(name)
    model = fcl_only(env)
    free = configurations(env, 3000, 8)
    free = free[env.approximate_clearance(free) > 0.01][:25]
    steps = np.random.default_rng(9).normal(0, 0.15, (len(free), 2, env.dimension))
    paths = [np.array([q, *(q + step)]) for q, step in zip(free, steps, strict=True)]
    found = env.paths_are_free(paths, 2e-3)
    for path, is_free in zip(paths, found, strict=True):
        if is_free:
            assert model.min_clearance(path) > 5e-4
    assert 3 < found.sum() < 23
    assert env.paths_are_free([], 2e-3).shape == (0,)


def test_a_path_of_one_waypoint_may_collide() -> None:
    env = envs.make("arm4")
    q = configurations(env, 100, 10)
    c = env.approximate_clearance(q)
    paths = [q[c.argmin()][None], q[c.argmax()][None]]
    assert env.paths_are_free(paths, 1e-3).tolist() == [False, True]
