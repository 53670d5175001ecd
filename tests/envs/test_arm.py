"""How fast the parts of arms move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arm_speeds import assert_bounded, bounds_of, greatest_speeds
from arms import (
    ARMS,
    arm_of,
    at,
    ball,
    configurations,
    sliding,
    turning,
)

import envs
from envs.collision.shapes import Box, Cylinder, PlacedShape, Solid, Sphere
from envs.robots.arm import Arm, Part
from envs.robots.kinematic_tree import Joint


def random_arm(rng: np.random.Generator) -> Arm:
    """Joints of both kinds in any places, solids of every kind."""
    joints, parts = [], []
    for body in range(1, int(rng.integers(2, 7))):
        axis = rng.normal(size=3)
        origin = at(*rng.uniform(-0.5, 0.5, 3), *rng.uniform(-3, 3, 3))
        slides = bool(rng.random() < 0.3)
        limit = 0.5 if slides else 3.0
        unit = axis / np.linalg.norm(axis)
        joints.append(Joint(f"j{body}", origin, unit, slides, -limit, limit))
        for _ in range(rng.integers(0, 3)):
            pose = at(*rng.uniform(-0.3, 0.3, 3), *rng.uniform(-3, 3, 3))
            parts.append(Part(body, PlacedShape(random_solid(rng), pose)))
    parts.append(ball(len(joints), 0.05, 0.2))
    return arm_of(joints, *parts)


def random_solid(rng: np.random.Generator) -> Solid:
    a, b, c = rng.uniform(0.02, 0.3, 3)
    solids: list[Solid] = [Sphere(a), Cylinder(a, b), Box(np.zeros(3), np.array([a, b, c]))]
    return solids[rng.integers(3)]


@pytest.mark.parametrize("seed", range(15))
def test_no_point_of_a_random_arm_outruns_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    lower = np.array([one.lower for one in arm.tree.joints])
    for length in 10 ** rng.uniform(-2, 0, 12):
        a, b = rng.uniform(lower, -lower, (2, len(lower)))
        assert_bounded(arm, a, a + length * (b - a))


@pytest.mark.parametrize("name", ARMS)
def test_bounds_on_speeds_are_kept_and_not_far_off(name: str) -> None:
    env, rng = envs.make(name), np.random.default_rng(1)
    shares = []
    for a in configurations(env, 60, 2):
        step = rng.normal(size=env.dimension)
        b = a + 10 ** rng.uniform(-2, 0.5) * step / np.linalg.norm(step)
        shares.append(assert_bounded(env.robot, a, b))
    assert np.median(shares) > 0.6
    assert np.max(shares) > 0.95


def test_speeds_of_one_joint_are_known() -> None:
    """A ball 0.3 off an axis and 0.2 along it: its far side is 0.35 from the axis."""
    arm = arm_of([turning("z", at(1, 2, 3, 0.1, 0.2, 0.3))], ball(1, 0.05, 0.3, 0, 0.2))
    assert arm.rate_bound == pytest.approx(0.35)
    for a, b in ((0.2, 0.7), (1.5, -1.5)):
        bound = arm.motion_bound(np.array([a]), np.array([b]))
        assert bound == pytest.approx(0.35 * abs(b - a))
    (fastest,) = greatest_speeds(arm, np.array([0.2]), np.array([0.7]))
    assert fastest == pytest.approx(0.35 * 0.5, rel=0.02)


def test_speeds_of_a_slide_are_known() -> None:
    arm = arm_of(
        [sliding("x")], ball(1, 0.05, 0.3), Part(1, PlacedShape(Cylinder(0.1, 5.0), np.eye(4)))
    )
    assert arm.rate_bound == 1
    assert bounds_of(arm, np.array([0.9]), np.array([0.2])) == pytest.approx([0.7, 0.7])


@pytest.mark.parametrize(("elbow", "reach"), [(0.0, 0.75), (math.pi / 2, 0.55), (math.pi, 0.15)])
def test_a_folded_arm_is_known_to_be_slower(elbow: float, reach: float) -> None:
    """Upper arm 0.4, a ball of radius 0.05 at 0.3 beyond the elbow; the shoulder alone moves."""
    arm = arm_of([turning("z"), turning("z", at(0.4, 0, 0))], ball(2, 0.05, 0.3))
    a, b = np.array([0.1, elbow]), np.array([0.5, elbow])
    assert arm.motion_bound(a, b) == pytest.approx(0.4 * reach)
    both = np.array([0.5, elbow + 0.2])
    assert arm.motion_bound(a, both) <= 0.4 * 0.75 + 0.2 * 0.35 + 1e-12
    assert arm.rate_bound == pytest.approx(math.hypot(0.75, 0.35))


def test_what_does_not_move_is_never_too_fast() -> None:
    arm = arm_of([turning("z"), turning("y", at(0.4, 0, 0))], ball(1, 0.1, 0.2), ball(2, 0.1, 0.3))
    first, second = bounds_of(arm, np.array([0.3, 0.1]), np.array([0.3, 1.1]))
    assert first == 0
    assert second == pytest.approx(0.4)
    still = np.array([0.3, 0.1])
    assert bounds_of(arm, still, still).tolist() == [0, 0]
