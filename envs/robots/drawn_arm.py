"""What pictures show of an arm: where its file has more to look at than what collides."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from envs.collision.shapes import PlacedShape, Solid
from envs.errors import InputError, tell_once
from envs.files.mesh_file import read_surface
from envs.problem import Array
from envs.robots.arm import Arm, Part
from envs.robots.urdf_elements import parsed
from envs.robots.urdf_geometry import shapes_of_link

_NAMED = 3
"""Links that a line names."""


class DrawnArm:
    """An arm as its URDF draws it: of links whose <visual> geometry is there that, of others what
    collides. See `envs.collision.shapes.Bodies`.

    Args:
        arm: the robot.
        urdf: its file, which is read when a picture asks.
    """

    def __init__(self, arm: Arm, urdf: Path) -> None:
        self._arm, self._urdf = arm, urdf

    @cached_property
    def _parts(self) -> Sequence[Part]:
        """Those that move come first."""
        found = drawn_parts(self._urdf, self._arm)
        return sorted(found, key=lambda part: part.body == 0)

    @property
    def shapes(self) -> tuple[Solid, ...]:
        return tuple(part.placed.solid for part in self._parts)

    @property
    def moving(self) -> int:
        return sum(part.body > 0 for part in self._parts)

    def poses(self, q: Array) -> Array:
        bodies = self._arm.body_poses(q)[[part.body for part in self._parts]]
        offsets = np.array([part.placed.pose for part in self._parts])
        found: Array = bodies[:, :, :3] @ offsets[:, :3]
        found[:, :, 3] += bodies[:, :, 3]
        return found


def drawn_parts(urdf: Path, arm: Arm) -> list[Part]:
    """The shapes of an arm's links that pictures show, in the order of the links. A line names the
    links that have visual meshes which are not there, or cannot be read.

    Raises:
        InputError: the file cannot be read.
    """
    elements = {link.get("name"): link for link in parsed(urdf)[1].findall("link")}
    collides: dict[str, list[Part]] = {}
    for part, name in zip(arm.parts, arm.links, strict=True):
        collides.setdefault(name, []).append(part)
    found, missing = [], []
    for link in arm.tree.links:
        element = elements.get(link.name)
        visual = None if element is None else _visual(element, urdf.parent)
        if visual:
            placed = [PlacedShape(one.solid, link.offset @ one.pose) for one in visual]
            found += [Part(link.body, one, link.name) for one in placed]
        else:
            found += collides.get(link.name, [])
        if visual is None and element is not None:
            missing.append(link.name)
    if missing:
        named = ", ".join(map(repr, missing[:_NAMED]))
        more = f" and {len(missing) - _NAMED} more" if len(missing) > _NAMED else ""
        what = "pictures show collision geometry where visual meshes are not"
        tell_once(f"{urdf}: {what}: {named}{more}")
    return found


def _visual(element: ElementTree.Element, folder: Path) -> list[PlacedShape] | None:
    """The visual shapes of a link; None if some are not there or cannot be read."""
    try:
        return shapes_of_link(element, "visual", folder, read_surface)
    except InputError:
        return None
