"""Serial arms from URDF files, checked: what cannot be used is refused in one clear line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from envs.collision.shapes import PlacedShape
from envs.errors import InputError, suggestion, tell_once
from envs.problem import Array
from envs.robots.arm import Part
from envs.robots.chain import Chain, Joint, Link
from envs.robots.urdf_elements import parsed
from envs.robots.urdf_geometry import GEOMETRIES, check_geometry_name, shapes_of_link

_TYPES = ("revolute", "continuous", "prismatic", "fixed")


def read_urdf(file: Path, geometry: str = "collision") -> tuple[Chain, tuple[Part, ...]]:
    """Reads the kinematics and the geometry of a serial arm.

    Joints may be revolute, continuous, prismatic or fixed. Links that are fixed to others may
    branch off, such as a tool's frame or a camera; joints that move follow one upon another, and
    none mimics another. A continuous joint is limited to -pi..pi and does not wrap around. A limit
    that is left out beside another is 0, as URDF has it; soft limits are not used, and a line is
    logged that says so.

    Meshes may be open: they are surfaces. Their files are sought from the URDF's folder; those
    named package://NAME/REST or file://REST from each folder above it too, with NAME and without. A
    link that has only the other geometry collides with nothing, and a line is logged that says so.

    Args:
        file: the URDF; lengths in metres, angles in radians.
        geometry: what collides, "collision" or "visual": the elements of links that hold it. The
            others are not read.

    Returns:
        The chain, with its links in depth-first order from the base, which is the link that no
        joint carries; its frame is that of all poses. And the solids of the links in that order,
        each placed in the frame of its body.

    Raises:
        InputError: there is no such file, or it describes no arm that can be used.
    """
    check_geometry_name(geometry)
    try:
        robot, elements = parsed(file)
        chain = _chain(robot)
        parts = _parts(elements, chain, geometry, file.parent)
        _tell_of_links_left_out(elements, geometry, file)
        _tell_of_soft_limits(robot, file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    return chain, parts


def _chain(robot: Any) -> Chain:
    base = _base(robot)
    leaving: dict[str, list[Any]] = {}
    parents = {joint.child: joint.parent for joint in robot.joints}
    for joint in robot.joints:
        leaving.setdefault(joint.parent, []).append(joint)
    links: list[Link] = []
    moving: list[tuple[int, Any, Array]] = []  # the body before, the joint, its place there
    todo = [(base, 0, np.eye(4))]
    while todo:
        name, body, offset = todo.pop()
        links.append(Link(name, body, offset, parents.get(name, "")))
        carried = []
        for joint in leaving.get(name, []):
            at = offset @ _pose(joint.origin)
            if joint.type == "fixed":
                carried.append((joint.child, body, at))
                continue
            moving.append((body, joint, at))
            carried.append((joint.child, len(moving), np.eye(4)))
        todo.extend(reversed(carried))
    _refuse_cycle(robot, links)
    if not moving:
        raise InputError("none of its joints moves; an arm needs at least one that does")
    _check_serial([(body, joint) for body, joint, _ in moving])
    return Chain(tuple(_joint(joint, at) for _, joint, at in moving), tuple(links))


def _check_serial(moving: Sequence[tuple[int, Any]]) -> None:
    """Refuses joints that branch or mimic others, all of them in one message.

    Args:
        moving: joints that move, each with the number of the body before it; the first carries
            body 1, and so on.
    """
    after: dict[int, list[int]] = {}
    for number, (body, _) in enumerate(moving, start=1):
        after.setdefault(body, []).append(number)

    def beyond(number: int) -> list[int]:
        found = {number}
        for n, (body, _) in enumerate(moving, start=1):
            found |= {n} if body in found else set()
        return sorted(found - {number})

    def describe(number: int) -> str:
        rest = [moving[n - 1][1].name for n in beyond(number)]
        if not rest:
            return _named(moving[number - 1][1])
        few = len(rest) <= _MOST_NAMED
        named = ", ".join(map(repr, rest)) if few else f"{len(rest)} joints"
        return f"{_named(moving[number - 1][1])} with {named} beyond it"

    branches = [", and ".join(map(describe, them)) for them in after.values() if len(them) > 1]
    if branches:
        raise InputError(
            f"joints {'; and '.join(branches)} branch off the same body; only serial arms are "
            'read: give all but one of them, with what is beyond, type="fixed", or all of them '
            "(the fingers of a gripper then stand still where they are at 0)"
        )
    mimics = [_named(joint) for _, joint in moving if joint.mimic is not None]
    if mimics:
        raise InputError(
            f'joint {" and joint ".join(mimics)}, which is not supported: give it type="fixed" '
            "to stand still where it is at 0, or remove its <mimic> to move by itself"
        )


def _named(joint: Any) -> str:
    return repr(joint.name) + (f" (mimics {joint.mimic.joint!r})" if joint.mimic else "")


_MOST_NAMED = 3
"""Joints beyond another that are named; of more, their number."""


def _base(robot: Any) -> str:
    """The link that no joint carries, with names, ends and types of joints checked."""
    if not robot.joints:
        raise InputError("has no joints; an arm needs at least one that moves")
    links = [link.name for link in robot.links]
    _check_unique("link", links)
    _check_unique("joint", [joint.name for joint in robot.joints])
    carried: dict[str, str] = {}
    for joint in robot.joints:
        _check_type(joint)
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                said = f"its {end} {name!r} is no link; {suggestion(name, links)}"
                raise InputError(f"joint {joint.name!r}: {said}")
        if joint.child in carried:
            both = f"{carried[joint.child]!r} and {joint.name!r}"
            raise InputError(f"link {joint.child!r} is the child of two joints, {both}; remove one")
        carried[joint.child] = joint.name
    bases = [name for name in links if name not in carried]
    if len(bases) > 1:
        named = ", ".join(map(repr, bases))
        raise InputError(f"no joint carries {named}; join all of them but one to the others")
    if not bases:
        _refuse_cycle(robot, ())
    return str(bases[0])


def _check_unique(kind: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"has two {kind}s called {name!r}; rename one")
        seen.add(name)


def _check_type(joint: Any) -> None:
    if joint.type not in _TYPES:
        said = f"is of type {joint.type!r}, which is not supported" if joint.type else "has no type"
        raise InputError(f"joint {joint.name!r} {said}; choose from: {', '.join(_TYPES)}")


def _refuse_cycle(robot: Any, reached: Iterable[Link]) -> None:
    names = {link.name for link in reached}
    rest = [link.name for link in robot.links if link.name not in names]
    if rest:
        raise InputError(f"its joints form a cycle among {', '.join(map(repr, rest))}; cut it open")


def _joint(joint: Any, origin: Array) -> Joint:
    length = math.hypot(*joint.axis)
    if not 1e-9 < length < math.inf:
        raise InputError(f"joint {joint.name!r}: its axis has no usable length, as 0 0 1 has")
    lower, upper = _limits(joint)
    axis, slides = joint.axis / length, joint.type == "prismatic"
    return Joint(joint.name, origin, axis, slides, lower, upper, _velocity(joint))


def _velocity(joint: Any) -> float | None:
    """The limit of its velocity; 0, which exporters write where they know none, is none."""
    stated = None if joint.limit is None else joint.limit.velocity
    return stated if stated is not None and 0 < stated < math.inf else None


def _limits(joint: Any) -> tuple[float, float]:
    if joint.type == "continuous":
        return -math.pi, math.pi
    limit = joint.limit
    if limit is None or (limit.lower is None and limit.upper is None):
        raise InputError(f'joint {joint.name!r} has no limits; add <limit lower="." upper="."/>')
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    if lower >= upper:
        raise InputError(
            f"joint {joint.name!r}: its lower limit {lower:g} must be below its upper {upper:g}; "
            "a joint that does not move is of type fixed"
        )
    return lower, upper


def _tell_of_soft_limits(robot: Any, file: Path) -> None:
    """Says which joints a safety controller would hold back. MoveIt narrows their limits so, while
    Pinocchio and others do not, and some problems of MotionBenchMaker are beyond them."""
    limited = [joint.name for joint in robot.joints if _has_tighter_soft_limits(joint)]
    if limited:
        named = ", ".join(map(repr, limited))
        tell_once(f"{file}: <safety_controller>'s soft limits are not used, only <limit>: {named}")


def _has_tighter_soft_limits(joint: Any) -> bool:
    soft = joint.safety_controller
    if soft is None:
        return False
    ends = soft.soft_lower_limit, soft.soft_upper_limit
    lower, upper = _limits(joint)
    return ends != (None, None) and ((ends[0] or 0.0) > lower or (ends[1] or 0.0) < upper)


def _parts(
    elements: ElementTree.Element, chain: Chain, geometry: str, folder: Path
) -> tuple[Part, ...]:
    links = {link.get("name"): link for link in elements.findall("link")}
    parts = []
    for link in chain.links:
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


def _pose(origin: Array | None) -> Array:
    return np.eye(4) if origin is None else origin
