"""Robots from URDF files, checked: what cannot be used is refused in one clear line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from envs.collision.shapes import PlacedShape
from envs.errors import InputError, tell_once
from envs.robots.arm import Part
from envs.robots.base_placement import BasePlacement
from envs.robots.joint_graph import JointGraph, Value
from envs.robots.kinematic_tree import Joint, KinematicTree
from envs.robots.planning_group import PlanningGroup
from envs.robots.urdf_elements import parsed
from envs.robots.urdf_geometry import GEOMETRIES, check_geometry_name, shapes_of_link
from envs.robots.urdf_tree import tree_of

_NAMED = 8
"""Joints that stand still and are named."""


def read_urdf(
    file: Path,
    group: PlanningGroup | None = None,
    geometry: str = "collision",
    placement: BasePlacement | None = None,
) -> tuple[KinematicTree, tuple[Part, ...]]:
    """Reads the kinematics and the geometry of a robot.

    Joints may be revolute, continuous, prismatic, planar, floating or fixed, and may branch and
    mimic others. A planar joint is two that slide, NAME/x and NAME/y, of which its limits are, and
    a continuous one, NAME/theta; a floating one is three that slide, NAME/trans_x and so on, and a
    spherical one, NAME/rot. So are virtual joints that the group has. A continuous joint goes from
    -pi to pi and wraps; it ends there, and does not wrap, if another mimics it by a ratio that is
    no whole number, or slides by it. The limits of a joint that mimics another are those that
    follow from the other's. A limit that is left out beside another is 0, as URDF has it; soft
    limits are not used, and a line is logged that says so. Another says which joints stand still,
    and where.

    Meshes may be open: they are surfaces. Their files are sought from the URDF's folder; those
    named package://NAME/REST or file://REST from each folder above it too, with NAME and without. A
    link that has only the other geometry collides with nothing, and a line is logged that says so.

    Args:
        file: the URDF; lengths in metres, angles in radians.
        group: the joints that move; all by default.
        geometry: what collides, "collision" or "visual": the elements of links that hold it. The
            others are not read.
        placement: where the base is in the world, whose frame is that of all poses, and bounds of
            planar and floating joints without limits; by default at the origin, and none.

    Returns:
        The tree, with its links in depth-first order from the base, which is the link that no joint
        carries, or the frame in which a virtual joint moves that. And the solids of the links in
        that order, each placed in the frame of its body.

    Raises:
        InputError: there is no such file, or it describes no robot that can be used, or the group
            names something else than it has.
    """
    check_geometry_name(geometry)
    try:
        robot, elements = parsed(file)
        group = group or PlanningGroup()
        graph = JointGraph(robot, group.virtual)
        locked = group.locked(graph)
        tree = tree_of(graph, locked, placement)
        parts = _parts(elements, tree, geometry, file.parent)
        _tell_of_links_left_out(elements, geometry, file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    both = [(joint, graph.joints[joint.name]) for joint in tree.coordinates]
    _tell_of_soft_limits(both, file)
    _tell_of_locked(locked, file)
    return tree, parts


def joint_graph_of(file: Path) -> JointGraph:
    """The links and joints of a URDF, with none between the robot and the world.

    Raises:
        InputError: there is no such file, or it describes no robot; names the file.
    """
    try:
        return JointGraph(parsed(file)[0])
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


def _tell_of_locked(locked: Mapping[str, Value], file: Path) -> None:
    if locked:
        named = [f"{name!r} at {_written(value)}" for name, value in locked.items()]
        more = f", and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
        tell_once(f"{file}: joints that stand still: {', '.join(named[:_NAMED])}{more}")


def _written(value: Value) -> str:
    numbers = value if isinstance(value, tuple) else (value,)
    return " ".join(f"{number:g}" for number in numbers)


def _tell_of_soft_limits(joints: Sequence[tuple[Joint, Any]], file: Path) -> None:
    """Says which joints a safety controller would hold back. MoveIt narrows their limits so, while
    Pinocchio and others do not, and some problems of MotionBenchMaker are beyond them."""
    limited = [joint.name for joint, stated in joints if _has_tighter_soft_limits(joint, stated)]
    if limited:
        named = ", ".join(map(repr, limited))
        tell_once(f"{file}: <safety_controller>'s soft limits are not used, only <limit>: {named}")


def _has_tighter_soft_limits(joint: Joint, stated: Any) -> bool:
    soft = stated.safety_controller
    if soft is None:
        return False
    lower, upper = soft.soft_lower_limit, soft.soft_upper_limit
    tighter = (lower or 0.0) > joint.lower or (upper or 0.0) < joint.upper
    return (lower, upper) != (None, None) and tighter


def _parts(
    elements: ElementTree.Element, tree: KinematicTree, geometry: str, folder: Path
) -> tuple[Part, ...]:
    links = {link.get("name"): link for link in elements.findall("link")}
    parts = []
    for link in tree.links:
        if link.name not in links:  # between the joints that stand for one of several freedoms
            continue
        for shape in shapes_of_link(links[link.name], geometry, folder):
            placed = PlacedShape(shape.solid, link.offset @ shape.pose)
            parts.append(Part(link.body, placed, link.name))
    if not any(part.body > 0 for part in parts):
        remedy = _remedy(elements, geometry)
        raise InputError(f"no link that moves has {geometry} geometry; {remedy}")
    return tuple(parts)


def _remedy(elements: ElementTree.Element, geometry: str) -> str:
    other = _other(geometry)
    if elements.find(f"link/{other}") is not None:
        return f"add <{geometry}> elements, or take those it has: geometry={other}"
    return f"add <{geometry}> elements"


def _other(geometry: str) -> str:
    [other] = set(GEOMETRIES) - {geometry}
    return other


def _tell_of_links_left_out(elements: ElementTree.Element, geometry: str, file: Path) -> None:
    """Says which links collide with nothing, but would by their other geometry."""
    other = _other(geometry)
    left_out = [
        link.get("name", "")
        for link in elements.findall("link")
        if link.find(geometry) is None and link.find(other) is not None
    ]
    if left_out:
        named = ", ".join(map(repr, left_out))
        tell_once(
            f"{file}: links with {other} but no {geometry} geometry collide with nothing, unless "
            f"with geometry={other}: {named}"
        )
