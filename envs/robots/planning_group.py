"""Which joints of a robot move, its planning group, and where the others stand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from envs.errors import InputError
from envs.robots.joint_graph import JointGraph, Value, VirtualJoint
from envs.robots.srdf import Srdf

_BEYOND = 1e-3
"""Radians or metres by which values that were rounded may be beyond a joint's limits."""


@dataclass(frozen=True)
class PlanningGroup:
    """The joints that a planner moves; by default all that mimic no other. Those that do follow in
    any case.

    Attributes:
        srdf: has the groups and states.
        name: a group of the SRDF's, or
        tip: a link, to which the joints from the base on are meant, or
        joints: their names.
        state: the name of group states of the SRDF's, where the other joints stand.
        pose: by name, values of some of the others, in radians or metres; these count first. What
            neither has stands at 0, or as near as its limits allow.

    Raises:
        InputError: more than one of `name`, `tip` and `joints` is given.
    """

    srdf: Srdf = field(default_factory=Srdf)
    name: str = ""
    tip: str = ""
    joints: tuple[str, ...] = ()
    state: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        given = {"group": self.name, "tip": self.tip, "joints": self.joints}
        chosen = [key for key, value in given.items() if value]
        if len(chosen) > 1:
            raise InputError(f"{' and '.join(chosen)} both say which joints move; give one of them")
        for key, value in (("group", self.name), ("state", self.state)):
            if value and self.srdf.file is None:
                raise InputError(f"{key}={value} is in an SRDF file; give that, too: srdf=FILE")

    @cached_property
    def virtual(self) -> list[VirtualJoint]:
        """The virtual joints that move, as the group or `joints` names them, or stand elsewhere
        than at the origin, as the state says; others need not be there."""
        known = (one for one in self.srdf.virtual.values() if one.type != "fixed")
        return [one for one in known if one.name in self._named or one.name in self._told]

    @cached_property
    def _named(self) -> tuple[str, ...]:
        """Joints that the group, or `joints`, names one by one."""
        return self.srdf.members(self.name).joints if self.name else self.joints

    @cached_property
    def _told(self) -> dict[str, tuple[float, ...]]:
        return self.srdf.state(self.state) if self.state else {}

    def locked(self, graph: JointGraph) -> dict[str, Value]:
        """The values of the joints of a robot that stand still and follow no other, by name. The
        graph has the `virtual` joints.

        Raises:
            InputError: something is named that the robot does not have, or that cannot be.
        """
        moving = self._moving(graph)
        values: dict[str, Value] = {}
        for name, numbers in self._told.items():
            # Some files place the base by a joint that neither they nor the URDF has.
            of_another = name in self.srdf.virtual or len(numbers) > 1
            if graph.has(name) or not of_another:
                values |= graph.values(name, numbers)
        for name, value in self.pose.items():
            graph.check(name)
            if name not in graph.movable or name in moving:
                raise InputError(f"pose: joint {name!r} {_why_not(graph, name)}")
            if graph.joints[name].type == "spherical":
                raise InputError(f"pose: joint {name!r} has no one value; a state may say it")
            values[name] = value
        still = [name for name in graph.movable if name not in moving]
        return {name: _standing(graph.joints[name], values.get(name)) for name in still}

    def _moving(self, graph: JointGraph) -> set[str]:
        """The names of the joints that move and follow no other; of virtual ones only those that
        are named."""
        still = (graph.named(one.name) for one in self.virtual if one.name not in self._named)
        return self._chosen(graph) - {part for parts in still for part in parts}

    def _chosen(self, graph: JointGraph) -> set[str]:
        if self.tip:
            on_way = [graph.followed[n].name for n in graph.way_to(self.tip) if n in graph.followed]
            return self._movable(graph, on_way, f"tip {self.tip!r}")
        if self.name:
            joints = self.srdf.joints_of(self.name, graph)
            return self._movable(graph, joints, f"group {self.name!r}")
        if not self.joints:
            return set(graph.movable)
        joints = {name for joint in self.joints for name in graph.named(joint)}
        for name in sorted(joints - set(graph.movable)):
            raise InputError(f"joint {name!r} {_why_not(graph, name)}; leave it out of joints")
        return joints

    def _movable(self, graph: JointGraph, joints: Iterable[str], what: str) -> set[str]:
        found = set(graph.movable) & set(joints)
        if not found:
            raise InputError(f"{what} has no joint that moves by itself; choose another")
        return found


def _why_not(graph: JointGraph, name: str) -> str:
    """Why a joint is not what was asked."""
    if name not in graph.followed:
        return "is fixed"
    followed = graph.followed[name].name
    return "is one that moves" if followed == name else f"follows {followed!r}"


def _standing(joint: Any, value: Value | None) -> Value:
    """The value of a joint that stands still: without one 0, or as near as the limits are."""
    if joint.type == "spherical":
        return value or (0.0, 0.0, 0.0, 1.0)
    assert not isinstance(value, tuple)
    return _within(joint, value)


def _within(joint: Any, value: float | None) -> float:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or (limit.lower, limit.upper) == (None, None):
        return value or 0.0
    lower, upper = limit.lower or 0.0, limit.upper or 0.0
    if value is None:
        return min(max(0.0, lower), upper)
    if not lower - _BEYOND <= value <= upper + _BEYOND:
        ends = f"{lower:g} to {upper:g}"
        raise InputError(f"joint {joint.name!r} cannot stand at {value:g}, only at {ends}")
    return value
