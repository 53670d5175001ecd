"""Many configurations of arms at once: those that are told to touch something do."""

from __future__ import annotations

import numpy as np
import pytest
from arms import arm_of, at, turning

import envs
from envs import Environment
from envs.collision.motion_check import LANES, MotionCheck, touching_ends
from envs.collision.shapes import Box, PlacedShape, Solid, Sphere
from envs.robots.arm import Part
from envs.robots.arm_prover import ArmProver
from envs.scenes.arm_world import ArmWorld


def check_of(env: Environment) -> MotionCheck:
    check = env.motion_check(env.planning_tolerance)
    assert check is not None
    return check


def told(check: MotionCheck, ends: np.ndarray) -> np.ndarray:
    """Of bool (LANES,)."""
    mask = touching_ends(check.compiled, np.ascontiguousarray(ends))
    return np.array([mask >> n & 1 == 1 for n in range(LANES)])


@pytest.mark.parametrize("text", ["arm4", "arm6", "arm5:self_collision=true"])
def test_what_is_told_to_touch_does_and_little_else_does(text: str) -> None:
    env = envs.make(text)
    check, model = check_of(env), env.collision_model()
    found = missed = free = 0
    for ends in env.space.sample(np.random.default_rng(4), 60 * LANES).reshape(60, LANES, -1):
        for q, touches in zip(ends, told(check, ends), strict=True):
            if touches:
                found += 1
                assert not model.is_valid(q)
                assert not check.is_free(q, q)
            elif model.is_valid(q):
                free += 1
            else:
                missed += 1
    assert found > 20
    assert free > 100
    if not env.robot.pairs:  # of parts that touch each other it does not tell
        assert missed < found


@pytest.mark.parametrize("solid", [Box((0, 0, 0), (0.4, 0.4, 0.4)), Sphere(0.2)])
def test_each_is_told_of_by_itself(solid: Solid) -> None:
    """A ball on an arm that turns, beside an obstacle at a right angle; also turns of more than one
    round, and places beside."""
    arm = arm_of([turning("z")], Part(1, PlacedShape(Sphere(0.1), at(1, 0, 0))))
    check = check_of(ArmWorld(arm, [PlacedShape(solid, at(0, 1, 0))], "test"))
    angles = np.linspace(-7, 7, LANES)
    angles[3], angles[8], angles[15] = np.pi / 2, np.pi / 2 - 2 * np.pi, np.pi / 2 + 0.25
    hits = np.abs((angles - np.pi / 2 + np.pi) % (2 * np.pi) - np.pi) < 0.28
    assert 3 <= hits.sum() < LANES
    assert np.array_equal(told(check, angles[:, None]), hits)


def test_what_may_be_touched_is_not_told_of() -> None:
    arm = arm_of([turning("z")], Part(1, PlacedShape(Sphere(0.1), at(1, 0, 0))))
    obstacle = PlacedShape(Sphere(0.2), at(1, 0, 0))
    for may_touch in (False, True):
        check = ArmProver(arm, [obstacle], np.array([[may_touch]]), 0.002).motion_check(0.002)
        assert check is not None
        assert told(check, np.zeros((LANES, 1))).all() == (not may_touch)


def test_kinds_that_cannot_be_asked_say_so() -> None:
    for text, has_it in (("arm4", True), ("c3d", False), ("rigid:body=l,space=se2", False)):
        assert (check_of(envs.make(text)).compiled.of_ends != 0) == has_it
