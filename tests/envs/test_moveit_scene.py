"""MoveIt's planning scenes and motion requests, and what is wrong with them, in a line."""

from __future__ import annotations

import json
from typing import Any

import mbm_files as made
import numpy as np
import pytest

from envs import InputError
from envs.collision.shapes import Box, Cylinder, Sphere
from envs.files.moveit_scene import PlanningScene, read_motion_request, read_planning_scene

TURNED = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
"""A quarter about z."""


def read(content: Any) -> PlanningScene:
    return read_planning_scene(json.dumps(content).encode(), "base")


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
MATRIX = {"entry_names": ["a", "b"], "entry_values": [[False, True]]}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "a planning scene must be a mapping"),
        ({"world": 3}, "world must be a mapping"),
        (made.scene({**GOOD, "meshes": [{}]}), "object 'table' has meshes"),
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


@pytest.mark.parametrize("text", [b"a: [", b"\xff\xfe\x00", b"a: !!python/object:os.system {}"])
def test_what_is_no_yaml_is_said_in_a_line(text: bytes) -> None:
    with pytest.raises(InputError, match="not YAML") as caught:
        read_planning_scene(text, "base")
    assert "\n" not in str(caught.value)
