"""How near the links of arms are to each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arms import (
    arm_of,
    at,
    ball,
    configurations,
    fcl_only,
    turning,
)

import envs
from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Cylinder, PlacedShape, Sphere
from envs.robots.arm import Arm, Part
from envs.scenes.arm_world import ArmWorld


def gripper(self_collision: bool) -> Environment:
    """Upper arm 0.4 up from a shoulder at a height of 0.2, forearm of 0.5 with a ball at its end:
    folded back by pi, the ball is in the base."""
    arm = arm_of(
        [turning("y", at(0, 0, 0.2)), turning("y", at(0, 0, 0.4))],
        Part(1, PlacedShape(Cylinder(0.03, 0.3), at(0, 0, 0.25))),
        ball(1, 0.06, 0, 0, 0.4),
        ball(2, 0.06, 0, 0, 0.02),  # touches the upper arm at all times
        ball(2, 0.05, 0, 0, 0.5),
        ball(0, 0.1, 0, 0, 0),
        self_collision=self_collision,
    )
    return ArmWorld(arm, [PlacedShape(Sphere(0.1), at(5, 0, 0))], "test")


STRAIGHT, FOLDED = np.array([0.0, 0.0]), np.array([0.0, math.pi])


def test_a_folded_arm_hits_itself() -> None:
    world = gripper(self_collision=True)
    for model in (world.collision_model(), fcl_only(world)):
        assert model.is_valid(STRAIGHT)
        assert not model.is_valid(FOLDED)
        assert model.clearance(FOLDED) <= 0
        assert not model.segment_is_free(STRAIGHT, FOLDED)
        assert model.segment_is_free(STRAIGHT, FOLDED / 2)
    assert world.clearance(FOLDED[None])[0] < 0
    assert world.approximate_clearance(FOLDED[None])[0] < 0
    paths = [np.array([STRAIGHT, FOLDED]), np.array([STRAIGHT, FOLDED / 2])]
    assert world.paths_are_free(paths, 1e-3).tolist() == [False, True]


def test_without_self_collision_a_folded_arm_does_not() -> None:
    world = gripper(self_collision=False)
    assert world.robot.pairs == ()
    model = world.collision_model()
    assert model.is_valid(FOLDED)
    assert model.segment_is_free(STRAIGHT, FOLDED)
    assert world.approximate_clearance(FOLDED[None])[0] > 4
    assert len(world.robot.parts) == world.robot.moving == 4, "the base meets nothing"


def test_clearances_between_links_are_known() -> None:
    """The far ball of the forearm and the base; the near one turns in place."""
    world = gripper(self_collision=True)
    model = fcl_only(world)
    assert model.clearance(STRAIGHT) == pytest.approx(0.62 - 0.16)
    for bend in (2.6, 2.9, 3.0):
        tip = np.array([0.5 * math.sin(bend), 0.6 + 0.5 * math.cos(bend)])
        expected = np.linalg.norm(tip) - 0.15
        assert expected < 0.46
        found = model.clearance(np.array([0, bend]))
        assert found == pytest.approx(expected, abs=1e-9) if bend < 3 else found <= 0
        rough = world.approximate_clearance(np.array([[0, bend]]))[0]
        assert rough == pytest.approx(max(expected, 0), abs=1e-8), "between links it is exact"
        assert (rough < 0) == (expected < 0)


def test_neighbours_may_touch() -> None:
    arm = gripper(self_collision=True).robot
    parts = arm.parts
    named = {(parts[a].body, parts[b].body) for a, b in arm.pairs}
    assert named == {(2, 0)}
    assert all(a < arm.moving for a, _ in arm.pairs)
    assert len(arm.pairs) == 2, "both balls, although the one at the elbow cannot come to the base"


def test_links_without_solids_between_them_do_not_part_neighbours() -> None:
    joints = [turning("y", at(0, 0, 0.1)) for _ in range(4)]
    solids = [ball(0, 0.1, 0), ball(2, 0.1, 0), ball(4, 0.1, 0)]
    arm = arm_of(joints, *solids, self_collision=True)
    assert [(arm.parts[a].body, arm.parts[b].body) for a, b in arm.pairs] == [(4, 0)]


def folding(base: Part) -> Arm:
    """A forearm of 0.2 above a base at first, and in it when the elbow is turned by pi."""
    return arm_of(
        [turning("z", at(0, 0, 0.05)), turning("y", at(0, 0, 0.1))],
        ball(1, 0.02, 0, 0, 0.05),
        Part(2, PlacedShape(Cylinder(0.02, 0.2), at(0, 0, 0.15))),
        base,
        self_collision=True,
    )


def test_links_that_always_touch_do_not_count() -> None:
    """The ball of the base goes up to the elbow and beyond."""
    arm = folding(ball(0, 0.25, 0))
    assert arm.pairs == ()
    assert CollisionModel(arm, []).is_valid(np.zeros(2))


def test_links_that_touch_at_times_count() -> None:
    """A wide and flat base."""
    arm = folding(Part(0, PlacedShape(Cylinder(0.3, 0.02), np.eye(4))))
    model = CollisionModel(arm, [])
    assert model.is_valid(np.zeros(2))
    assert not model.is_valid(np.array([0, math.pi]))


def test_a_part_that_moves_is_needed() -> None:
    with pytest.raises(ValueError, match="no link that moves"):
        arm_of([turning("z")], ball(0, 0.1, 0))


def test_clearance_changes_no_faster_than_the_motion_bound_among_links() -> None:
    env = envs.make("arm4:self_collision=true")
    rng = np.random.default_rng(6)
    for a in configurations(env, 200, 7):
        b = a + rng.normal(0, 0.1, env.dimension)
        change = np.abs(np.diff(env.clearance(np.array([a, b]))))[0]
        assert change <= env.robot.motion_bound(a, b) + 1e-4
