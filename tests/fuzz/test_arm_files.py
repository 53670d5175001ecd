"""URDFs and scenes for arms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_urdfs import LIMIT, collision, joint, link, robot
from fuzzing import fuzzed
from mutations import contents

from envs.collision.shapes import PlacedShape
from envs.robots.arm import Part
from envs.robots.base_placement import BasePlacement
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import read_srdf
from envs.robots.urdf import read_urdf
from envs.scenes.scene_file import Scene, read_scene

MESH = '<mesh filename="package://arm/meshes/cube.stl" scale="0.1 0.1 0.2"/>'

URDFS = (
    robot(
        link("base"),
        link(
            "upper", collision('<cylinder radius="0.04" length="0.4"/>', '<origin xyz="0 0 0.2"/>')
        ),
        link(
            "fore",
            collision('<box size="0.05 0.05 0.3"/>')
            + collision('<sphere radius="0.1"/>')
            + collision('<capsule radius="0.05" length="0.2"/>'),
        ),
        link("tool", ""),
        joint("shoulder", "base", "upper", inside='<origin xyz="0 0 0.1" rpy="0 1.5 0"/>' + LIMIT),
        joint("elbow", "upper", "fore", "prismatic", axis="0 1 0"),
        joint("held", "fore", "tool", "fixed", '<origin rpy="0 0 -3.1"/>'),
    ),
    robot(
        '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>',
        link("a", collision(MESH) + "<inertial><mass value='1'/></inertial>"),
        link("b", collision('<mesh filename="cube.stl"/>')),
        link("c", "<visual><geometry><sphere radius='1'/></geometry></visual>" + collision(MESH)),
        joint("ab", "a", "b", "continuous", "<dynamics damping='0.1' friction='0'/>", "1 0 0"),
        joint("bc", "b", "c", inside='<mimic joint="ab" multiplier="-2"/>', axis="0 0.7 -0.7"),
        '<transmission name="t"><type>x</type><joint name="ab"/></transmission>',
    ),
    robot(
        *(link("world", ""), link("body"), link("arm"), link("tool", "")),
        joint("float", "world", "body", "floating", '<origin rpy="0 0 1"/>' + LIMIT),
        joint("turn", "body", "arm", inside='<limit lower="-1e16" upper="1e16"/>', axis="0 1 0"),
        joint("held", "arm", "tool", "fixed", ""),
    ),
)

TREE = robot(
    *(link("world", ""), link("base"), link("hand"), link("left"), link("right")),
    joint("drive", "world", "base", "planar", LIMIT),
    joint("arm", "base", "hand", "continuous", axis="0 0 1"),
    joint("open", "hand", "left", "prismatic", LIMIT, "0 1 0"),
    joint("follow", "hand", "right", inside='<mimic joint="open" multiplier="-1" offset="2"/>'),
)

SRDFS = (
    """<robot name="arm">
    <group name="all"><group name="arm"/><link name="left"/><joint name="arm"/></group>
    <group name="arm"><chain base_link="base" tip_link="hand"/></group>
    <group_state name="up" group="arm"><joint name="arm" value="-0.5"/></group_state>
    <virtual_joint name="in_world" type="floating" parent_frame="world" child_link="base"/>
    <disable_collisions link1="left" link2="right" reason="Never"/>
    <disable_default_collisions link="hand"/><enable_collisions link1="hand" link2="base"/>
    </robot>""",
    """<robot name="arm"><group name="all"><joint name="in_world"/><joint name="arm"/></group>
    <virtual_joint name="in_world" type="planar" parent_frame="odom" child_link="world"/>
    <group_state name="up" group="all"><joint name="drive" value="0.5 1 -2"/></group_state></robot>
    """,
    """<robot name="arm"><group name="all"><joint name="arm"/></group>
    <virtual_joint name="in_world" type="floating" parent_frame="odom" child_link="world"/>
    <group_state name="up" group="all"><joint name="in_world" value="0 0 1 0 0 0.6 0.8"/>
    <joint name="drive" value="0.5 1 -2"/></group_state></robot>""",
)

SCENES = (
    "obstacles:\n"
    "  - box: [0.3, 0.1, 0.4]      # full sides\n"
    "    position: [0.5, 0, 0.2]\n"
    "    rpy: [0, 0, 0.7]\n"
    "  - cylinder: [0.05, 0.8]\n"
    "    position: [-0.3, 0.3, 0.4]\n"
    "  - sphere: 0.1\n"
    "  - capsule: [0.02, 0.3]\n"
    "  - mesh: cube.stl\n"
    "    scale: 0.001\n"
    "    position: [0, -0.6, 0.2]\n",
    "obstacles: [{sphere: 0.01, position: &p [1, 2, 3]}, {box: [1, 2, 3], rpy: *p}]\n",
    '{"obstacles": [{"cylinder": [1, 2.5], "rpy": [0, 1.5708, 0]}, {"mesh": "cube.stl"}]}',
    "obstacles:\n"
    "  - {hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0e-3]], name: rock}\n"
    "  - {hull: cube.stl, scale: 0.1, name: crate}\n"
    "allowed_collisions:\n"
    "  - [left_finger, right_finger]\n"
    "  - [hand, crate]\n",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With the mesh of a cube."""
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "cube.stl")
    (tmp_path / "arm" / "meshes").mkdir(parents=True)
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "arm" / "meshes" / "cube.stl")
    return tmp_path


