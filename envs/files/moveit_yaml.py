"""Planning scenes as MoveIt's messages have them, in YAML: as robowflex writes them, of which
MotionBenchMaker's problems are made, or as ROS prints messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from envs.collision.shapes import PlacedShape, Solid
from envs.errors import InputError, brief, suggestion, tell_once
from envs.files import planning_scene
from envs.files.allowed_collision_matrix import AllowedCollisionMatrix
from envs.files.planning_scene import SIZES, PlanningScene
from envs.files.yaml_text import (
    list_of,
    mapping_of,
    name_of,
    number_of,
    numbers_of,
    parsed_yaml,
    rotation_of,
)
from envs.problem import Array

WORLD = ("", "world")
"""What the frame of the world is called."""

KEYS = (
    *("name", "robot_state", "robot_model_name", "fixed_frame_transforms"),
    *("allowed_collision_matrix", "link_padding", "link_scale", "object_colors", "world"),
    *("is_diff", "collision_objects", "octomap"),
)
"""Of `moveit_msgs/PlanningScene`; and of `PlanningSceneWorld`, which may be there alone."""

_OF_WORLD = ("collision_objects", "octomap")

_OF_OBJECT = (
    *("header", "pose", "id", "type", "primitives", "primitive_poses", "meshes", "mesh_poses"),
    *("planes", "plane_poses", "subframe_names", "subframe_poses", "operation"),
)

_KINDS = {1: "box", 2: "sphere", 3: "cylinder", 4: "cone", 5: "prism"}
"""What `shape_msgs/SolidPrimitive` has for its types."""

_ADDS = (None, 0, 2, "add", "append")
"""Operations of objects that are there: ADD and APPEND."""


def read_planning_scene(text: bytes, frames: Mapping[str, Array]) -> PlanningScene:
    """Reads a scene.

    Objects are primitives, boxes, cylinders, spheres and cones, and closed meshes, with poses in
    the frame of the object, which has one in that of its header. The matrix of allowed collisions
    may have names that are neither links nor objects, as in MoveIt.

    Args:
        text: YAML.
        frames: by the names of links that stand still, poses (4, 4) in the world, in whose frame
            poses are that name no other.

    Raises:
        InputError: it is none, or has something that is not supported.
    """
    return planning_scene_of(parsed_yaml(text), frames)


def planning_scene_of(content: Any, frames: Mapping[str, Array]) -> PlanningScene:
    """That of what YAML stands for, see `read_planning_scene`."""
    content = mapping_of(content, "a planning scene")
    _check_keys(content, KEYS, "a planning scene")
    world = content if "collision_objects" in content else content.get("world") or {}
    world = mapping_of(world, "world")
    if world is not content:
        _check_keys(world, _OF_WORLD, "world")
    _check_nothing_else(content, world)
    known = _known_frames(content, frames)
    objects = list_of(world.get("collision_objects") or [], "collision_objects")
    found, ids = [], set()
    for entry in (mapping_of(one, "an object") for one in objects):
        name = name_of(entry.get("id", ""))
        if name and name in ids:
            raise InputError(f"two objects are called {name!r}; rename one")
        ids.add(name)
        found += [(name, placed) for placed in _shapes(name, entry, known)]
    allowed = _allowed(content.get("allowed_collision_matrix"))
    return PlanningScene(tuple(one for _, one in found), tuple(name for name, _ in found), allowed)


def _check_keys(content: Mapping[Any, Any], known: Sequence[str], what: str) -> None:
    for key in content:
        if key not in known:
            raise InputError(f"{what} has no {brief(key)}; {suggestion(key, known)}")


def _check_nothing_else(content: Mapping[Any, Any], world: Mapping[Any, Any]) -> None:
    """What a robot carries is part of it, and an octomap is in its way: neither may be passed
    over. That links are padded is said."""
    state = mapping_of(content.get("robot_state") or {}, "robot_state")
    if state.get("attached_collision_objects"):
        raise InputError("its robot carries attached_collision_objects, which are not read")
    octomap = mapping_of(world.get("octomap") or {}, "octomap").get("octomap") or {}
    if not isinstance(octomap, Mapping) or octomap.get("data"):
        raise InputError("its world has an octomap, which is not read; use primitives")
    for key, value, none in (("link_padding", "padding", 0), ("link_scale", "scale", 1)):
        for entry in list_of(content.get(key) or [], key):
            if number_of(mapping_of(entry, key).get(value), f"{value} of {key}") != none:
                tell_once(f"a planning scene's {key} is passed over: links are as their URDF says")


def _known_frames(content: Mapping[Any, Any], frames: Mapping[str, Array]) -> dict[str, Array]:
    """Poses (4, 4) of known frames in the world."""
    known = {**frames, **{name: np.eye(4) for name in WORLD}}
    for entry in list_of(content.get("fixed_frame_transforms") or [], "fixed_frame_transforms"):
        one = mapping_of(entry, "a transform")
        name = _frame_named(one.get("child_frame_id", ""))
        said = mapping_of(one.get("transform") or {}, "transform")
        pose = _pose(said.get("translation"), said.get("rotation"))
        # The planning frame, which is the world's, is written as one in itself.
        in_itself = _header_frame(one) == name
        there = pose if in_itself else _frame_of(one, known, f"frame {name!r}") @ pose
        as_known = (np.eye(4), known.get(name, there))
        if name in known and not any(np.allclose(there, still) for still in as_known):
            raise InputError(f"frame {name!r} is moved, but poses are in it; write them in its own")
        known.setdefault(name, there)
    return known


def _frame_named(value: Any) -> str:
    """As the first version of ROS may have it, with a slash."""
    return name_of(value).removeprefix("/")


def _header_frame(entry: Mapping[Any, Any]) -> str:
    header = mapping_of(entry.get("header") or {}, "header")
    return _frame_named(header.get("frame_id", ""))


def _frame_of(entry: Mapping[Any, Any], frames: Mapping[str, Array], what: str) -> Array:
    """The pose (4, 4) of the frame that the header of something names."""
    frame = _header_frame(entry)
    if frame not in frames:
        raise InputError(f"{what} is in frame {frame!r}; {suggestion(frame, frames)}")
    return frames[frame]


def _shapes(
    name: str, entry: Mapping[Any, Any], frames: Mapping[str, Array]
) -> Iterator[PlacedShape]:
    _check_keys(entry, _OF_OBJECT, f"object {name!r}")
    if entry.get("planes"):
        raise InputError(f"object {name!r} has planes, which have no end; use boxes")
    if entry.get("operation") not in _ADDS:
        raise InputError(
            f"object {name!r} is one to {brief(entry['operation'])}, and not to add (0); write the "
            "scene as it is then"
        )
    within = _frame_of(entry, frames, f"object {name!r}")
    if entry.get("pose"):
        within = within @ _pose_of(entry["pose"])
    for key, of_kind in (("primitive", _primitive), ("mesh", _mesh)):
        many = f"{key}es" if key == "mesh" else f"{key}s"
        shapes = list_of(entry.get(many) or [], many)
        poses = list_of(entry.get(f"{key}_poses") or [], f"{key}_poses")
        if len(shapes) != len(poses):
            said = f"{len(shapes)} {many} and {len(poses)} poses for them"
            raise InputError(f"object {name!r} has {said}")
        for shape, pose in zip(shapes, poses, strict=True):
            solid = of_kind(name, mapping_of(shape, f"a {key}"))
            yield PlacedShape(solid, within @ _pose_of(pose))


def _primitive(name: str, shape: Mapping[Any, Any]) -> Solid:
    said = shape.get("type")
    kind = _KINDS.get(said, brief(said)) if isinstance(said, int) else name_of(said)
    planning_scene.check_kind(kind, name)
    sizes = numbers_of(shape.get("dimensions"), SIZES[kind], f"dimensions of {name!r}").tolist()
    if kind in ("cylinder", "cone"):
        sizes.reverse()  # ROS has the height first
    return planning_scene.primitive(kind, sizes, name)


def _mesh(name: str, shape: Mapping[Any, Any]) -> Solid:
    of_mesh = f"of the mesh of {name!r}"
    vertices = [
        _point(one, f"a vertex {of_mesh}")
        for one in list_of(shape.get("vertices"), f"vertices {of_mesh}")
    ]
    faces = [
        _triangle(one, f"a triangle {of_mesh}")
        for one in list_of(shape.get("triangles"), f"triangles {of_mesh}")
    ]
    corners = np.array(faces, dtype=np.int64).reshape(-1, 3)
    return planning_scene.mesh(np.array(vertices).reshape(-1, 3), corners, name)


def _triangle(value: Any, what: str) -> list[int]:
    corners = value.get("vertex_indices") if isinstance(value, Mapping) else value
    numbers = numbers_of(corners, 3, what)
    if (numbers != numbers.round()).any():
        raise InputError(f"{what} must be three numbers of vertices, not {brief(corners)}")
    return [int(number) for number in numbers]


def _allowed(matrix: Any) -> AllowedCollisionMatrix:
    if matrix is None:
        return AllowedCollisionMatrix()
    said = mapping_of(matrix, "allowed_collision_matrix")
    names = [name_of(name) for name in list_of(said.get("entry_names") or [], "entry_names")]
    rows = [_row(row) for row in list_of(said.get("entry_values") or [], "entry_values")]
    if [len(row) for row in rows] != [len(names)] * len(names):
        raise InputError(f"its allowed_collision_matrix is not {len(names)} by {len(names)}")
    entries = {
        frozenset((names[i], names[j])): rows[i][j] is True or rows[j][i] is True
        for i, j in combinations(range(len(names)), 2)
    }
    return AllowedCollisionMatrix(entries, _defaults(said))


def _row(value: Any) -> Sequence[Any]:
    """A list, or `moveit_msgs/AllowedCollisionEntry`."""
    return list_of(value.get("enabled") if isinstance(value, Mapping) else value, "entry_values")


def _defaults(matrix: Mapping[str, Any]) -> dict[str, bool]:
    """Of names, by the matrix's lists of them and of what they may."""
    names = list_of(matrix.get("default_entry_names") or [], "default_entry_names")
    values = list_of(matrix.get("default_entry_values") or [], "default_entry_values")
    if len(names) != len(values):
        raise InputError(
            f"its allowed_collision_matrix has {len(names)} default_entry_names and "
            f"{len(values)} default_entry_values for them"
        )
    return {name_of(name): value is True for name, value in zip(names, values, strict=True)}


def _pose_of(value: Any) -> Array:
    said = mapping_of(value, "a pose")
    return _pose(said.get("position"), said.get("orientation"))


def _pose(position: Any, orientation: Any) -> Array:
    """(4, 4), of a position and a quaternion x, y, z, w."""
    pose = np.eye(4)
    pose[:3, 3] = _point(position, "a position")
    quaternion = _in_order(orientation, "xyzw", "an orientation")
    pose[:3, :3] = rotation_of(quaternion, "an orientation")
    return pose


def _point(value: Any, what: str) -> Array:
    return _in_order(value, "xyz", what)


def _in_order(value: Any, keys: str, what: str) -> Array:
    """The numbers of a list, or of a mapping with these keys."""
    if isinstance(value, Mapping):
        _check_keys(value, keys, what)
        value = [value.get(key) for key in keys]
    return numbers_of(value, len(keys), what)
