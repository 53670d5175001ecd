"""Clearances along paths, asked all at once, beside those of single configurations."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, ball, turning
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import envs
from envs import Environment
from envs.collision.coherence import _as_seen, _moved
from envs.collision.fcl_model import CollisionModel, _where_allowed
from envs.collision.shapes import Box, Mesh, PlacedShape, Sphere
from envs.problem import Array
from envs.robots.arm import Part
from envs.scenes.arm_world import ArmWorld


def walk(env: Environment, n: int, step: float, seed: int) -> Array:
    """Configurations (n, size), each near the one before."""
    rng = np.random.default_rng(seed)
    corners = env.space.sample(rng, 1 + n // 40)
    long = np.concatenate(
        [
            env.space.interpolate(*np.repeat([[a], [b]], 40, axis=1), np.linspace(0, step, 40))
            for a, b in zip(corners, corners[::-1], strict=True)
        ]
    )
    return long[:n]


def dented() -> Mesh:
    """A ball with a dent: a mesh that is its hull but there."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.08)
    points = np.array(ball.vertices)
    points[0] *= 0.8
    return Mesh(points, np.asarray(ball.faces))


def arm_of_meshes() -> ArmWorld:
    """Two links, dented balls, that must not touch each other, beside a dented ball and a box."""
    joints = [turning("z"), turning("y", at(0.3, 0, 0)), turning("z", at(0.3, 0, 0))]
    parts = [Part(n, PlacedShape(dented(), at(0.1, 0, 0, 0.3, n, 0))) for n in (1, 3)]
    arm = arm_of(joints, *parts, self_collision=True)
    box = PlacedShape(Box(np.zeros(3), np.array([0.1, 0.2, 0.3])), at(0.4, 0.1, 0.2, 0.4, 0.2, 0))
    return ArmWorld(arm, [box, PlacedShape(dented(), at(-0.1, 0.2, 0.1))], "test")


def alone(env: Environment, q: Array) -> Array:
    model = env.collision_model()
    return np.array([model.clearance(one) for one in q])


@pytest.mark.parametrize("text", ["arm4", "arm6:self_collision=true", "rigid"])
@pytest.mark.parametrize("step", [0.05, 1.0])
def test_along_a_path_they_are_the_same_to_the_last_bit(text: str, step: float) -> None:
    env = envs.make(text)
    q = walk(env, 400, step, seed=1)
    expected = alone(env, q)
    found = env.clearance(q)
    touching = expected <= 0
    assert (found[~touching] == expected[~touching]).all()
    assert (found[touching] < 0).all()
    assert 10 < touching.sum() < 390


def test_of_meshes_they_are_the_same_but_for_rounding() -> None:
    env = arm_of_meshes()
    q = np.concatenate([walk(env, 200, 0.2, seed=2), walk(env, 200, 1.0, seed=3)])
    expected, found = alone(env, q), env.clearance(q)
    assert ((found > 0) == (expected > 0)).all()
    assert np.abs(found - expected)[expected > 0].max() < 1e-6
    assert 10 < (expected <= 0).sum() < 390


def in_a_bowl(step: float, n: int) -> tuple[ArmWorld, Array]:
    """A rod on an arm that hangs into a bowl, which is on the arm, too, and turns; and a path of
    it (n, 3)."""
    whole = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    below = whole.triangles_center[:, 2] < 0.03
    bowl = Mesh(np.asarray(whole.vertices), np.asarray(whole.faces)[below])
    made = trimesh.creation.cylinder(0.02, 0.1, sections=24)
    rod = Mesh(np.asarray(made.vertices), np.asarray(made.faces))
    joints = [turning("z"), turning("x", at(0, 0, 0.3)), turning("y")]
    parts = [Part(1, PlacedShape(bowl, np.eye(4))), Part(3, PlacedShape(rod, at(0, 0, -0.3)))]
    arm = arm_of(joints, parts[0], ball(2, 0.01, 0, 0, 0.2), parts[1], self_collision=True)
    t = step * np.arange(n)
    return ArmWorld(arm, [], "test"), np.stack(
        [0.3 * t, 0.2 * np.cos(2 * t) - 0.2, 0.3 * np.sin(t)], axis=1
    )


@pytest.mark.parametrize("step", [0.01, 0.5])
def test_within_a_hull_they_are_the_same(step: float) -> None:
    """Where only surfaces tell, and what is known of the place before."""
    env, q = in_a_bowl(step, 400)
    expected, found = alone(env, q), env.clearance(q)
    assert ((found > 0) == (expected > 0)).all()
    assert np.abs(found - expected)[expected > 0].max() < 1e-9
    assert 10 < (expected <= 0).sum() < 390


