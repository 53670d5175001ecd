"""Robots and scenes as plain data say what the environment has."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import has_data
from made_robots import let_links_touch_obstacles, made_tree_world

import envs
from envs import Environment
from envs.collision.shapes import Box, Capsule
from envs.plain_scene import PlainScene
from envs.scenes.arm_world import ArmWorld
from planners.peers.kinematics import link_poses


def scene_of(env: Environment) -> PlainScene:
    scene = env.plain_scene
    assert scene is not None
    return scene


def sent(scene: PlainScene) -> PlainScene:
    """As it is after it was sent as text and numbers."""
    data, numbers = scene.packed()
    return PlainScene.of(json.loads(json.dumps(data)), numbers)


def made_arm_world(folder: Path, seed: int) -> ArmWorld:
    text, _ = made_tree_world(folder, seed)
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    return env


@pytest.mark.parametrize("seed", range(12))
def test_links_of_any_tree_are_where_the_robot_has_them(tmp_path: Path, seed: int) -> None:
    env = made_arm_world(tmp_path, seed)
    robot, scene = env.robot, sent(scene_of(env))
    of_link = {link.name: list(link.solids) for link in scene.robot.links}
    assert sum(map(len, of_link.values())) == len(robot.parts)
    for q in env.space.sample(np.random.default_rng(seed), 5):
        poses = link_poses(scene.robot, q)
        left = {name: iter(solids) for name, solids in of_link.items()}
        for link, part, pose in zip(robot.links, robot.parts, robot.poses(q), strict=True):
            solid = next(left[link])
            whole = np.vstack([pose, [0, 0, 0, 1]])
            expected = part.placed.solid.plain(whole)
            np.testing.assert_allclose((poses[link] @ solid.pose), expected.pose, atol=1e-9)
            assert (solid.kind, solid.sizes) == (expected.kind, expected.sizes)
            assert np.array_equal(solid.triangles, expected.triangles)


@pytest.mark.parametrize("seed", range(6))
def test_what_may_touch_is_what_is_not_checked(tmp_path: Path, seed: int) -> None:
    made_tree_world(tmp_path, seed)
    let_links_touch_obstacles(tmp_path, seed)
    env = made_arm_world(tmp_path, seed)
    robot, scene = env.robot, sent(scene_of(env))
    links = {link.name: link for link in scene.robot.links}
    checked = {frozenset((robot.links[i], robot.links[j])) for i, j in robot.pairs}
    for link in links.values():
        for other in links.values():
            if link.solids and other.solids and link is not other:
                apart = frozenset((link.name, other.name)) in checked
                assert (other.name in link.touches) != apart
    may = env.may_touch
    for part in range(robot.moving):
        touched = links[robot.links[part]].touches_obstacles
        for number, name in enumerate(scene.names):
            if name in touched:
                assert may is not None
                assert may[part, number]


def test_a_scene_comes_as_it_was_sent() -> None:
    scene = scene_of(envs.make("arm6:scene=2,self_collision=true"))
    data, numbers = scene.packed()
    again, same = sent(scene).packed()
    assert again == data
    assert np.array_equal(same, numbers)
    assert scene.names == sent(scene).names
    assert len(set(scene.names)) == len(scene.obstacles)


def test_a_ball_has_a_radius_and_no_joints(c3d: Environment) -> None:
    scene = sent(scene_of(c3d))
    assert scene.robot.radius == c3d.robot.shapes[0].bounding_sphere()[1]
    assert not scene.robot.joints
    assert [solid.kind for solid in scene.obstacles] == ["box"] * len(c3d.obstacles)
    np.testing.assert_array_equal(scene.lower, c3d.lower)


def test_a_box_beside_its_frame_stays_where_it_is() -> None:
    box = Box(np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.4, 0.6]))
    pose = np.eye(4)
    pose[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    plain = box.plain(pose)
    np.testing.assert_allclose(plain.pose[:3, 3], [-2.0, 1.0, 3.0])
    assert plain.sizes == {"size": (0.2, 0.4, 0.6)}


def test_a_capsule_is_a_cylinder_and_two_balls() -> None:
    pose = np.eye(4)
    pose[:3, 3] = [0.5, 0, 0]
    pieces = Capsule(0.1, 0.8).plain(pose).pieces()
    assert [piece.kind for piece in pieces] == ["cylinder", "sphere", "sphere"]
    np.testing.assert_allclose([p.pose[2, 3] for p in pieces], [0.0, -0.4, 0.4])
    assert all(piece.sizes["radius"] == (0.1,) for piece in pieces)


@pytest.mark.parametrize("robot", ["panda", "ur5", "fetch", "baxter"])
def test_scenes_of_a_set_have_the_robots_name_and_the_objects(robot: str) -> None:
    if not has_data(f"mbm/{robot}/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    sets = {"baxter": "bookshelf_tall_both_arms_easy"}
    env = envs.make(f"mbm:robot={robot},set={sets.get(robot, 'box')}")
    [problem] = env.problems_at([0], 0)
    scene = scene_of(env.scene_of(problem))
    assert scene.robot.name == robot
    assert {"Can1"} <= set(scene.names)
    assert scene.fingerprint == env.scene_of(problem).fingerprint
    assert scene.fingerprint != scene_of(env).fingerprint
