"""SRDF files, as MoveIt's: planning groups, named states, and which links may touch each other."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from envs.errors import InputError, UnknownNameError, suggestion, tell_once
from envs.robots.joint_graph import JointGraph, VirtualJoint
from envs.robots.urdf_elements import numbers_of, read_xml

_NEEDED = {
    "chain": ("base_link", "tip_link"),
    "disable_collisions": ("link1", "link2"),
    "enable_collisions": ("link1", "link2"),
    "disable_default_collisions": ("link",),
    "virtual_joint": ("name", "type", "child_link"),
    **dict.fromkeys(("group", "group_state", "link", "joint"), ("name",)),
}
"""Attributes that elements must have."""

_TYPES = ("fixed", "planar", "floating")
"""Of virtual joints."""

_COUNTS = (1, 3, 4, 7)
"""How many values a joint may have; 4 a ball, which other formats than URDF have."""


@dataclass(frozen=True)
class Group:
    """What a planning group is made of: names of links, whose joints it has, joints, and other
    groups; chains, each by the links at its ends."""

    links: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    chains: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Srdf:
    """What an SRDF file says of a robot; by default nothing.

    Attributes:
        file: for messages.
        groups: by name.
        states: by name, the values of joints in each of the group states of that name.
        virtual: by name, the joints between the world and the robot.
        disabled, enabled: pairs of names of links whose collisions are.
        disabled_links: names of those whose collisions are disabled with all but those enabled.
    """

    file: Path | None = None
    groups: Mapping[str, Group] = field(default_factory=dict)
    states: Mapping[str, list[dict[str, tuple[float, ...]]]] = field(default_factory=dict)
    virtual: Mapping[str, VirtualJoint] = field(default_factory=dict)
    disabled: frozenset[frozenset[str]] = frozenset()
    enabled: frozenset[frozenset[str]] = frozenset()
    disabled_links: frozenset[str] = frozenset()

    def joints_of(self, name: str, graph: JointGraph) -> set[str]:
        """The names of the joints of a group, fixed ones and such that mimic others, too; of
        virtual ones those that the graph has.

        Raises:
            InputError: there is no such group, or it names what the robot does not have.
        """
        group = self.members(name)
        found: set[str] = set()
        for joint in group.joints:
            if joint not in self.virtual or graph.has(joint):
                found |= set(graph.named(joint))
        for link in group.links:
            found |= set(graph.way_to(link)[:1])
        for base, tip in group.chains:
            found |= set(graph.way_to(tip)) ^ set(graph.way_to(base))
        return found

    def members(self, name: str, within: tuple[str, ...] = ()) -> Group:
        """A group with what the groups within it are made of in their place.

        Raises:
            InputError: there is no such group, or it is within itself.
        """
        if name not in self.groups:
            raise UnknownNameError("group", name, self.groups)
        if name in within:
            circle = ", ".join(map(repr, within))
            raise InputError(f"groups {circle} are within each other; remove one")
        group = self.groups[name]
        all_of_it = [group, *(self.members(other, (*within, name)) for other in group.groups)]
        return Group(
            tuple(link for one in all_of_it for link in one.links),
            tuple(joint for one in all_of_it for joint in one.joints),
            chains=tuple(chain for one in all_of_it for chain in one.chains),
        )

    def state(self, name: str) -> dict[str, tuple[float, ...]]:
        """The values of joints in the group states of a name, by the joints' names; most have one.

        Raises:
            InputError: there is none, or two differ.
        """
        if name not in self.states:
            raise UnknownNameError("state", name, self.states)
        found: dict[str, tuple[float, ...]] = {}
        for values in self.states[name]:
            for joint, value in values.items():
                if found.setdefault(joint, value) != value:
                    raise InputError(
                        f"two groups have a state {name!r} with other values of {joint!r}; say "
                        "pose=JOINT:VALUE instead"
                    )
        return found

    def allowed(self, links: Collection[str]) -> frozenset[frozenset[str]]:
        """Which pairs of a robot's links may touch. Names of links that it does not have count for
        nothing, which is said."""
        whatever = {frozenset((a, b)) for a in self.disabled_links for b in links}
        pairs = self.disabled | whatever - self.enabled
        unknown = sorted(frozenset[str]().union(*pairs) - set(links))
        if unknown:
            named = ", ".join(map(repr, unknown[:_NAMED])) + (", ..." if unknown[_NAMED:] else "")
            tell_once(f"{self.file}: disables collisions of {named}, not among the robot's links")
        return frozenset(pair for pair in pairs if pair <= set(links))


_NAMED = 5
"""Links that are named."""


def read_srdf(file: Path) -> Srdf:
    """Reads an SRDF file. Passive joints and end effectors are not used.

    Raises:
        InputError: there is no such file, or it is no SRDF.
    """
    try:
        root = read_xml(file, "SRDF")
        for element in root.iter():
            _check(element)
        return _srdf(file, root)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


def _check(element: Any) -> None:
    missing = [key for key in _NEEDED.get(element.tag, ()) if not element.get(key)]
    if missing:
        raise InputError(f"has a <{element.tag}> without {' and '.join(missing)}; add it")


def _srdf(file: Path, root: Any) -> Srdf:
    states: dict[str, list[dict[str, tuple[float, ...]]]] = {}
    for state in root.findall("group_state"):
        states.setdefault(state.get("name"), []).append(_values(state))
    return Srdf(
        file,
        {group.get("name"): _group(group) for group in root.findall("group")},
        states,
        {one.get("name"): _virtual(one) for one in root.findall("virtual_joint")},
        _pairs(root, "disable_collisions"),
        _pairs(root, "enable_collisions"),
        frozenset(one.get("link") for one in root.findall("disable_default_collisions")),
    )


def _group(group: Any) -> Group:
    chains = [(one.get("base_link"), one.get("tip_link")) for one in group.findall("chain")]
    links, joints, groups = (tuple(_names(group, tag)) for tag in ("link", "joint", "group"))
    return Group(links, joints, groups, tuple(chains))


def _virtual(joint: Any) -> VirtualJoint:
    name, kind, child = (joint.get(key) for key in _NEEDED["virtual_joint"])
    if kind not in _TYPES:
        raise InputError(f"virtual joint {name!r} is of type {kind!r}; {suggestion(kind, _TYPES)}")
    return VirtualJoint(name, kind, child)


def _names(parent: Any, tag: str) -> Iterable[str]:
    return (one.get("name") for one in parent.findall(tag))


def _pairs(root: Any, tag: str) -> frozenset[frozenset[str]]:
    return frozenset(frozenset((one.get("link1"), one.get("link2"))) for one in root.findall(tag))


def _values(state: Any) -> dict[str, tuple[float, ...]]:
    texts = {joint.get("name"): joint.get("value", "") for joint in state.findall("joint")}
    try:
        return {name: tuple(numbers_of("value", text, _COUNTS)) for name, text in texts.items()}
    except InputError as error:
        raise InputError(f"state {state.get('name')!r}: {error}") from error