def test_what_has_touched_nothing_since_is_not_asked_what_is_within_it() -> None:
    env, q = in_a_bowl(0.01, 20)
    asked = []

    def allowed(some: Array) -> NDArray[np.bool_]:
        asked.append(len(some))
        return np.ones(len(some), dtype=np.bool_)

    model = CollisionModel(env.robot, [], allowed=allowed, allowed_apart=True)
    assert (model.clearances(q, env.robot.poses_along(q)) > 0).all()
    assert sum(asked) == 1


def test_where_it_is_not_allowed_those_that_follow_are_asked() -> None:
    known, follows = np.zeros((2, 6), dtype=np.bool_)
    follows[[1, 2, 4]], known[5] = True, True
    q = np.arange(6.0)[:, None]
    asked = []

    def allowed(some: Array) -> NDArray[np.bool_]:
        asked.extend(some[:, 0].tolist())
        return some[:, 0] > 0.5

    found = _where_allowed(allowed, q, known, follows)
    assert found.tolist() == [False, True, True, True, True, True]
    assert sorted(asked) == [0, 1, 3]


def test_in_any_order_they_are_the_same() -> None:
    env = envs.make("arm5")
    q = env.space.sample(np.random.default_rng(4), 100)
    expected, found = alone(env, q), env.clearance(q)
    assert (found[expected > 0] == expected[expected > 0]).all()


def test_nothing_to_touch_is_infinitely_far() -> None:
    arm = arm_of([turning("z")], Part(1, PlacedShape(Box(np.zeros(3), np.ones(3)), at(1, 0, 0))))
    assert np.isposinf(ArmWorld(arm, [], "test").clearance(np.zeros((3, 1)))).all()
    assert ArmWorld(arm, [], "test").clearance(np.zeros((0, 1))).shape == (0,)


def test_near_contact_counts_only_if_fcl_agrees(monkeypatch: pytest.MonkeyPatch) -> None:
    """A box on an arm that comes to within 2 mm of another."""
    arm = arm_of(
        [turning("z")], Part(1, PlacedShape(Box(np.zeros(3), np.full(3, 0.1)), at(1, 0, 0)))
    )
    wall = PlacedShape(Box(np.zeros(3), np.full(3, 0.1)), at(1.102, 0, 0))
    env = ArmWorld(arm, [wall], "test")
    q = np.linspace(-1, 1, 201)[:, None]
    near = env.clearance(q) <= 5e-3
    assert 0 < near.sum() < 50
    assert (env.clearance(q) > 0).all()
    monkeypatch.setattr(CollisionModel, "_touch", lambda *_: True)
    assert ((env.clearance(q) <= 0) == near).all()


def test_what_is_within_a_closed_mesh_is_not_clear() -> None:
    """A ball on an arm that stands inside of a shell at first, and then outside."""
    shell = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    arm = arm_of([turning("z")], Part(1, PlacedShape(Sphere(0.05), at(1, 0, 0))))
    mesh = Mesh(np.asarray(shell.vertices), np.asarray(shell.faces))
    env = ArmWorld(arm, [PlacedShape(mesh, at(1, 0, 0))], "test")
    assert (env.clearance(np.array([[0.0], [0.01], [2.0]])) > 0).tolist() == [False, False, True]


@pytest.mark.parametrize("seed", range(20))
def test_nothing_is_moved_farther_than_said(seed: int) -> None:
    """Of points of a ball, from pose to pose, and as seen from another that moves, too."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(4, rng=rng).as_matrix()
    small = Rotation.from_rotvec(rng.normal(size=(2, 3)) * 10.0 ** rng.uniform(-4, 0)).as_matrix()
    turns[2:] = turns[:2] @ small
    poses = np.concatenate([turns, rng.normal(size=(4, 3, 1))], axis=2)
    row = np.zeros(32)
    row[9:12], row[15] = rng.normal(size=3), 0.3
    ways = rng.normal(size=(2000, 3))
    points = row[9:12] + row[15] * ways / np.linalg.norm(ways, axis=1, keepdims=True)

    def moved(before: Array, now: Array) -> float:
        shift = (now - before)[:, :3] @ points.T + (now - before)[:, 3:]
        return float(np.linalg.norm(shift, axis=0).max())

    assert 0.9 * _moved(row, poses[0], poses[2]) <= moved(poses[0], poses[2])
    seen = np.empty((2, 3, 4))
    for n in range(2):
        _as_seen(poses[2 * n], poses[2 * n + 1], seen[n])
        there = seen[n][:, :3] @ points.T + seen[n][:, 3:]
        back = poses[2 * n + 1][:, :3] @ there + poses[2 * n + 1][:, 3:]
        assert np.allclose(back, poses[2 * n][:, :3] @ points.T + poses[2 * n][:, 3:])
    for before, now in ((poses[0], poses[2]), (poses[1], poses[3]), (seen[0], seen[1])):
        assert moved(before, now) <= _moved(row, before, now)
