"""Robots whose checks are compared with exact ones: made at random, and real ones."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

import numpy as np
from exact_bodies import ExactBody
from exact_robots import BASES, ExactArm, RobotFiles, numbered
from made_robots import (
    let_links_touch_obstacles,
    made_body_world,
    made_scene,
    made_tree_world,
)
from motion_agreement import Comparison

import envs
from envs.robots.named_robots import known_robots, robot_named
from envs.scenes.arm_world import ArmWorld
from envs.scenes.rigid_world import RigidWorld

TREES, BODIES, TOUCHING = 50, 12, 20

_OF_MBM = {
    "panda": "panda_arm",
    "ur5": "manipulator",
    "fetch": "arm_with_torso",
    "baxter": "both_arms",
}
"""Planning groups."""


def compared_robots() -> list[str]:
    """The names of all: "tree 3", "touching 3", a tree whose links may touch some obstacles,
    "body 0", "panda", "mbm/fetch", those of MotionBenchMaker if BENCH_DATA has them."""
    counts = {"tree": TREES, "touching": TOUCHING, "body": BODIES}
    made = [f"{kind} {n}" for kind, count in counts.items() for n in range(count)]
    data = os.environ.get("BENCH_DATA")
    of_mbm = [f"mbm/{name}" for name in _OF_MBM] if data else []
    return [*made, *(robot.name for robot in known_robots()), *of_mbm]


def comparison(name: str, folder: Path) -> Comparison:
    """Of a robot, whose files are made in a folder, if it is not a real one.

    Raises:
        AssertionError: other pairs of links must not touch.
    """
    kind, _, seed = name.partition(" ")
    if kind == "body":
        return of_body(made_body_world(folder, int(seed)))
    if kind == "tree":
        return of_arm(*made_tree_world(folder, int(seed)))
    if kind == "touching":
        text, files = made_tree_world(folder, int(seed))
        return of_arm(text, files, let_links_touch_obstacles(folder, int(seed)))
    text, files = _real(name)
    env = _arm_world(text)
    at = env.robot.tree.joints[0].origin[:3, 3]
    scene = made_scene(folder, np.random.default_rng(0), at, 0.8 * env.robot.extent)
    return of_arm(f"{text},scene={scene}", files)


def _real(name: str) -> tuple[str, RobotFiles]:
    """The text of the environment of a real robot, without a scene."""
    family, _, model = name.rpartition("/")
    if not family:
        robot = robot_named(name)
        return f"arm:robot={name}", RobotFiles(robot.urdf, robot.srdf, robot.state)
    folder = Path(os.environ["BENCH_DATA"]) / name
    files = RobotFiles(folder / f"{model}.urdf", folder / f"{model}.srdf")
    return f"arm:urdf={files.urdf},srdf={files.srdf},group={_OF_MBM[model]}", files


def _arm_world(text: str) -> ArmWorld:
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    return env


def of_arm(text: str, files: RobotFiles, contacts: Collection[tuple[str, int]] = ()) -> Comparison:
    """Of a kinematic tree, the text of whose environment has these files, with links that may touch
    obstacles; see `ExactArm`."""
    env = _arm_world(text)
    coordinates = [joint.name for joint in env.robot.tree.coordinates]
    if files.drives:
        base = 3 if files.drives == "planar" else 4
        assert env.space.size == len(coordinates[base:]) + BASES[files.drives]
        coordinates = coordinates[base:]
    exact = ExactArm(files, coordinates, env.obstacles, contacts)
    named = numbered(env.robot.links)
    ours = {frozenset((named[i], named[j])) for i, j in env.robot.pairs}
    differ = exact.leave_out_all_but(ours)
    assert not differ, f"{text}: of these pairs only one check asks: {differ}"
    return Comparison(env, exact)


def of_body(text: str) -> Comparison:
    """Of a rigid body, the text of whose environment this is."""
    env = envs.make(text)
    assert isinstance(env, RigidWorld)
    planar = len(env.lower) == 3 and not env.space.is_flat
    z = float(env.robot.placement.positions(env.lower[None])[0, 2]) if planar else None
    return Comparison(env, ExactBody(env.robot.parts, env.obstacles, z))
