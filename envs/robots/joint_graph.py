"""The links and joints of a URDF, checked, and which joints follow which."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import yourdfpy

from envs.errors import InputError, UnknownNameError, suggestion

_TYPES = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")

_PARTS = {
    "planar": {
        "x": ("prismatic", (1.0, 0.0, 0.0)),
        "y": ("prismatic", (0.0, 1.0, 0.0)),
        "theta": ("continuous", (0.0, 0.0, 1.0)),
    },
    "floating": {
        "trans_x": ("prismatic", (1.0, 0.0, 0.0)),
        "trans_y": ("prismatic", (0.0, 1.0, 0.0)),
        "trans_z": ("prismatic", (0.0, 0.0, 1.0)),
        "rot": ("spherical", (0.0, 0.0, 0.0)),
    },
}
"""The joints that one of several freedoms is, one on another, with types and axes: named as MoveIt
names its variables, and of a planar one about z whatever its axis, as MoveIt and Pinocchio have it.
"""

_SHORTEST = 0.5
"""Of quaternions: those in files are rounded, but of unit length."""

Value = float | tuple[float, ...]
"""Of a joint, in radians or metres; of a spherical one a unit quaternion x, y, z, w."""


class Followed(NamedTuple):
    """What a joint follows: its value is ratio times that of joint `name`, plus offset.

    A joint that mimics none follows itself; one whose value never changes has a ratio of 0.
    """

    name: str
    ratio: float
    offset: float


class VirtualJoint(NamedTuple):
    """A joint between the world and a robot.

    Attributes:
        name: as in SRDF.
        type: "fixed", "planar" or "floating".
        child: the name of the link that it carries, the robot's base.
    """

    name: str
    type: str
    child: str


class JointGraph:
    """Links and joints as a URDF has them, of which the links form a tree. A planar joint is three
    joints, one on another, and a floating one four.

    Args:
        robot: a `yourdfpy.Robot`.
        virtual: joints between the world and it, which are the first.

    Attributes:
        base: the name of the link that no joint carries.
        joints: by name, each a `yourdfpy.Joint`.
        carriers: by the name of a link, the joint that carries it; the base has none.
        followed: of each joint that is not fixed, by name, what it follows.

    Raises:
        InputError: they form no tree, or a joint cannot be used.
    """

    def __init__(self, robot: Any, virtual: Sequence[VirtualJoint] = ()) -> None:
        whole = [*map(_joint_of, virtual), *robot.joints]
        if not whole:
            raise InputError("has no joints; an arm needs at least one that moves")
        for joint in whole:
            _check_type(joint)
        self._parts = {j.name: list(_parts_of(j)) for j in whole if j.type in _PARTS}
        joints = [part for j in whole for part in self._parts.get(j.name, [j])]
        between = [part.child for parts in self._parts.values() for part in parts[:-1]]
        links = [*map(_frame_of, virtual), *(link.name for link in robot.links), *between]
        _check_unique("link", links)
        _check_unique("joint", [joint.name for joint in joints])
        self.joints: Mapping[str, Any] = {joint.name: joint for joint in joints}
        self.carriers = _carriers(joints, links)
        self.base = _base(links, self.carriers)
        self._leaving: dict[str, list[Any]] = {name: [] for name in links}
        for joint in joints:
            self._leaving[joint.parent].append(joint)
        self._check_tree()
        self.followed = {j.name: self._followed(j) for j in joints if j.type != "fixed"}

    @property
    def movable(self) -> list[str]:
        """The joints that move and follow no other, in the order of the file."""
        return [name for name, followed in self.followed.items() if followed.name == name]

    def leaving(self, link: str) -> list[Any]:
        """The joints that a link carries, in the order of the file."""
        return self._leaving[link]

    def named(self, joint: str) -> list[str]:
        """The names of the joints that a joint of the file is: of a planar one three, of a
        floating one four.

        Raises:
            UnknownNameError: there is no such joint.
        """
        if joint in self._parts:
            return [part.name for part in self._parts[joint]]
        self.check(joint)
        return [joint]

    def values(self, joint: str, numbers: Sequence[float]) -> dict[str, Value]:
        """The values of the joints that a joint of the file is, by name: of a planar one from x, y
        and theta, of a floating one from x, y, z and a quaternion x, y, z, w.

        Raises:
            InputError: there is no such joint, or its values are others.
        """
        names = self.named(joint)
        values: list[Value] = list(numbers)
        if self.joints[names[-1]].type == "spherical":
            values = [*numbers[:3], _unit(joint, numbers[3:])]
        if len(values) != len(names):
            raise InputError(f"joint {joint!r} has {len(names)} values, not {len(values)}")
        return dict(zip(names, values, strict=True))

    def axis_of_part(self, joint: str) -> int | None:
        """Along which axis, 0 to 2, one of the joints slides that a planar or floating one is; None
        for others."""
        is_part = any(part.name == joint for parts in self._parts.values() for part in parts)
        slides = is_part and self.joints[joint].type == "prismatic"
        return int(np.argmax(self.joints[joint].axis)) if slides else None

    def has(self, joint: str) -> bool:
        """Whether there is a joint of that name, in the file or as one of those it stands for."""
        return joint in self.joints or joint in self._parts

    def check(self, joint: str) -> None:
        """Raises an UnknownNameError if there is no joint of that name."""
        if joint not in self.joints:
            raise UnknownNameError("joint", joint, self.joints)

    def way_to(self, link: str) -> list[str]:
        """The joints between a link and the base, from the link on.

        Raises:
            UnknownNameError: there is no such link.
        """
        if link not in self._leaving:
            raise UnknownNameError("link", link, self._leaving)
        found = []
        while link != self.base:
            found.append(self.carriers[link].name)
            link = self.carriers[link].parent
        return found

    def _check_tree(self) -> None:
        reached, todo = set(), [self.base]
        while todo:
            name = todo.pop()
            reached.add(name)
            todo += [joint.child for joint in self._leaving[name]]
        _refuse_cycle(name for name in self._leaving if name not in reached)

    def _followed(self, joint: Any) -> Followed:
        ratio, offset, seen = 1.0, 0.0, [joint.name]
        while joint.mimic is not None:
            name, mimic = joint.name, joint.mimic
            if mimic.joint not in self.joints:
                said = f"mimics {mimic.joint!r}, which is no joint"
                raise InputError(f"joint {name!r} {said}; {suggestion(mimic.joint, self.joints)}")
            joint = self.joints[mimic.joint]
            offset += ratio * mimic.offset
            ratio *= mimic.multiplier
            if joint.type == "fixed":
                return Followed(joint.name, 0.0, offset)
            if joint.type == "spherical":
                raise InputError(f"joint {name!r} mimics {joint.name!r}, which has no one value")
            if joint.name in seen:
                circle = ", ".join(map(repr, seen))
                raise InputError(f"joints {circle} mimic each other in a circle; cut it open")
            seen.append(joint.name)
        return Followed(joint.name, ratio, offset)


def _unit(joint: str, quaternion: Sequence[float]) -> tuple[float, ...]:
    length = math.hypot(*quaternion)
    if len(quaternion) != 4 or length < _SHORTEST:
        raise InputError(f"joint {joint!r} has 7 values: x y z and a unit quaternion x y z w")
    return tuple(number / length for number in quaternion)


def _joint_of(virtual: VirtualJoint) -> Any:
    return yourdfpy.Joint(virtual.name, virtual.type, _frame_of(virtual), virtual.child)


def _frame_of(virtual: VirtualJoint) -> str:
    """The name of a link that stands for its frame, which may be called as a link of the robot."""
    return f"{virtual.name}/frame"


def _parts_of(joint: Any) -> Iterator[Any]:
    """The joints that one of several freedoms is."""
    below, parts = joint.parent, _PARTS[joint.type]
    for number, (part, (kind, axis)) in enumerate(parts.items(), start=1):
        name = f"{joint.name}/{part}"
        child = joint.child if number == len(parts) else name
        origin = joint.origin if number == 1 else None
        ends = {"parent": below, "child": child, "origin": origin}
        yield replace(joint, name=name, type=kind, axis=np.array(axis), mimic=None, **ends)
        below = name


def _carriers(joints: Iterable[Any], links: Iterable[str]) -> dict[str, Any]:
    carriers: dict[str, Any] = {}
    for joint in joints:
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                said = f"its {end} {name!r} is no link; {suggestion(name, links)}"
                raise InputError(f"joint {joint.name!r}: {said}")
        if joint.child in carriers:
            both = f"{carriers[joint.child].name!r} and {joint.name!r}"
            raise InputError(f"link {joint.child!r} is the child of two joints, {both}; remove one")
        carriers[joint.child] = joint
    return carriers


def _base(links: Iterable[str], carriers: Mapping[str, Any]) -> str:
    bases = [name for name in links if name not in carriers]
    if len(bases) > 1:
        named = ", ".join(map(repr, bases))
        raise InputError(f"no joint carries {named}; join all of them but one to the others")
    if not bases:
        _refuse_cycle(links)
    return bases[0]


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


def _refuse_cycle(links: Iterable[str]) -> None:
    named = ", ".join(map(repr, links))
    if named:
        raise InputError(f"its joints form a cycle among {named}; cut it open")
