"""Which links may touch, and how far ends of problems keep from others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, ball, turning
from bad_urdfs import LIMIT, collision, joint, link, robot

import envs
from envs import InputError
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Box, Cylinder, Mesh, PlacedShape
from envs.problem import Array
from envs.robots.arm import Part
from envs.scenes.arm_world import ArmWorld

BLOCKS = {
    "base": ((0.16, 0.16, 0.1), (0, 0, 0.05)),
    "turret": ((0.04, 0.04, 0.02), (0, 0, 0.01)),
    "upper": ((0.05, 0.05, 0.3), (0, 0, 0.165)),
    "fore": ((0.04, 0.04, 0.25), (0, 0, 0.15)),
}
"""Sides and middles. The upper arm never touches the base by much, nor for long."""


def turned(name: str, parent: str, child: str, height: float, axis: str) -> str:
    limit = LIMIT.replace("-2", "-2.6").replace("1.5", "2.6")
    return joint(name, parent, child, inside=f'<origin xyz="0 0 {height}"/>{limit}', axis=axis)


def block(folder: Path, name: str, sides: tuple[float, ...], middle: tuple[float, ...], of: str):
    x, y, z = middle
    trimesh.creation.box(sides).export(folder / f"{name}.stl")
    shape = f'<mesh filename="{name}.stl"/>' if of == "mesh" else f'<box size="{sides}"/>'
    shape = shape.replace("(", "").replace(")", "").replace(",", "")
    return link(name, collision(shape, f'<origin xyz="{x} {y} {z}"/>'))


def lifting(folder: Path, of: str) -> ArmWorld:
    """A turret on a base that lifts an upper arm, which may come down on the base."""
    (folder / f"{of}.urdf").write_text(
        robot(
            *(block(folder, name, *sizes, of) for name, sizes in BLOCKS.items()),
            turned("pan", "base", "turret", 0.102, "0 0 1"),
            turned("lift", "turret", "upper", 0.025, "0 1 0"),
            turned("elbow", "upper", "fore", 0.34, "0 1 0"),
        )
    )
    world = envs.make(f"arm:urdf={folder / f'{of}.urdf'}")
    assert isinstance(world, ArmWorld)
    return world


def checked(world: ArmWorld) -> set[tuple[str, str]]:
    robot = world.robot
    return {(robot.links[i], robot.links[j]) for i, j in robot.pairs}


def test_meshes_and_boxes_of_the_same_shape_are_checked_alike(tmp_path: Path) -> None:
    worlds = [lifting(tmp_path, of) for of in ("box", "mesh")]
    expected = {("upper", "base"), ("fore", "base"), ("fore", "turret")}
    assert [checked(world) for world in worlds] == [expected, expected]
    q = np.random.default_rng(0).uniform(worlds[0].lower, worlds[0].upper, (300, 3))
    valid = [[world.collision_model().is_valid(one) for one in q] for world in worlds]
    assert valid[0] == valid[1]
    assert 0.5 < np.mean(valid[0]) < 0.75
    rough = [world.approximate_clearance(q) for world in worlds]
    for found in rough:
        assert (found[np.logical_not(valid[0])] <= 0).all()
    down = np.array([[0.0, -2.5, 0.0], [0.0, 2.5, 0.0]])  # through the base, or over it
    assert not worlds[1].collision_model().segment_is_free(*down)
    assert worlds[1].fingerprint != worlds[0].fingerprint


def test_links_that_are_seldom_in_contact_are_checked() -> None:
    """In one of some 1,000 configurations a pin meets a pin."""
    arm = arm_of(
        [turning("z"), turning("z", at(0, 0, 0.2)), turning("z", at(0, 0, 0.2))],
        ball(1, 0.01, 0, 0, 0.1),
        ball(2, 0.01, 0, 0, 0.1),
        ball(3, 0.002, 0.3, 0, -0.4),
        ball(0, 0.002, 0.3, 0, 0),
        self_collision=True,
    )
    assert (2, 3) in arm.pairs
    assert not CollisionModel(arm, []).is_valid(np.zeros(3))


def test_links_that_almost_always_touch_are_checked() -> None:
    """A finger that is out of a wide ring's board in one position only."""
    sectors = Part(0, PlacedShape(Box(np.array([0.06, 0, 0]), np.array([0.3, 1, 0.1])), np.eye(4)))
    arm = arm_of(
        [turning("z"), turning("z")],
        ball(1, 0.01, 0),
        ball(2, 0.02, 0.12),
        sectors,
        self_collision=True,
    )
    assert (1, 2) in arm.pairs
    q = np.random.default_rng(0).uniform(-3, 3, (1000, 2))
    valid = np.mean([CollisionModel(arm, []).is_valid(one) for one in q])
    assert 0 < valid < 0.3


@pytest.mark.parametrize("outer", [1, 0])
def test_a_link_that_is_always_within_a_mesh_may_be(outer: int) -> None:
    """A shell about a wrist: its surface is never touched."""
    shell = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    shape = PlacedShape(Mesh(shell.vertices, shell.faces), np.eye(4))
    joints = [turning("y"), turning("y"), turning("y")]
    parts = [Part(0, shape), ball(1, 0.02, 0), ball(2, 0.02, 0), ball(3, 0.05, 0.1)]
    if not outer:
        parts = [ball(0, 0.05, 0.1), ball(1, 0.02, 0), ball(2, 0.02, 0), Part(3, shape)]
    arm = arm_of(joints, *parts, self_collision=True)
    ends = {(part.body, other.body) for part, other in pairs_of(arm)}
    assert (3, 0) not in ends


