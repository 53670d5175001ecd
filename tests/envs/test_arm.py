"""How fast the parts of arms move."""

from __future__ import annotations

import math

import numpy as np
import pytest
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
from envs.problem import Array
from envs.robots.arm import Arm, Part, part_bounds
from envs.robots.chain import Chain, Joint, Link


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


def greatest_speeds(arm: Arm, a: Array, b: Array, steps: int = 40) -> Array:
    """Of points on each moving part's surface, (moving,): the longest chords by the time they
    take, which is never more than the highest speed."""
    parts = arm.parts[: arm.moving]
    links = tuple(Link("", part.body, part.placed.pose) for part in parts)
    t = np.linspace(0, 1, steps + 1)[:, None]
    poses = Chain(arm.chain.joints, links).forward(a + t * (b - a))
    found = []
    for number, part in enumerate(parts):
        points = part.placed.solid.triangulate().vertices
        turn, shift = poses[:, number, :3, :3], poses[:, number, None, :3, 3]
        places = points @ turn.transpose(0, 2, 1) + shift
        found.append(steps * np.linalg.norm(np.diff(places, axis=0), axis=2).max())
    return np.array(found)


def bounds_of(arm: Arm, a: Array, b: Array) -> Array:
    bounds = np.empty(arm.moving)
    part_bounds(arm.arrays, a, b, bounds)
    return bounds


def assert_bounded(arm: Arm, a: Array, b: Array) -> Array:
    speeds, bounds = greatest_speeds(arm, a, b), bounds_of(arm, a, b)
    assert (speeds <= bounds + 1e-9).all()
    assert arm.motion_bound(a, b) == bounds.max()
    assert bounds.max() <= arm.rate_bound * np.linalg.norm(b - a) + 1e-9
    assert bounds == pytest.approx(bounds_of(arm, b, a))
    return speeds / bounds


@pytest.mark.parametrize("seed", range(15))
def test_no_point_of_a_random_arm_outruns_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    lower = np.array([one.lower for one in arm.chain.joints])
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
