"""MoveIt's planning scenes and motion requests, and what is wrong with them, in a line."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from textwrap import dedent
from typing import Any

import mbm_files as made
import numpy as np
import pytest

import envs
from envs import InputError
from envs.collision.shapes import Box, ConvexHull, Cylinder, Mesh, Sphere
from envs.errors import tell_once
from envs.files.moveit_request import read_motion_request
from envs.files.moveit_yaml import read_planning_scene
from envs.files.planning_scene import PlanningScene

TURNED = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
"""A quarter about z."""


def read(content: Any) -> PlanningScene:
    return read_planning_scene(json.dumps(content).encode(), {"base": np.eye(4)})


def test_primitives_are_where_their_poses_put_them() -> None:
    cylinder = {"type": "cylinder", "dimensions": [0.4, 0.1]}
    ball = {"type": "sphere", "dimensions": [0.2]}
    placed = {"position": [1, 0, 0], "orientation": TURNED}
    things = {
        "id": "things",
        "pose": {"position": [0, 0, 1], "orientation": TURNED},
        "primitives": [cylinder, ball],
        "primitive_poses": [made.pose(0, 0), placed],
    }
    found = read(made.scene(made.box("table", made.pose(0.5, 0), 1, 2, 0.1), things))
    assert found.names == ("table", "things", "things")
    table, can, far = (one.solid for one in found.obstacles)
    assert isinstance(table, Box)
    assert isinstance(can, Cylinder)
    assert isinstance(far, Sphere)
    assert (can.radius, can.length) == (0.1, 0.4), "ROS has the height first"
    places = [one.pose[:3, 3].round(9).tolist() for one in found.obstacles]
    assert places == [[0.5, 0, 0], [0, 0, 1], [0, 1, 1]]
    assert found.obstacles[2].pose[:3, 0].round(9).tolist() == [-1, 0, 0]


OF_ROS = """name: (noname)+
robot_model_name: two
robot_state: {attached_collision_objects: [], is_diff: false}
fixed_frame_transforms:
- header: {frame_id: world}
  child_frame_id: /base
  transform:
    translation: {x: 0.0, y: 0.0, z: 0.0}
    rotation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
allowed_collision_matrix:
  entry_names: [lower, can]
  entry_values:
  - enabled: [false, true]
  - enabled: [true, false]
  default_entry_names: []
  default_entry_values: []
link_padding: [{link_name: upper, padding: 0.0}]
link_scale: [{link_name: upper, scale: 1.0}]
object_colors: []
world:
  collision_objects:
  - header: {frame_id: base}
    pose: &still
      position: {x: 0.0, y: 0.0, z: 1e-03}
      orientation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}
    id: can
    type: {key: '', db: ''}
    primitives:
    - {type: 3, dimensions: [0.4, 0.1], polygon: {points: []}}
    - {type: 4, dimensions: [0.4, 0.1]}
    primitive_poses: [*still, *still]
    meshes:
    - triangles: [{vertex_indices: [0, 2, 1]}, {vertex_indices: [0, 1, 3]},
        {vertex_indices: [0, 3, 2]}, [1, 2, 3]]
      vertices: [{x: 0, y: 0, z: 0}, {x: 1, y: 0, z: 0}, {x: 0, y: 1, z: 0}, [0, 0, 1]]
    mesh_poses: [*still]
    planes: []
    plane_poses: []
    subframe_names: [top]
    subframe_poses: [*still]
    operation: 0
  octomap:
    header: {frame_id: ''}
    origin: *still
    octomap: {binary: false, id: '', resolution: 0.0, data: []}
