"""Where a refused path first collides, and what with."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
import turning_cubes
from arms import arm_file, arm_of, at, ball, turning
from bad_urdfs import LIMIT, collision, joint, link

import bench
import envs
from bench.judging.contact import Contact
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from envs.collision.shapes import Cylinder, PlacedShape, Sphere
from envs.problem import Array
from envs.robots.arm import Part
from envs.scenes.arm_world import ArmWorld

NEAR = 1.1e-3
"""How much earlier than it touches a path may be refused, in workspace units."""


def contact_on(env: Environment, *waypoints: object) -> Contact:
    """Of a path that collides."""
    path = np.array(waypoints, dtype=float)
    judgement = bench.judge(env, Problem(path[0], path[-1]), path)
    assert judgement.verdict is Verdict.COLLISION
    assert judgement.contact is not None
    assert judgement.reason == f"not proved free of collision: {judgement.contact}"
    assert judgement.contact.distance >= 0
    return judgement.contact


def above_and_below(env: Environment, gap: float) -> tuple[Array, Array]:
    """Places beyond the upper and lower side of the first box."""
    box = env.obstacles[0]
    away = np.array([0, 0, box.solid.sides[2] / 2 + gap])  # type: ignore[attr-defined]
    middle = box.pose[:3, 3] + (0 if box.solid.offset is None else box.solid.offset)
    return middle + away, middle - away


def test_a_point_robot_comes_into_a_box() -> None:
    env = envs.make("c3d:boxes=1")
    start, goal = above_and_below(env, 0.5)
    found = contact_on(env, start, start, goal)
    assert found.between == ("the robot", "obstacle 1 (a box)")
    radius = env.robot.shapes[0].radius  # type: ignore[attr-defined]
    assert found.share == pytest.approx((0.5 - radius) / (start[2] - goal[2]), abs=NEAR)
    assert found.configuration == pytest.approx(start - [0, 0, 0.5 - radius], abs=NEAR)
    assert found.waypoint == 1
    assert found.text.startswith("the robot comes within 0.00")
    assert found.text.endswith(" units of obstacle 1 (a box)")
    assert f"{found.share:.1%} along the path, at or after waypoint 1" in str(found)


def test_a_start_in_a_box_touches_it() -> None:
    env = envs.make("c3d:boxes=1")
    start, goal = above_and_below(env, -0.1)
    found = contact_on(env, start, goal)
    assert (found.share, found.waypoint, found.distance) == (0, 0, 0)
    assert found.text == "the robot touches obstacle 1 (a box)"


def test_an_arms_upper_link_hits_the_second_of_two_obstacles(tmp_path: Path) -> None:
    bar = collision('<box size="0.5 0.05 0.05"/>', '<origin xyz="0.25 0 0"/>')
    elbow = joint("elbow", "upper", "fore", "revolute", '<origin xyz="0.53 0 0"/>' + LIMIT, "0 0 1")
    file = arm_file(
        tmp_path,
        *(link("base", ""), link("upper", bar), link("fore", bar), elbow),
        joint("shoulder", "base", "upper", axis="0 0 1"),
    )
    wall = "{box: [0.3, 0.06, 0.5], position: [0.35, 0, 0]}"
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"obstacles: [{{sphere: 0.1, position: [-2, 0, 0]}}, {wall}]")
    env = envs.make(f"arm:urdf={file},scene={scene}")
    found = contact_on(env, [1.4, 0.0], [1.2, 0.0], [0.0, 0.0])
    assert found.between == ("link 'upper'", "obstacle 2 (a box)")
    # Its lower side, 0.025 off the middle line, comes to the wall's corner at (0.2, 0.03).
    angle = math.atan2(0.03, 0.2) + math.asin(0.025 / math.hypot(0.03, 0.2))
    assert found.configuration == pytest.approx([angle, 0], abs=NEAR / 0.2)
    assert found.share == pytest.approx(1 - found.configuration[0] / 1.4)
    assert found.waypoint == 1
    assert " m of obstacle 2" in found.text


def test_an_arm_hits_itself() -> None:
    arm = arm_of(
        [turning("y", at(0, 0, 0.2)), turning("y", at(0, 0, 0.4))],
        Part(1, PlacedShape(Cylinder(0.03, 0.3), at(0, 0, 0.25))),
        ball(2, 0.05, 0, 0, 0.5),
        ball(0, 0.1, 0, 0, 0),
        self_collision=True,
    )
    env = ArmWorld(arm, [PlacedShape(Sphere(0.1), at(5, 0, 0))], "test")
    found = contact_on(env, [0.0, 0.0], [0.0, 3.0])
    assert found.between is not None
    assert set(found.between) == {"link 'l2'", "link 'l0'"}
    # The tip is 0.5 from the elbow, which is 0.6 above the base.
    angle = math.acos(((0.05 + 0.1) ** 2 - 0.5**2 - 0.6**2) / (2 * 0.5 * 0.6))
    assert found.configuration == pytest.approx([0, angle], abs=NEAR / 0.2)


@pytest.mark.parametrize("part", [1, 2])
def test_a_part_of_a_rigid_body_meets_a_box(part: int) -> None:
    """An L beside a box from above: of its bars, the first with y from -1 to -0.7, the second
    from there to 1, one alone is below it."""
    env = envs.make("rigid:world=c3d,boxes=1,body=l,space=r3,size=2")
    upper, lower = above_and_below(env, 2.0)
    half = env.obstacles[0].solid.sides[1] / 2  # type: ignore[attr-defined]
    beside = np.array([0, half + 0.8 if part == 1 else 0.6 - half, 0])
    found = contact_on(env, lower + beside, upper + beside)
    assert found.between == (f"part {part} of the body", "obstacle 1 (a box)")
    assert found.configuration == pytest.approx(lower + beside + [0, 0, 2.0 - 0.15], abs=NEAR)


@pytest.mark.slow
def test_a_body_within_a_mesh_touches_nothing(tmp_path: Path) -> None:
    trimesh.creation.box((6.0, 6.0, 6.0)).export(tmp_path / "block.ply")
    world = f"mesh,file={tmp_path / 'block.ply'}"
    env = envs.make(f"rigid:world={world},body=box,space=r3,size=1")
    found = contact_on(env, [0, 0, 0], [0.5, 0, 0])
    assert found.between is None
    assert (found.share, found.waypoint) == (0, 0)
    assert found.distance > 1
    assert found.text.startswith("the robot touches nothing, but is within a closed mesh")


def test_a_ball_outside_the_rooms_is_told_so(tmp_path: Path) -> None:
    room = trimesh.creation.box((6.0, 6.0, 2.0))
    room.invert()
    room.export(tmp_path / "room.ply")
    env = envs.make(f"mesh:file={tmp_path / 'room.ply'}")
    found = contact_on(env, [0, 0, 8], [1, 0, 8])  # it is 20 wide and 20 / 3 high
    assert found.between is None
    assert found.text == "the robot touches nothing, but is outside the rooms"


def test_a_robot_without_names_has_numbers() -> None:
    """The right of two cubes at the ends of a rod, that goes up into a third."""
    found = contact_on(turning_cubes.Plane(), [0, 0, math.pi / 2], [0, 3, math.pi / 2])
    assert found.between == ("shape 2", "obstacle 1 (a cube)")
    assert found.configuration[1] == pytest.approx(2.5 - 0.2 - 1, abs=NEAR)
    assert found.share == pytest.approx(found.configuration[1] / 3)


def test_others_have_no_contact() -> None:
    env = envs.make("c3d:boxes=1")
    start, goal = above_and_below(env, 0.5)
    valid = bench.judge(env, Problem(start, start + 0.1), [start, start + 0.1])
    assert (valid.verdict, valid.contact) == (Verdict.VALID, None)
    wrong = bench.judge(env, Problem(start, goal), [start, start])
    assert (wrong.verdict, wrong.contact) == (Verdict.WRONG_ENDPOINT, None)
    assert bench.judge(env, Problem(start, goal), None).contact is None
    in_a_run = Judge(env)(Problem(start, goal), np.array([start, goal]))
    assert in_a_run.contact is None, "which costs time"
    assert in_a_run.reason == "not proved free of collision"
