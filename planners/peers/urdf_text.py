"""A robot as the text of a URDF and of an SRDF file, for programs that read these."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from envs.plain_scene import PlainJoint, PlainLink, PlainRobot, PlainSolid
from envs.problem import Array

GROUP = "planned"
"""The group in the SRDF of the joints that configurations have numbers for."""

_EFFORT = 1000.0  # which the format demands, and planners do not use
_FASTEST = 10.0  # radians or metres a second, where no limit is known


def kinematic_urdf(robot: PlainRobot) -> str:
    """Its links, without solids, and its joints. A joint that turns for ever is one whose limits
    are a turn apart: programs have two numbers for it otherwise."""
    return _urdf(robot, lambda link: ())


def urdf(robot: PlainRobot, folder: Path) -> str:
    """Its links, with what of them collides, and its joints, as `kinematic_urdf` has them.

    Args:
        folder: where meshes are written to.
    """

    def collisions(link: PlainLink) -> Iterable[Element]:
        for number, solid in enumerate(piece for one in link.solids for piece in one.pieces()):
            yield _collision(solid, folder / f"{robot.links.index(link)}-{number}.obj")

    return _urdf(robot, collisions)


def srdf(robot: PlainRobot) -> str:
    """The group of the joints that planners move, and which links may touch."""
    root = Element("robot", name=robot.name or "robot")
    group = SubElement(root, "group", name=GROUP)
    for joint in moving(robot):
        SubElement(group, "joint", name=joint.name)
    for one, other in touching(robot):
        SubElement(root, "disable_collisions", link1=one, link2=other, reason="Allowed")
    return tostring(root, encoding="unicode")


def moving(robot: PlainRobot) -> list[PlainJoint]:
    """The joints that configurations have numbers for, in their order."""
    return [joint for joint in robot.joints if joint.kind != "fixed" and not joint.follows]


def touching(robot: PlainRobot) -> list[tuple[str, str]]:
    """The pairs of links that may touch, each once."""
    pairs = {tuple(sorted((link.name, other))) for link in robot.links for other in link.touches}
    return [(one, other) for one, other in sorted(pairs)]


def with_names_apart(robot: PlainRobot) -> PlainRobot:
    """The robot with other names for joints that are called as a link is, for programs that know
    both by the same table."""
    links = {link.name for link in robot.links}
    names = {joint.name: joint.name for joint in robot.joints}
    for name in links & names.keys():
        while names[name] in links or names[name] in (names.keys() - {name}):
            names[name] += "-joint"
    renamed = (
        replace(joint, name=names[joint.name], follows=names.get(joint.follows, ""))
        for joint in robot.joints
    )
    return replace(robot, joints=tuple(renamed))


def write_mesh(solid: PlainSolid, file: Path) -> None:
    """Writes a mesh as Wavefront OBJ, in its own frame."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (solid.triangles + 1).tolist()]
    file.write_text("\n".join(lines) + "\n")


def _urdf(robot: PlainRobot, collisions: Callable[[PlainLink], Iterable[Element]]) -> str:
    root = Element("robot", name=robot.name or "robot")
    for link in robot.links:
        SubElement(root, "link", name=link.name).extend(collisions(link))
    for joint in robot.joints:
        _add_joint(root, joint)
    return tostring(root, encoding="unicode")


def _add_joint(root: Element, joint: PlainJoint) -> None:
    kind = "revolute" if joint.kind == "continuous" else joint.kind
    made = SubElement(root, "joint", name=joint.name, type=kind)
    SubElement(made, "parent", link=joint.parent)
    SubElement(made, "child", link=joint.child)
    made.append(_origin(joint.origin))
    if kind == "fixed":
        return
    SubElement(made, "axis", xyz=_text(joint.axis))
    speed = _FASTEST if joint.velocity is None else joint.velocity
    numbers = {"lower": joint.lower, "upper": joint.upper, "velocity": speed, "effort": _EFFORT}
    if joint.follows:
        follows = {"joint": joint.follows, "multiplier": _number(joint.ratio)}
        SubElement(made, "mimic", {**follows, "offset": _number(joint.offset)})
    SubElement(made, "limit", {name: _number(value) for name, value in numbers.items()})


def _collision(solid: PlainSolid, file: Path) -> Element:
    made = Element("collision")
    made.append(_origin(solid.pose))
    shape = SubElement(made, "geometry")
    if solid.kind == "mesh":
        write_mesh(solid, file)
        SubElement(shape, "mesh", filename=str(file))
    else:
        sizes = {name: _text(np.array(numbers)) for name, numbers in solid.sizes.items()}
        SubElement(shape, solid.kind, sizes)
    return made


def roll_pitch_yaw(pose: Array) -> Array:
    """The angles (3,) by which a pose (4, 4) is turned about x, then y, then z of the parent."""
    r = pose[:3, :3]
    pitch = float(np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0])))
    if np.hypot(r[0, 0], r[1, 0]) > 1e-12:
        roll, yaw = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    else:  # roll and yaw turn about the same axis
        roll, yaw = np.arctan2(-r[1, 2], r[1, 1]), 0.0
    return np.array([roll, pitch, yaw])


def _origin(pose: Array) -> Element:
    return Element("origin", xyz=_text(pose[:3, 3]), rpy=_text(roll_pitch_yaw(pose)))


def _text(numbers: Array) -> str:
    return " ".join(map(_number, numbers))


def _number(value: float) -> str:
    return repr(float(value))
