"""Planning scenes and motion requests as MoveIt writes them in YAML, of which MotionBenchMaker's
problems are made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from envs.collision.shapes import LARGEST, Box, Cylinder, PlacedShape, Solid, Sphere
from envs.errors import InputError, brief, suggestion
from envs.files.allowed_collision_matrix import AllowedCollisionMatrix
from envs.problem import Array

_WORLD = ("", "world")
"""What the frame of the robot's base is called besides its own name."""

_SIZES = {"box": 3, "cylinder": 2, "sphere": 1}
"""The dimensions of primitives, as `shape_msgs/SolidPrimitive` has them."""


@dataclass(frozen=True)
class PlanningScene:
    """The objects about a robot.

    Attributes:
        obstacles: in the frame of the robot's base, in metres.
        names: (o,) of the objects that they are of.
        allowed: which links and objects may touch each other.
    """

    obstacles: tuple[PlacedShape, ...]
    names: tuple[str, ...]
    allowed: AllowedCollisionMatrix


@dataclass(frozen=True)
class MotionRequest:
    """What is to be planned.

    Attributes:
        group: the planning group.
        start: values of joints by name, in radians or metres; more than those of the group.
        goal: of the group's.
    """

    group: str
    start: Mapping[str, float]
    goal: Mapping[str, float]


def read_planning_scene(text: bytes, base: str) -> PlanningScene:
    """Reads a scene.

    Objects are primitives, boxes, cylinders and spheres, with poses in the frame of the object,
    which has one in that of its header or of the robot's base. The matrix of allowed collisions may
    have names that are neither links nor objects, as in MoveIt.

    Args:
        text: YAML.
        base: the name of the robot's first link, in whose frame, or that of "world", poses are.

    Raises:
        InputError: it is none, or has something that is not supported.
    """
    content = _mapping(_loaded(text), "a planning scene")
    frames = _frames(content, base)
    _check_nothing_else(content)
    objects = _mapping(content.get("world") or {}, "world").get("collision_objects") or []
    found = [
        (name, placed)
        for entry in _list(objects, "collision_objects")
        for name, placed in _shapes(_mapping(entry, "an object"), frames)
    ]
    allowed = _allowed(content.get("allowed_collision_matrix"))
    return PlanningScene(tuple(one for _, one in found), tuple(name for name, _ in found), allowed)


def _check_nothing_else(content: Mapping[str, Any]) -> None:
    """What a robot carries is part of it, and an octomap is in its way: neither may be passed
    over."""
    state = _mapping(content.get("robot_state") or {}, "robot_state")
    if state.get("attached_collision_objects"):
        raise InputError("its robot carries attached_collision_objects, which are not read")
    octomap = _mapping(content.get("world") or {}, "world").get("octomap") or {}
    if _mapping(octomap, "octomap").get("octomap"):
        raise InputError("its world has an octomap, which is not read; use primitives")


def read_motion_request(text: bytes) -> MotionRequest:
    """Reads a request whose goal is one of joint values.

    Args:
        text: YAML.

    Raises:
        InputError: it is none, or has no such goal.
    """
    content = _mapping(_loaded(text), "a motion request")
    state = _mapping(content.get("start_state") or {}, "start_state")
    joints = _mapping(state.get("joint_state") or {}, "joint_state")
    names = _list(joints.get("name") or [], "name")
    values = _list(joints.get("position") or [], "position")
    if len(names) != len(values):
        raise InputError(f"the start has {len(names)} joints and {len(values)} values for them")
    start = {str(n): _number(v, "a start's value") for n, v in zip(names, values, strict=True)}
    return MotionRequest(str(content.get("group_name", "")), start, _goal(content))


def _goal(content: Mapping[str, Any]) -> dict[str, float]:
    goals = _list(content.get("goal_constraints") or [], "goal_constraints")
    if len(goals) != 1:
        raise InputError(f"it has {len(goals)} goals; one of joint values is read")
    found = {}
    for entry in _list(_mapping(goals[0], "a goal").get("joint_constraints") or [], "a goal"):
        one = _mapping(entry, "a joint's constraint")
        found[str(one.get("joint_name"))] = _number(one.get("position"), "a goal's position")
    if not found:
        raise InputError("its goal is none of joint values (joint_constraints)")
    return found


def _loaded(text: bytes) -> Any:
    # libyaml's, where PyYAML has it: a scene a hundredth of a second, and not a tenth.
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        return yaml.load(text, loader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"not YAML, mend it: {' '.join(str(error).split())}") from error