def assert_finite(placed: PlacedShape) -> None:
    turn = placed.pose[:3, :3]
    assert np.isfinite(placed.pose).all()
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-9)
    assert placed.definition()


def test_urdfs(folder: Path) -> None:
    file = folder / "arm.urdf"

    def parse(content: bytes) -> tuple[KinematicTree, tuple[Part, ...]]:
        file.write_bytes(content)
        return read_urdf(file)

    def check(arm: tuple[KinematicTree, tuple[Part, ...]]) -> None:
        chain, parts = arm
        assert chain.dimension > 0
        for one in chain.joints:
            assert np.isfinite(one.origin).all()
            assert np.linalg.norm(one.axis) == pytest.approx(0 if one.spherical else 1)
            assert -np.inf < one.lower < one.upper < np.inf
        assert any(part.body > 0 for part in parts)
        for part in parts:
            assert_finite(part.placed)

    fuzzed("URDFs", contents(URDFS), parse, check)


def test_srdfs(folder: Path) -> None:
    (folder / "arm.urdf").write_text(TREE)
    file = folder / "arm.srdf"

    def parse(content: bytes) -> tuple[KinematicTree, frozenset[frozenset[str]]]:
        file.write_bytes(content)
        srdf = read_srdf(file)
        group = PlanningGroup(srdf, "all", state="up")
        placement = BasePlacement.of_numbers((), (-1, -1, 0, 1, 1, 1))
        tree, _ = read_urdf(folder / "arm.urdf", group, placement=placement)
        return tree, srdf.allowed([one.name for one in tree.links])

    def check(found: tuple[KinematicTree, frozenset[frozenset[str]]]) -> None:
        tree, allowed = found
        assert 0 < tree.dimension <= 11
        for one in tree.links:
            assert one.offset[:3, :3] @ one.offset[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        assert all(len(pair) <= 2 for pair in allowed)

    fuzzed("SRDFs", contents(SRDFS), parse, check)


def test_scenes(folder: Path) -> None:
    file = folder / "scene.yaml"

    def parse(content: bytes) -> Scene:
        file.write_bytes(content)
        return read_scene(file)

    def check(scene: Scene) -> None:
        assert len(scene.obstacles) == len(scene.names) > 0
        for placed in scene.obstacles:
            assert_finite(placed)
        assert all(len(set(pair)) == 2 for pair in scene.allowed)

    fuzzed("scenes", contents(SCENES), parse, check)
