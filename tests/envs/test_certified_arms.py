"""The certified checks of arms: against sampling 1000 configurations a segment.

What refutes them knows nothing of how fast arms move nor of the spheres that cover links: spheres
that lie within links and reach into obstacles show collisions at all samples, and FCL is asked
where those come nearest, and at random.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import pytest
from arms import within
from numpy.typing import NDArray

import envs
from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.robots import arm_clearance
from envs.robots.arm import Arm, RobotArrays
from envs.scenes.arm_world import ArmWorld

SAMPLES = 1000
TOLERANCE = 1e-3


def segments(env: Environment, n: int, seed: int, share_near: float = 0.2) -> Array:
    """(n, 2, d), of 0.05 to 3 rad; a share of them start within 3 cm of something, and end within
    0.5 rad."""
    rng = np.random.default_rng(seed)
    count = int(share_near * n)
    near = rng.uniform(env.lower, env.upper, (25 * count, env.dimension))
    clearance = env.approximate_clearance(near)
    near = near[(clearance > 0) & (clearance < 0.03)][:count]
    assert len(near) == count
    a = np.concatenate([near, rng.uniform(env.lower, env.upper, (n - count, env.dimension))])
    way = rng.normal(size=a.shape)
    way /= np.linalg.norm(way, axis=1)[:, None]
    longest = np.where(np.arange(n) < count, 0.5, 3.0)[:, None]
    b = a + way * 0.05 * (longest / 0.05) ** rng.random((n, 1))
    return np.stack([a, np.clip(b, env.lower, env.upper)], axis=1)


def refuted(env: Environment, motions: Array) -> int:
    """How many of some motions (n, 2, d) meet something at one of their samples."""
    assert isinstance(env, ArmWorld)
    arm, model = within(env.robot), CollisionModel(env.robot, env.obstacles)
    rng = np.random.default_rng(0)
    t = np.linspace(0, 1, SAMPLES)[:, None]
    hit = 0
    for some in np.array_split(motions, 1 + len(motions) // 16):
        q = some[:, :1] + t * (some[:, 1:] - some[:, :1])
        above = arm_clearance.clearances(arm, env.scenes, q.reshape(-1, env.dimension))
        above = above.reshape(len(some), SAMPLES)
        for one, least in zip(q, above, strict=True):
            asked = one[least.argmin()], one[rng.integers(SAMPLES)]
            hit += bool(least.min() < 0) or not all(model.is_valid(each) for each in asked)
    return hit


def free_by_proofs(env: Environment, motions: Array) -> NDArray[np.bool_]:
    model = env.collision_model(TOLERANCE)
    return np.array([model.segment_is_free(a, b) for a, b in motions])


def free_by_search(env: Environment, motions: Array) -> NDArray[np.bool_]:
    model = CollisionModel(env.robot, env.obstacles, TOLERANCE)
    return np.array([model.segment_is_free(a, b) for a, b in motions])


def free_by_spheres(env: Environment, motions: Array) -> NDArray[np.bool_]:
    assert isinstance(env, ArmWorld)
    view, scene = env.robot.arrays, env.scenes
    free = [arm_clearance.segment_is_free(view, scene, a, b, TOLERANCE) for a, b in motions]
    return np.array(free)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "n"),
    [("arm6", 10_000), ("arm4", 1000), ("arm5:scene=2", 500), ("arm4:self_collision=true", 800)],
)
def test_never_accepts_what_1000_samples_refute(text: str, n: int) -> None:
    env = envs.make(text)
    motions = segments(env, n, 1)
    by_proofs, by_spheres = free_by_proofs(env, motions), free_by_spheres(env, motions)
    accepted = motions[by_proofs | by_spheres]
    assert 0.3 * n < len(accepted) < 0.7 * n
    assert by_spheres.sum() > 0.7 * by_proofs.sum(), "spheres see most of what is free"
    assert refuted(env, accepted) == 0


class Slowed(Arm):
    """Says that it moves only a share as fast as it may."""

    share = 0.5

    def motion_bound(self, a: Array, b: Array) -> float:
        return super().motion_bound(a, b) * self.share

    @cached_property
    def arrays(self) -> RobotArrays:
        whole = super().arrays
        return whole._replace(reach=whole.reach * self.share)


class Slower(Slowed):
    """Proofs take velocities as they are, and bound accelerations alone by how far links reach: the
    rest of what these do is less."""

    share = 0.25


@pytest.mark.slow
@pytest.mark.parametrize(
    ("free_by", "n", "kind"),
    [
        (free_by_search, 1500, Slowed),
        (free_by_proofs, 3000, Slower),
        (free_by_spheres, 6000, Slowed),
    ],
)
def test_bounds_that_are_too_low_would_be_found_out(
    free_by: Callable[[Environment, Array], NDArray[np.bool_]], n: int, kind: type[Slowed]
) -> None:
    sound, wrong = envs.make("arm4"), envs.make("arm4")
    assert isinstance(wrong, ArmWorld)
    arm = wrong.robot
    wrong.robot = kind(arm.tree, arm.parts, arm.self_collision)
    motions = segments(sound, n, 2, share_near=1)
    motions = motions[free_by(wrong, motions) & ~free_by(sound, motions)]
    assert refuted(sound, motions) > 0
