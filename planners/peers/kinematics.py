"""Forward kinematics of robots that are plain data."""

from __future__ import annotations

import numpy as np

from envs.plain_scene import PlainJoint, PlainRobot
from envs.problem import Array


def link_poses(robot: PlainRobot, q: Array) -> dict[str, Array]:
    """The poses (4, 4) of its links in the world, by their names, at a configuration (d,)."""
    values = _values(robot, q)
    found = {robot.links[0].name: np.eye(4)}
    for joint in robot.joints:
        moved = joint.origin @ _motion(joint, values.get(joint.name, np.zeros(0)))
        found[joint.child] = found[joint.parent] @ moved
    return found


def _values(robot: PlainRobot, q: Array) -> dict[str, Array]:
    """The numbers of the joints that move, by their names."""
    found: dict[str, Array] = {}
    begin = 0
    for joint in robot.joints:
        if joint.kind != "fixed" and not joint.follows:
            count = 4 if joint.kind == "spherical" else 1
            found[joint.name] = q[begin : begin + count]
            begin += count
    for joint in robot.joints:
        if joint.follows:
            found[joint.name] = joint.ratio * found[joint.follows] + joint.offset
    return found


def _motion(joint: PlainJoint, value: Array) -> Array:
    """The pose (4, 4) of a joint's child as seen from where it is with the joint at 0."""
    made = np.eye(4)
    if joint.kind == "prismatic":
        made[:3, 3] = value[0] * joint.axis
    elif joint.kind == "spherical":
        made[:3, :3] = _turned(value[:3], value[3])
    elif joint.kind != "fixed":
        made[:3, :3] = _turned(np.sin(value[0] / 2) * joint.axis, float(np.cos(value[0] / 2)))
    return made


def _turned(vector: Array, scalar: float) -> Array:
    """The rotation (3, 3) of a unit quaternion."""
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2 * (scalar * cross + cross @ cross)
    return rotation
