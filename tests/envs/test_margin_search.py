"""The compiled search for the least clearance, beside the one that asks a collision model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import envs
from envs import Environment
from envs.collision.continuous import UndecidedError
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Box
from envs.problem import Array


def without_searcher(env: Environment) -> CollisionModel:
    return CollisionModel(env.robot, env.obstacles, env.tolerance, env.allowed, env.space)


def paths(env: Environment, n: int, seed: int) -> list[Array]:
    """Of few waypoints and of many, in small steps."""
    rng = np.random.default_rng(seed)
    low, high = env.free_bounds
    found = []
    for k in rng.integers(2, 30, n):
        begin = rng.uniform(low, high)
        steps = rng.normal(size=(k, 3)) * rng.choice([0.1, 0.5, 3.0])
        found.append(np.clip(begin + np.cumsum(steps, axis=0), low, high))
    return found


@pytest.fixture
def room(tmp_path: Path) -> Environment:
    """A ball-shaped room with a ball in it."""
    outer = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    outer.invert()
    inner = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    trimesh.util.concatenate([outer, inner]).export(tmp_path / "room.ply")
    return envs.make(f"mesh:file={tmp_path / 'room.ply'},kind=interior")


def compare(env: Environment, number: int) -> int:
    """How many of some paths are free."""
    model, alone = env.collision_model(), without_searcher(env)
    free = 0
    for path in paths(env, number, seed=5):
        before = model.checks, alone.checks
        found, expected = model.min_clearance(path), alone.min_clearance(path)
        if expected > env.tolerance:
            assert found == expected  # to the last bit
            assert model.checks - before[0] == alone.checks - before[1]
            free += 1
        else:
            assert found <= env.tolerance
    return free


@pytest.mark.parametrize("text", ["c3d", "box", "c3d:scene=3,robot_radius=0.3"])
def test_among_boxes_the_least_clearance_is_the_same(text: str) -> None:
    assert 20 < compare(envs.make(text), 80) < 80


@pytest.mark.slow
def test_among_meshes_the_least_clearance_is_the_same(room: Environment) -> None:
    assert 20 < compare(room, 100) < 100


def test_outside_of_a_room_no_path_is_free(room: Environment) -> None:
    corner = np.array([[-9.9, -9.9, -9.9], [-9.9, -9.9, -9.8]])
    assert room.surface_clearance(corner).min() > 0
    assert room.collision_model().min_clearance(corner) < 0


def test_near_contact_counts_only_if_fcl_agrees(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along a box's side, 2 mm and 2 cm from it."""
    env = envs.make("box:robot_radius=0.5")
    for gap, near in ((2e-3, True), (2e-2, False)):
        path = np.array([[4.5 + gap, -6.0, 0], [4.5 + gap, 6, 0]])
        model = env.collision_model()
        assert model.min_clearance(path) == pytest.approx(gap, abs=env.tolerance)
        with monkeypatch.context() as patch:
            patch.setattr(CollisionModel, "_touch", lambda *_: True)
            assert (model.min_clearance(path) <= 0) == near


def test_near_contact_all_along_is_decided_though_fcl_is_asked_often() -> None:
    """More configurations are near than a searcher may tell of."""
    env = envs.make("box:robot_radius=0.5")
    path = np.array([[4.5 + 1.5e-3, -3.9, 0], [4.5 + 1.5e-3, 3.9, 0]])
    path = np.linspace(*path, 900)
    model, alone = env.collision_model(), without_searcher(env)
    assert model.min_clearance(path) == alone.min_clearance(path) > env.tolerance


def decided(model: CollisionModel, path: Array, most: int) -> float | None:
    """The least clearance, 0 for a collision, None where so many queries do not decide."""
    try:
        found = model.min_clearance(path, most)
    except UndecidedError:
        return None
    return found if found > model.tolerance else 0.0


@pytest.mark.parametrize("most", [1, 5, 40])
def test_few_queries_decide_as_much(most: int) -> None:
    env = envs.make("c3d")
    model, alone = env.collision_model(), without_searcher(env)
    for path in paths(env, 30, seed=6):
        assert decided(model, path, most) == decided(alone, path, most)


@pytest.mark.parametrize("how", ["assigned", "appended", "taken away"])
def test_obstacles_that_a_subclass_changes_count(how: str) -> None:
    """The boxes that `BoxWorld` was made with are in arrays for quick searches and proofs."""
    env = envs.make("box:robot_radius=0.05")
    wall = Box(np.array([0.0, 8.0, 0.0]), np.array([1.0, 2.0, 20.0]))
    if how == "assigned":
        env.obstacles = [*env.obstacles, wall]  # type: ignore[misc]
    elif how == "appended":
        env.obstacles.append(wall)  # type: ignore[attr-defined]
    else:
        env.obstacles = [wall]  # type: ignore[misc]
    model, planners_model = env.collision_model(), env.collision_model(env.planning_tolerance)
    through = np.array([[-6.0, 8.0, 0.0], [6.0, 8.0, 0.0]])
    middle = through - [0.0, 8.0, 0.0]
    is_box_there = how != "taken away"
    assert model.min_clearance(through) <= 0
    assert not planners_model.segment_is_free(*through)
    assert (model.min_clearance(middle) <= 0) == is_box_there
    assert planners_model.segment_is_free(*middle) != is_box_there