is_diff: false
---
"""
"""As `ros2 topic echo --once` prints it."""


def test_scenes_are_read_as_ros_prints_them() -> None:
    found = read_planning_scene(OF_ROS.encode(), {"base": np.eye(4)})
    can, cone, mesh = (one.solid for one in found.obstacles)
    assert can == Cylinder(0.1, 0.4)
    assert isinstance(cone, ConvexHull)
    assert np.ptp(cone.vertices, axis=0).round(3).tolist() == [0.2, 0.2, 0.4]
    assert isinstance(mesh, Mesh)
    assert len(mesh.faces) == 4
    assert [one.pose[2, 3] for one in found.obstacles] == [0.002] * 3
    assert found.names == ("can", "can", "can")
    assert found.allowed.allows("can", "lower")
    world = OF_ROS.partition("\nworld:\n")[2].partition("is_diff")[0]
    alone = read_planning_scene(dedent(world).encode(), {"base": np.eye(4)})
    assert alone.names == found.names


def test_frames_are_those_of_links_that_stand_still() -> None:
    moved = np.eye(4)
    moved[:3, 3] = [0, 0, 2]
    table = {**made.box("table", made.pose(1, 0), 1, 1, 1), "header": {"frame_id": "base"}}
    text = json.dumps(made.scene(table)).encode()
    [placed] = read_planning_scene(text, {"base": moved}).obstacles
    assert placed.pose[:3, 3].tolist() == [1, 0, 2]
    of_base = {
        "child_frame_id": "base",
        "transform": {"translation": [0, 0, 2], "rotation": [0, 0, 0, 1]},
    }
    same = made.scene(table, fixed_frame_transforms=[of_base])
    assert read_planning_scene(json.dumps(same).encode(), {"base": moved}).obstacles
    with pytest.raises(InputError, match="frame 'base' is moved"):
        read(same)


def test_frames_are_in_others_that_come_before(tmp_path: Path) -> None:
    def frame(name: str, within: str, x: float) -> dict[str, Any]:
        transform = {"translation": [x, 0, 0], "rotation": TURNED}
        return {"child_frame_id": name, "header": {"frame_id": within}, "transform": transform}

    can = {**made.box("can", made.pose(0, 0), 1, 1, 1), "header": {"frame_id": "b"}}
    found = read(made.scene(can, fixed_frame_transforms=[frame("a", "", 1), frame("b", "a", 2)]))
    assert found.obstacles[0].pose[:3, 3] == pytest.approx([1, 2, 0])
    assert found.obstacles[0].pose[:3, 0] == pytest.approx([-1, 0, 0])
    with pytest.raises(InputError, match="frame 'b' is in frame 'c'; choose from: , base, world"):
        read(made.scene(can, fixed_frame_transforms=[frame("b", "c", 2)]))


def test_the_planning_frame_is_the_worlds_whatever_it_is_called() -> None:
    """MoveIt writes it as a frame in itself."""
    still = {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}
    own = {"child_frame_id": "odom", "header": {"frame_id": "odom"}, "transform": still}
    can = {**made.box("can", made.pose(1, 2), 1, 1, 1), "header": {"frame_id": "odom"}}
    found = read(made.scene(can, fixed_frame_transforms=[own]))
    assert found.obstacles[0].pose[:3, 3].tolist() == [1, 2, 0]


def test_names_may_be_whatever_yaml_has() -> None:
    """A number of more digits than Python writes is not what ends a run."""
    huge = "0x" + "f" * 5000
    text = f"world: {{collision_objects: [{{id: {huge}, header: {{frame_id: {huge}}}}}]}}"
    with pytest.raises(InputError, match="object 'int with too many digits' is in frame"):
        read_planning_scene(text.encode(), {})
    request = f"group_name: {huge}\ngoal_constraints: [{{joint_constraints: [{{joint_name: {huge}, "
    found = read_motion_request(f"{request}position: 1}}]}}]".encode())
    assert found.group == "int with too many digits"


def test_padded_links_are_said(caplog: pytest.LogCaptureFixture) -> None:
    tell_once.cache_clear()
    with caplog.at_level(logging.INFO):
        read(made.scene(link_padding=[{"link_name": "upper", "padding": 0.01}]))
    assert "link_padding is passed over" in caplog.text


def test_arms_stand_in_planning_scenes_whose_matrix_counts(tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(made.URDF)
    (tmp_path / "two.srdf").write_text(made.SRDF)
    wall = {**made.box("wall", made.pose(-0.6, 0), 0.1, 0.4, 1), "header": {"frame_id": "base"}}
    matrix = {"entry_names": ["lower", "wall", "ghost"], "entry_values": [[False, True, True]] * 3}
    (tmp_path / "scene.yaml").write_text(
        json.dumps(made.scene(wall, allowed_collision_matrix=matrix))
    )
    arm = f"arm:urdf={tmp_path / 'two.urdf'},srdf={tmp_path / 'two.srdf'},group=arm"
    env = envs.make(f"{arm},scene={tmp_path / 'scene.yaml'}")
    assert list(env.obstacle_names) == ["obstacle 'wall'"]
    assert env.may_touch is not None
    links = [name for name, may in zip(env.shape_names, env.may_touch[:, 0], strict=False) if may]
    assert links == ["link 'lower'"]
    moved = envs.make(f'{arm},scene={tmp_path / "scene.yaml"},base="1,0,0"')
    assert moved.obstacles[0].pose[:3, 3] == pytest.approx([0.4, 0, 0]), "with the base"
    (tmp_path / "two.srdf").write_text(made.SRDF)
    wall["header"] = {"frame_id": "upper"}
    (tmp_path / "scene.yaml").write_text(json.dumps(made.scene(wall)))
    with pytest.raises(InputError, match="'wall' is in frame 'upper'; choose from: , base, world"):
        envs.make(f"{arm},scene={tmp_path / 'scene.yaml'}")


def test_poses_may_be_in_frames_that_stand_still() -> None:
    frames = [
        {
            "child_frame_id": "corner",
            "transform": {"translation": [1, 2, 3], "rotation": [0, 0, 0, 1]},
        }
    ]
    table = {**made.box("table", made.pose(1, 0), 1, 1, 1), "header": {"frame_id": "corner"}}
    found = read(made.scene(table, fixed_frame_transforms=frames))
    assert found.obstacles[0].pose[:3, 3].tolist() == [2, 2, 3]
    for base in ("", "world", "base"):
        table["header"] = {"frame_id": base}
        assert read(made.scene(table)).obstacles[0].pose[:3, 3].tolist() == [1, 0, 0]


def test_the_matrix_allows_what_is_true() -> None:
    matrix = {
        "entry_names": ["a", "b", "c"],
        "entry_values": [[False, True, False], [True, False, False], [False, False, True]],
    }
    found = read(made.scene(allowed_collision_matrix=matrix))
    assert found.allowed.pairs("abcd") == {frozenset("ab")}
    assert read(made.scene()).allowed.pairs("abcd") == frozenset()


def test_defaults_count_for_pairs_that_the_matrix_does_not_have() -> None:
    """As `moveit_msgs/AllowedCollisionMatrix` says: of two defaults both must allow it."""
    matrix = {
        "entry_names": ["a", "b"],
        "entry_values": [[False, False], [False, False]],
        "default_entry_names": ["a", "c", "d"],
        "default_entry_values": [True, True, False],
    }
    found = read(made.scene(allowed_collision_matrix=matrix)).allowed
    assert not found.allows("a", "b"), "it has an entry"
    assert found.allows("a", "c")
    assert found.allows("c", "a")
    assert found.allows("x", "a")
    assert not found.allows("a", "d")
    assert not found.allows("d", "x")
    assert not found.allows("x", "b"), "neither has a default"
    assert found.pairs("abx") == {frozenset("ax")}


GOOD = made.box("table", made.pose(0, 0), 1, 1, 1)


def of_type(kind: Any, dimensions: Any) -> dict[str, Any]:
    return {**GOOD, "primitives": [{"type": kind, "dimensions": dimensions}]}


def of_mesh(vertices: Any, triangles: Any) -> dict[str, Any]:
    mesh = {"vertices": vertices, "triangles": triangles}
    return {"id": "table", "meshes": [mesh], "mesh_poses": [made.pose(0, 0)]}


MATRIX = {"entry_names": ["a", "b"], "entry_values": [[False, True]]}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "a planning scene must be a mapping"),
        ({"world": 3}, "world must be a mapping"),
        (made.scene({**GOOD, "planes": [{}]}), "object 'table' has planes"),
        (
            made.scene({**GOOD, "header": {"frame_id": "bse"}}),
            "in frame 'bse'; did you mean 'base'",
        ),
        (made.scene({**GOOD, "primitive_poses": []}), "1 primitives and 0 poses"),
        (
            made.scene({**GOOD, "primitives": [{"type": "boks", "dimensions": [1, 1, 1]}]}),
            "is a 'boks'; did you mean 'box'",
        ),
        (
            made.scene({**GOOD, "primitives": [{"type": "box", "dimensions": [1, 1]}]}),
            "dimensions of 'table' must be 3 numbers, not 2",
        ),
        (made.scene(made.box("b", made.pose(0, 0), 1, -1, 1)), "must be positive"),
        (
            made.scene(
                made.box("b", {"position": [0, 0, 0], "orientation": [0, 0, 0, 0]}, 1, 1, 1)
            ),
            "an orientation is a quaternion",
        ),
        (made.scene(made.box("b", made.pose(float("nan"), 0), 1, 1, 1)), "must be a number"),
        (
            made.scene(robot_state={"attached_collision_objects": [GOOD]}),
            "attached_collision_objects, which are not read",
        ),
        ({"world": {"octomap": {"octomap": {"data": [1]}}}}, "has an octomap"),
        (made.scene(allowed_collision_matrix=MATRIX), "allowed_collision_matrix is not 2 by 2"),
        (made.scene(allowed_collision_matrix={"entry_names": 3}), "entry_names must be a list"),
        (made.scene(wrold={}), "a planning scene has no 'wrold'; did you mean 'world'"),
        ({"world": {"colision_objects": []}}, "world has no 'colision_objects'; did you mean"),
        (made.scene({**GOOD, "primitve": []}), "object 'table' has no 'primitve'; did you mean"),
        (made.scene(GOOD, GOOD), "two objects are called 'table'; rename one"),
        (made.scene({**GOOD, "operation": 1}), "is one to 1, and not to add"),
        (made.scene({**GOOD, "operation": "remove"}), "is one to 'remove', and not to add"),
        (made.scene(of_type(5, [1, 1, 1])), "prisms are not read; use a mesh"),
        (made.scene(of_type(9, [1])), "is a '9'"),
        (made.scene(of_type([], [1])), "is a '[]'"),
        (made.scene(of_type(2, [1, 2])), "dimensions of 'table' must be 1 numbers, not 2"),
        (made.scene(of_type("cone", [0, 1])), "must be positive, not [1.0, 0.0]"),
        (made.scene(of_type("sphere", [1e300])), "must be a number of at most 1e+06"),
        (made.scene({**GOOD, "primitives": 3}), "primitives must be a list"),
        (made.scene({**GOOD, "pose": {"position": {"x": 1, "a": 2}}}), "a position has no 'a'"),
        (made.scene(of_mesh([[0, 0, 0]], [])), "the mesh of object 'table' has no triangles"),
        (made.scene(of_mesh([[0, 0, 0]], [[0, 1, 2]])), "faces whose vertices are not there"),
        (made.scene(of_mesh([[0, 0]], [])), "a vertex of the mesh of 'table' must be 3 numbers"),
        (made.scene(of_mesh([], [[0.5, 1, 2]])), "must be three numbers of vertices"),
        (made.scene(of_mesh([[0, 0, 0]] * 3, [[0, 1, 2]])), "has no extent"),
        (made.scene(of_mesh(np.eye(3).tolist(), [[0, 1, 2]])), "is not watertight"),
        (made.scene(of_mesh(None, [])), "vertices of the mesh of 'table' must be a list"),
        (
            made.scene(allowed_collision_matrix={"default_entry_names": ["a"]}),
            "allowed_collision_matrix has 1 default_entry_names and 0 default_entry_values",
        ),
    ],
)
def test_what_is_wrong_with_a_scene_is_said_in_a_line(content: Any, said: str) -> None:
    with pytest.raises(InputError) as caught:
        read(content)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_request_has_joint_values() -> None:
    found = read_motion_request(json.dumps(made.request([0.1, 0.2], [1, 2])).encode())
    assert found.group == "arm"
    assert found.start == {"shoulder": 0.1, "elbow": 0.2, "grip": 0.05}
    assert found.goal == {"shoulder": 1, "elbow": 2}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"goal_constraints": []}, "it has 0 goals"),
        ({"goal_constraints": [{"position_constraints": []}]}, "none of joint values"),
        (
            {"start_state": {"joint_state": {"name": ["a"], "position": []}}},
            "1 joints and 0 values",
        ),
        ({"goal_constraints": [{"joint_constraints": [{"joint_name": "a"}]}]}, "must be a number"),
    ],
)
def test_what_is_wrong_with_a_request_is_said_in_a_line(change: Any, said: str) -> None:
    content = {**made.request([0, 0], [1, 1]), **change}
    with pytest.raises(InputError, match=said):
        read_motion_request(json.dumps(content).encode())


@pytest.mark.parametrize(
    "text",
    [
        *(b"a: [", b"\xff\xfe\x00", b"a: !!python/object:os.system {}", b"[" * 100_000),
        *(b"a: !!timestamp 1", b"a: " + b":".join([b"1"] * 300) + b".5", b"a: 2001-99-99"),
    ],
)
def test_what_is_no_yaml_is_said_in_a_line(text: bytes) -> None:
    with pytest.raises(InputError, match="not YAML") as caught:
        read_planning_scene(text, {})
    assert "\n" not in str(caught.value)
