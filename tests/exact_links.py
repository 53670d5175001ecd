"""What a URDF and an SRDF say of a robot's links and joints, read anew for checks of ours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray


class Followed(NamedTuple):
    """What a joint's value is: ratio times that of a coordinate, by its number, plus offset."""

    coordinate: int
    ratio: float
    offset: float


class Links:
    """Args:
    file: the URDF.
    coordinates: names of the joints that move and mimic no other.
    srdf: the SRDF, if there is one.
    """

    def __init__(self, file: Path, coordinates: Sequence[str], srdf: Path | None) -> None:
        self._coordinates = list(coordinates)
        root = ElementTree.parse(file).getroot()
        self._solid = {
            one.attrib["name"] for one in root.findall("link") if one.find("collision") is not None
        }
        self._joints = {one.attrib["name"]: one for one in root.findall("joint")}
        self._carrier = {_end(one, "child"): one for one in self._joints.values()}
        self._told = ElementTree.parse(srdf).getroot() if srdf else ElementTree.Element("robot")

    @cached_property
    def followed(self) -> dict[str, Followed]:
        """What each joint that moves follows, by name."""
        found = {}
        for name in self._joints:
            root, ratio, offset = self._root(name)
            if root in self._coordinates:
                found[name] = Followed(self._coordinates.index(root), ratio, offset)
        return found

    def _root(self, name: str) -> tuple[str, float, float]:
        """The joint at which a joint's mimicking ends, and how it follows that."""
        mimic = self._joints[name].find("mimic")
        if mimic is None:
            return name, 1.0, 0.0
        root, ratio, offset = self._root(mimic.attrib["joint"])
        by, more = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
        return root, by * ratio, by * offset + more

    @cached_property
    def wraps(self) -> NDArray[np.bool_]:
        """Which coordinates turn for ever, (d,): continuous ones that no other joint follows but
        such as turn by whole numbers of theirs."""
        found = [self._joints[name].attrib["type"] == "continuous" for name in self._coordinates]
        for name, (coordinate, ratio, _) in self.followed.items():
            if not ratio.is_integer() or self._joints[name].attrib["type"] == "prismatic":
                found[coordinate] = False
        return np.array(found)

    def still(self, joints: Sequence[str], state: str) -> Iterator[tuple[str, float]]:
        """Which of some joints stand still, and where: in a state of the SRDF's, or at 0, or as
        near as their limits allow; or as they follow others."""
        told = dict(self._of_state(state)) if state else {}
        for name in joints:
            if name not in self.followed:
                root, ratio, offset = self._root(name)
                yield name, ratio * told.get(root, self._nearest_to_0(root)) + offset

    def _of_state(self, name: str) -> Iterator[tuple[str, float]]:
        states = self._told.findall("group_state")
        for joint in (j for one in states if one.get("name") == name for j in one):
            numbers = joint.attrib["value"].split()
            if len(numbers) == 1:
                yield joint.attrib["name"], float(numbers[0])

    def _nearest_to_0(self, name: str) -> float:
        joint = self._joints[name]
        limit = joint.find("limit")
        if joint.attrib["type"] not in ("revolute", "prismatic") or limit is None:
            return 0.0
        return float(np.clip(0.0, float(limit.get("lower", 0)), float(limit.get("upper", 0))))

    def may_touch(self, a: str, b: str) -> bool:
        """Whether two links may: by the SRDF, or as no other with a solid is between them, and
        what moves is between the one and where the two branch."""
        return frozenset((a, b)) in self._disabled or (a, b) in self._joined

    @cached_property
    def _joined(self) -> set[tuple[str, str]]:
        found = set()
        for a in self._solid:
            for b in self._solid:
                one, other = self._upward(a), self._upward(b)
                shared = next(link for link in one if link in other)
                below, beside = one[: one.index(shared)], other[: other.index(shared)]
                between = {*below, shared, *beside} - {a, b}
                if not self._solid & between and not (self._move(below) and self._move(beside)):
                    found.add((a, b))
        return found

    def _upward(self, link: str) -> list[str]:
        """A link and all between it and the base."""
        if link not in self._carrier:
            return [link]
        return [link, *self._upward(_end(self._carrier[link], "parent"))]

    def _move(self, links: Sequence[str]) -> bool:
        return any(self._carrier[link].attrib["name"] in self.followed for link in links)

    @cached_property
    def _disabled(self) -> set[frozenset[str]]:
        def pairs(tag: str) -> set[frozenset[str]]:
            return {frozenset((o.attrib["link1"], o.attrib["link2"])) for o in self._told.iter(tag)}

        links = [one.attrib["link"] for one in self._told.iter("disable_default_collisions")]
        every = {frozenset((a, b)) for a in links for b in self._solid}
        return pairs("disable_collisions") | (every - pairs("enable_collisions"))


def _end(joint: Any, which: str) -> str:
    end = joint.find(which)
    return str(end.attrib["link"])
