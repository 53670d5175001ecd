"""The kinematic tree of a URDF, of which some joints stand still."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from envs.errors import InputError
from envs.problem import Array
from envs.robots.base_placement import BasePlacement
from envs.robots.joint_graph import Followed, JointGraph, Value
from envs.robots.kinematic_tree import Joint, KinematicTree, Link, Mimic


def tree_of(
    graph: JointGraph, locked: Mapping[str, Value], placement: BasePlacement | None = None
) -> KinematicTree:
    """The tree of a robot.

    Args:
        graph: its links and joints.
        locked: the values of joints that stand still and follow no other, by name.
        placement: where the base is; by default at the origin.

    Raises:
        InputError: no joint is left that moves, or one that does cannot be used.
    """
    placement = placement or BasePlacement()
    links: list[Link] = []
    moving: list[tuple[Any, Array]] = []  # a joint, and its place on the body before
    parents: list[int] = []
    todo: list[tuple[str, Any, int, Array]] = [(graph.base, None, 0, placement.pose)]
    while todo:
        name, joint, body, at = todo.pop()
        if joint is not None:
            at = at @ pose(joint.origin)
            followed = graph.followed.get(joint.name)
            if followed is not None and _moves(followed, locked):
                moving.append((joint, at))
                parents.append(body)
                body, at = len(moving), np.eye(4)
            elif followed is not None:
                at = at @ _moved(joint, followed, locked)
        links.append(Link(name, body, at, joint.parent if joint else ""))
        todo += [(j.child, j, body, at) for j in reversed(graph.leaving(name))]
    if not moving:
        raise InputError("none of its joints moves; an arm needs at least one that does")
    limits = {
        joint.name: _limits(joint, graph, placement)
        for joint, _ in moving
        if graph.followed[joint.name].name == joint.name
    }
    joints = _joints([(*one, graph.followed[one[0].name]) for one in moving], limits)
    return KinematicTree(joints, tuple(links), tuple(parents))


def pose(origin: Array | None) -> Array:
    """(4, 4), of an origin that may have been left out."""
    return np.eye(4) if origin is None else origin


def _moves(followed: Followed, locked: Mapping[str, Value]) -> bool:
    return followed.ratio != 0 and followed.name not in locked


def _moved(joint: Any, followed: Followed, locked: Mapping[str, Value]) -> Array:
    """By a joint that stands still, (4, 4)."""
    moved, value = np.eye(4), locked.get(followed.name, 0.0)
    if isinstance(value, tuple):
        moved[:3, :3] = Rotation.from_quat(value).as_matrix()
        return moved
    value = followed.ratio * value + followed.offset
    if value == 0:
        return moved
    if joint.type == "prismatic":
        moved[:3, 3] = value * _axis(joint)
    else:
        moved[:3, :3] = Rotation.from_rotvec(value * _axis(joint)).as_matrix()
    return moved


def _joints(
    moving: Sequence[tuple[Any, Array, Followed]], limits: Mapping[str, tuple[float, float]]
) -> tuple[Joint, ...]:
    """The joints that move, in their order; `limits` of those that follow none."""
    numbers = {joint.name: number for number, (joint, _, _) in enumerate(moving)}
    held = {f.name for joint, _, f in moving if not _turns_with(joint, f)}
    found = []
    for joint, origin, followed in moving:
        ends = [followed.ratio * end + followed.offset for end in limits[followed.name]]
        follows_none = followed.name == joint.name
        mimic = Mimic(numbers[followed.name], followed.ratio, followed.offset)
        found.append(
            Joint(
                *(joint.name, origin, _axis(joint), joint.type == "prismatic"),
                *(min(ends), max(ends), _velocity(joint)),
                wraps=follows_none and joint.type == "continuous" and joint.name not in held,
                mimic=None if follows_none else mimic,
                spherical=joint.type == "spherical",
            )
        )
    return tuple(found)


def _turns_with(joint: Any, followed: Followed) -> bool:
    """Whether a joint is where it was when the one that it follows has turned once: else that one
    must not wrap, and its ends at half a turn part configurations."""
    return joint.type != "prismatic" and followed.ratio == round(followed.ratio)


def _axis(joint: Any) -> Array:
    if joint.type == "spherical":
        return np.zeros(3)
    length = math.hypot(*joint.axis)
    if not 1e-9 < length < math.inf:
        raise InputError(f"joint {joint.name!r}: its axis has no usable length, as 0 0 1 has")
    axis: Array = joint.axis / length
    return axis


def _velocity(joint: Any) -> float | None:
    """The limit of its velocity; 0, which exporters write where they know none, is none."""
    has_one = joint.limit is not None and joint.type != "spherical"
    stated = joint.limit.velocity if has_one else None
    return stated if stated is not None and 0 < stated < math.inf else None


def _limits(joint: Any, graph: JointGraph, placement: BasePlacement) -> tuple[float, float]:
    """The limits of a joint that moves, in radians or metres; without any, half a turn either way.

    Raises:
        InputError: it must have some, and has none that can be used.
    """
    if joint.type in ("continuous", "spherical"):
        return -math.pi, math.pi
    limit = joint.limit
    if limit is None or (limit.lower is None and limit.upper is None):
        return _bounds(joint, graph.axis_of_part(joint.name), placement)
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    if lower >= upper:
        raise InputError(
            f"joint {joint.name!r}: its lower limit {lower:g} must be below its upper {upper:g}; "
            "a joint that does not move is of type fixed, or say which joints move instead"
        )
    return lower, upper


def _bounds(joint: Any, axis: int | None, placement: BasePlacement) -> tuple[float, float]:
    """The limits of a joint that has none of its own: of one that slides along an axis of those
    that a planar or floating one is."""
    if axis is None:
        raise InputError(
            f'joint {joint.name!r} has no limits; add <limit lower="." upper="."/>, make it '
            "continuous, or say which joints move instead"
        )
    ends = placement.ends(axis)
    if ends is None:
        raise InputError(
            f"joint {joint.name!r} has no limits; say between which corners it moves, "
            'volume="X,Y,Z,X,Y,Z", or which joints move instead'
        )
    return ends