def pairs_of(arm) -> list[tuple[Part, Part]]:
    return [(arm.parts[i], arm.parts[j]) for i, j in arm.pairs]


def test_only_links_that_a_joint_joins_are_neighbours(tmp_path: Path) -> None:
    """A bracket fixed to the base is none of the upper arm's."""
    (tmp_path / "arm.urdf").write_text(
        robot(
            link("base"),
            link("bracket", collision('<box size="0.1 0.1 0.02"/>')),
            link("upper", collision('<box size="0.5 0.02 0.02"/>', '<origin xyz="0.25 0 0"/>')),
            joint("holds", "base", "bracket", "fixed", '<origin xyz="0.3 0 0.2"/>'),
            turned("lift", "base", "upper", 0.1, "0 1 0"),
        )
    )
    world = envs.make(f"arm:urdf={tmp_path / 'arm.urdf'}")
    assert isinstance(world, ArmWorld)
    assert checked(world) == {("upper", "bracket")}
    assert not world.collision_model().is_valid(np.array([-0.33]))


def wrist(of: str, gap: float) -> ArmWorld:
    """Parts of a wrist that are always so far apart, in metres."""
    box = Box(np.zeros(3), np.full(3, 0.03))
    mesh = trimesh.creation.box(box.sides)
    solid = Mesh(mesh.vertices, mesh.faces) if of == "mesh" else box
    arm = arm_of(
        [turning("y", at(0, 0, 0.1)), turning("z", at(0, 0, 0.4)), *[turning("z")] * 2],
        Part(1, PlacedShape(Cylinder(0.03, 0.3), at(0, 0, 0.2))),
        Part(2, PlacedShape(solid, at(0.012, 0, 0))),
        Part(3, PlacedShape(Box(np.zeros(3), np.full(3, 0.01)), np.eye(4))),
        Part(4, PlacedShape(solid, at(-0.012, 0, 0.03 + gap))),
        self_collision=True,
    )
    return ArmWorld(arm, [], "test")


@pytest.mark.parametrize("of", ["box", "mesh"])
def test_wrists_keep_what_they_can(of: str) -> None:
    """18 mm, which the spheres that cover them do not see."""
    world = wrist(of, 0.018)
    assert len(world.robot.pairs) == 3
    problems = world.sample_problems(5, 0)
    ends = np.array([end for p in problems for end in (p.start, p.goal)])
    assert world.clearance(ends) == pytest.approx(0.018, abs=1e-6)
    assert world.approximate_clearance(ends) == pytest.approx(0.018, abs=1e-6)
    assert (world.speed_on_grid(ends) > 0.1).all(), "there is something to learn"
    lines = [np.array([p.start, p.goal]) for p in problems]
    assert world.paths_are_free(lines, 2e-3).all()
    assert min(world.kept[p] for p in world.robot.pairs) > 9e-3, "or planners refuse the ends"


def test_links_too_near_for_any_path_are_named() -> None:
    with pytest.raises(InputError, match="found only 0 of 5 problems") as caught:
        wrist("box", 1e-3).sample_problems(5, 0)
    assert "'l4' and 'l2' to each other in 100%" in str(caught.value).replace(
        "'l2' and 'l4'", "'l4' and 'l2'"
    )
    assert "\n" not in str(caught.value)


def ends_clear(world: ArmWorld, q: Array) -> bool:
    return bool(world.clearance(q).min() >= world.min_clearance)


def test_other_links_keep_all_that_is_asked(tmp_path: Path) -> None:
    world = lifting(tmp_path, "mesh")
    ends = [end for p in world.sample_problems(5, 0) for end in (p.start, p.goal)]
    assert ends_clear(world, np.array(ends))


def test_what_is_too_near_is_told_early(tmp_path: Path) -> None:
    """Which obstacle, and with which link."""
    (tmp_path / "arm.urdf").write_text(
        robot(link("base", ""), link("hand"), joint("j", "base", "hand"))
    )
    scene = tmp_path / "scene.yaml"
    scene.write_text("obstacles: [{sphere: 0.1, position: [3, 0, 0]}, {cylinder: [1, 2]}]")
    world = envs.make(f"arm:urdf={tmp_path / 'arm.urdf'},scene={scene}")
    with pytest.raises(InputError) as caught:
        world.sample_problems(7, 0)
    said = str(caught.value)
    assert "found only 0 of 7 problems" in said
    assert "link 'hand' to obstacle 2 (a cylinder) in 100%" in said


def test_limits_too_narrow_for_any_problem_are_told(tmp_path: Path) -> None:
    narrow = '<limit lower="0" upper="0.5"/>'
    (tmp_path / "arm.urdf").write_text(
        robot(link("base", ""), link("hand"), joint("j", "base", "hand", inside=narrow))
    )
    with pytest.raises(InputError, match="limits are narrower"):
        envs.make(f"arm:urdf={tmp_path / 'arm.urdf'}").sample_problems(2, 0)


def test_fingerprints_follow_the_pairs_that_are_checked() -> None:
    """And arms that may touch themselves keep theirs."""
    wide, thin = (
        ArmWorld(
            arm_of(
                [turning("z"), turning("z", at(0, 0, 0.5))],
                ball(1, 0.02, 0),
                ball(2, 0.02, 0.2),
                ball(0, size, 0, 0, 0.5),
                self_collision=True,
            ),
            [],
            "test",
        )
        for size in (0.5, 0.05)
    )
    assert wide.robot.pairs == ()
    assert thin.definition()["pairs"] == [[1, 2, 0.02]]
    assert "pairs" not in envs.make("arm4").definition()
