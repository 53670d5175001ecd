"""Scenes of solid obstacles from small YAML files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from envs.collision.shapes import PlacedShape
from envs.errors import InputError, UnknownNameError, brief, input_error_of, suggestion
from envs.files.paths import exists
from envs.scenes.scene_obstacles import obstacle_of


@dataclass(frozen=True, eq=False)
class Scene:
    """What a scene file says; by default nothing.

    Attributes:
        file: for messages.
        obstacles: in the frame of the world, in the file's order.
        names: of the obstacles, "" of those that have none.
        allowed: pairs of names of links and obstacles that may touch each other.
    """

    file: Path
    obstacles: Sequence[PlacedShape] = ()
    names: Sequence[str] = ()
    allowed: Sequence[tuple[str, str]] = ()

    def check_names(self, links: Sequence[str]) -> None:
        """Checks what `allowed` names against the names of a robot's links.

        Raises:
            InputError: something else is named, or what would be allowed is not forbidden.
        """
        both = sorted(set(links) & set(self.names))
        if self.allowed and both:
            raise InputError(f"{self.file}: a link and an obstacle are called {both[0]!r}")
        known = (*links, *filter(None, self.names))
        for pair in self.allowed:
            for name in pair:
                if name not in known:
                    error = UnknownNameError("link or obstacle", name, known)
                    raise InputError(f"{self.file}: allowed_collisions: {error}")
            if set(pair) <= set(self.names):
                said = f"{' and '.join(map(repr, pair))} are obstacles, which may touch anyway"
                raise InputError(f"{self.file}: allowed_collisions: {said}; leave that pair out")

    @cached_property
    def _pairs(self) -> frozenset[frozenset[str]]:
        return frozenset(map(frozenset, self.allowed))

    def allowed_links(self, links: Sequence[str]) -> frozenset[frozenset[str]]:
        """The allowed pairs of which both are among the links."""
        return frozenset(pair for pair in self._pairs if pair <= set(links))

    def allows(self, link: str, obstacle: str) -> bool:
        """Whether a link and an obstacle may touch, by their names."""
        return frozenset((link, obstacle)) in self._pairs


def read_scene(file: Path) -> Scene:
    """Reads obstacles from a file such as

        obstacles:
          - box: [0.6, 1.2, 0.05]    # full sides
            name: table              # for messages and allowed_collisions; none unless given
            position: [0.5, 0, 0.2]  # of its middle; [0, 0, 0] unless given
          - sphere: 0.1              # radius
            position: [0.3, -0.4, 0.6]
          - cylinder: [0.05, 0.4]    # radius and length, along its own z
          - capsule: [0.05, 0.4]     # the same, with half a ball on either end of the length
            rpy: [0, 1.5708, 0]      # roll, pitch, yaw as in URDF; [0, 0, 0] unless given
          - mesh: shelf.stl          # from this file's folder or the one above; watertight
            scale: 0.001             # 1 unless given
          - hull: rock.obj           # all between the points of a file, with faces or without;
                                     # or a list of at least 4 points [x, y, z]
        allowed_collisions:          # pairs of links and obstacles that may touch
          - [left_finger, right_finger]

    Lengths are in metres, angles in radians, positions in the frame of the world, which is that of
    the arm's base unless that is placed elsewhere; none is more than `LARGEST`, and the file has at
    most 256 KiB.

    Raises:
        InputError: there is no such file, or it is not such a file.
    """
    try:
        content = _content(file)
        named = [_obstacle(*one, file.parent) for one in enumerate(content["obstacles"], start=1)]
        allowed = _allowed(content.get("allowed_collisions", []))
        names, obstacles = zip(*named, strict=True)
        _check_unique(names)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    return Scene(file, obstacles, names, allowed)


class _Loader(yaml.SafeLoader):
    """Refuses a key given twice, of which YAML's own loader drops the first in silence, and merged
    mappings (<<), a few lines of which can stand for more entries than memory holds."""

    def compose_mapping_node(self, anchor: dict[Any, yaml.Node]) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        where = f"in the mapping at line {node.start_mark.line + 1}"
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise InputError(f"{key.value!r} is given twice {where}")
            if key.tag == _MERGE:
                raise InputError(f"'<<' {where} is not supported; write the keys out")
            seen.add(key.value)
        return node


_MERGE = "tag:yaml.org,2002:merge"

_ODD_SCALARS = (
    *(ValueError, TypeError, AttributeError, LookupError),
    *(ArithmeticError, RecursionError),
)
"""What PyYAML raises besides its own, on scalars that are not what their tags say and on depth."""

_MOST_BYTES = 2**18
"""Of a scene, thousands of obstacles; PyYAML reads some tens of kilobytes a second."""


def _content(file: Path) -> dict[Any, Any]:
    if not exists(file.is_file):
        raise InputError("no such file")
    try:
        with input_error_of("cannot be read"):
            size = file.stat().st_size
            if size > _MOST_BYTES:
                raise InputError(f"has {size} bytes; scenes of at most {_MOST_BYTES} are read")
            content = yaml.load(file.read_bytes(), _Loader)
    except InputError:
        raise
    except (yaml.YAMLError, *_ODD_SCALARS) as error:
        raise InputError(f"not YAML, mend it: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise InputError("must be a mapping with the key 'obstacles'")
    for key in content:
        if key not in _KEYS:
            raise InputError(f"unknown key {brief(key)}; {suggestion(brief(key), _KEYS)}")
    if not isinstance(content.get("obstacles"), list) or not content["obstacles"]:
        raise InputError("'obstacles' must be a list of at least one obstacle")
    return content


_KEYS = ("obstacles", "allowed_collisions")


def _obstacle(number: int, entry: Any, folder: Path) -> tuple[str, PlacedShape]:
    try:
        return obstacle_of(entry, folder)
    except ValueError as error:  # InputError, or a shape's own
        raise InputError(f"obstacle {number}: {error}") from error


def _allowed(pairs: Any) -> list[tuple[str, str]]:
    if not isinstance(pairs, list):
        raise InputError(f"allowed_collisions must be a list of pairs, not {brief(pairs)}")
    for pair in pairs:
        names = pair if isinstance(pair, list) else []
        of_names = all(isinstance(name, str) for name in names)
        if not (len(names) == 2 and of_names and names[0] != names[1]):
            wanted = "two names of links or obstacles, as in [hand, table]"
            raise InputError(f"allowed_collisions: each must be {wanted}, not {brief(pair)}")
    return [(one, other) for one, other in pairs]


def _check_unique(names: Sequence[str]) -> None:
    for number, name in enumerate(names):
        if name and name in names[:number]:
            raise InputError(f"two obstacles are called {name!r}; rename one")