def _frames(content: Mapping[str, Any], base: str) -> dict[str, Array]:
    """Poses (4, 4) of known frames in that of the base."""
    frames = {name: np.eye(4) for name in (*_WORLD, base)}
    for entry in _list(content.get("fixed_frame_transforms") or [], "fixed_frame_transforms"):
        one = _mapping(entry, "a transform")
        name = str(one.get("child_frame_id", ""))
        said = _mapping(one.get("transform") or {}, "transform")
        pose = _pose(said.get("translation"), said.get("rotation"))
        if name in frames and not np.allclose(pose, np.eye(4)):
            raise InputError(f"frame {name!r} is moved, but poses are in it; write them in its own")
        frames.setdefault(name, pose)
    return frames


def _shapes(
    entry: Mapping[str, Any], frames: Mapping[str, Array]
) -> Iterator[tuple[str, PlacedShape]]:
    name = str(entry.get("id", ""))
    unread = [key for key in ("meshes", "planes") if entry.get(key)]
    if unread:
        raise InputError(f"object {name!r} has {unread[0]}, which are not read; use primitives")
    frame = str(_mapping(entry.get("header") or {}, "header").get("frame_id", ""))
    if frame not in frames:
        raise InputError(f"object {name!r} is in frame {frame!r}; {suggestion(frame, frames)}")
    within = frames[frame]
    if entry.get("pose"):
        said = _mapping(entry["pose"], "pose")
        within = within @ _pose(said.get("position"), said.get("orientation"))
    primitives = _list(entry.get("primitives") or [], "primitives")
    poses = _list(entry.get("primitive_poses") or [], "primitive_poses")
    if len(primitives) != len(poses):
        raise InputError(
            f"object {name!r} has {len(primitives)} primitives and {len(poses)} poses for them"
        )
    for primitive, pose in zip(primitives, poses, strict=True):
        solid = _solid(name, _mapping(primitive, "a primitive"))
        said = _mapping(pose, "a pose")
        there = within @ _pose(said.get("position"), said.get("orientation"))
        yield name, PlacedShape(solid, there)


def _solid(name: str, primitive: Mapping[str, Any]) -> Solid:
    kind = str(primitive.get("type"))
    if kind not in _SIZES:
        raise InputError(f"object {name!r} is a {kind!r}; {suggestion(kind, _SIZES)}")
    sizes = _numbers(primitive.get("dimensions"), _SIZES[kind], f"dimensions of {name!r}")
    if not (sizes > 0).all():
        raise InputError(f"object {name!r}: dimensions must be positive, not {sizes.tolist()}")
    if kind == "box":
        return Box(np.zeros(3), sizes)
    if kind == "cylinder":
        return Cylinder(sizes[1], sizes[0])  # ROS has the height first
    return Sphere(sizes[0])


def _allowed(matrix: Any) -> AllowedCollisionMatrix:
    if matrix is None:
        return AllowedCollisionMatrix()
    said = _mapping(matrix, "allowed_collision_matrix")
    names = [str(name) for name in _list(said.get("entry_names") or [], "entry_names")]
    rows = _list(said.get("entry_values") or [], "entry_values")
    if [len(_list(row, "entry_values")) for row in rows] != [len(names)] * len(names):
        raise InputError(f"its allowed_collision_matrix is not {len(names)} by {len(names)}")
    entries = {
        frozenset((names[i], names[j])): rows[i][j] is True or rows[j][i] is True
        for i, j in combinations(range(len(names)), 2)
    }
    return AllowedCollisionMatrix(entries, _defaults(said))


def _defaults(matrix: Mapping[str, Any]) -> dict[str, bool]:
    """Of names, by the matrix's lists of them and of what they may."""
    names = _list(matrix.get("default_entry_names") or [], "default_entry_names")
    values = _list(matrix.get("default_entry_values") or [], "default_entry_values")
    if len(names) != len(values):
        raise InputError(
            f"its allowed_collision_matrix has {len(names)} default_entry_names and "
            f"{len(values)} default_entry_values for them"
        )
    return {str(name): value is True for name, value in zip(names, values, strict=True)}


def _pose(position: Any, orientation: Any) -> Array:
    """(4, 4), of a position and a quaternion x, y, z, w."""
    pose = np.eye(4)
    pose[:3, 3] = _numbers(position, 3, "a position")
    quaternion = _numbers(orientation, 4, "an orientation")
    if not np.linalg.norm(quaternion) > 1e-6:
        raise InputError("an orientation is a quaternion x, y, z, w, and not 0")
    pose[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    return pose


def _numbers(values: Any, count: int, what: str) -> Array:
    numbers = [_number(value, what) for value in _list(values, what)]
    if len(numbers) != count:
        raise InputError(f"{what} must be {count} numbers, not {len(numbers)}")
    return np.array(numbers)


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise InputError(f"{what} must be a number of at most {LARGEST:g}, not {brief(value)}")
    return float(value)


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{what} must be a mapping, not {brief(value)}")
    return value


def _list(value: Any, what: str) -> Sequence[Any]:
    if not isinstance(value, list):
        raise InputError(f"{what} must be a list, not {brief(value)}")
    return value
