"""Small arms for tests, and the arms that ship."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from bad_urdfs import collision, joint, link, robot
from scipy.spatial.transform import Rotation

from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import SIZED, Box, Capsule, Cylinder, PlacedShape, Solid, Sphere, Spheres
from envs.problem import Array
from envs.robots.arm import Arm, Part, RobotArrays
from envs.robots.kinematic_tree import Joint, KinematicTree, Link

ARMS = ("arm4", "arm5", "arm6")

TURNING_HAND = (
    link("base", ""),
    link("hand", collision('<sphere radius="0.05"/>', '<origin xyz="0.5 0 0"/>')),
    joint("turn", "base", "hand", "continuous", "", "0 0 1"),
)
"""Elements of an arm: a hand that turns about a post."""


def arm_file(folder: Path, *elements: str) -> Path:
    """A URDF of these elements."""
    file = folder / "arm.urdf"
    file.write_text(robot(*elements))
    return file


def at(x: float, y: float, z: float, *rpy: float) -> Array:
    """A pose (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", rpy or (0, 0, 0)).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


def turning(axis: str, origin: Array | None = None) -> Joint:
    """A joint that turns about an axis."""
    direction = np.eye(3)["xyz".index(axis)]
    return Joint("turns", at(0, 0, 0) if origin is None else origin, direction, False, -3.0, 3.0)


def sliding(axis: str, upper: float = 1.0) -> Joint:
    """A joint that slides along an axis."""
    return Joint("slides", np.eye(4), np.eye(3)["xyz".index(axis)], True, 0.0, upper)


def arm_of(joints: list[Joint], *parts: Part, self_collision: bool = False) -> Arm:
    """An arm whose links are its bodies."""
    links = tuple(
        Link(f"l{body}", body, np.eye(4), f"l{body - 1}" if body else "")
        for body in range(len(joints) + 1)
    )
    return Arm(KinematicTree.serial(tuple(joints), links), parts, self_collision)


def ball(body: int, radius: float, x: float, y: float = 0, z: float = 0) -> Part:
    """A sphere of a body."""
    return Part(body, PlacedShape(Sphere(radius), at(x, y, z)))


def fcl_only(env: Environment) -> CollisionModel:
    """Without quick proofs, asking everywhere whether the robot is where it may be."""
    return CollisionModel(env.robot, env.obstacles, allowed=env.allowed, may_touch=env.may_touch)


def configurations(env: Environment, n: int, seed: int) -> Array:
    """(n, d), within the joints' limits."""
    return np.random.default_rng(seed).uniform(env.lower, env.upper, (n, env.dimension))


def spheres_within(solid: Solid, slack: float) -> Spheres:
    """Spheres that lie within a solid and touch its sides, in place of some that cover it."""
    if isinstance(solid, Sphere):
        return Spheres(np.zeros((1, 3)), np.array([solid.radius]))
    assert isinstance(solid, Cylinder | Capsule | Box)
    if isinstance(solid, Box):
        radius, half = solid.sides.min() / 2, solid.sides / 2
    else:
        beyond = solid.radius if isinstance(solid, Capsule) else 0
        half = np.array([0, 0, solid.length / 2 + beyond])
        radius = min(solid.radius, half[2])
    room = np.maximum(half - radius, 0)
    axes = [np.linspace(-r, r, 1 + math.ceil(2 * r / radius)) for r in room]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Spheres(centers, np.full(len(centers), radius))


def within(arm: Arm) -> RobotArrays:
    """An arm by spheres within its solids: clearances from these are never less than the
    true ones."""
    with pytest.MonkeyPatch.context() as patch:
        for kind in SIZED.values():
            patch.setattr(kind, "sphere_cover", spheres_within)
        arrays = Arm(arm.tree, arm.parts, arm.self_collision).arrays
    return arrays._replace(branches=arm.arrays.branches)
