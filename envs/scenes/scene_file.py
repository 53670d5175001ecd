"""Scenes of solid obstacles from files: our own YAML, and MoveIt's planning scenes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from envs.collision.shapes import PlacedShape
from envs.errors import InputError, UnknownNameError, brief, input_error_of, suggestion
from envs.files.allowed_collision_matrix import AllowedCollisionMatrix
from envs.files.git_lfs import check_is_no_pointer
from envs.files.moveit_text import read_scene_text
from envs.files.moveit_yaml import KEYS, planning_scene_of
from envs.files.paths import exists
from envs.files.planning_scene import PlanningScene
from envs.files.yaml_text import parsed_yaml
from envs.problem import Array
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

    def touching(self, links: Sequence[str]) -> Callable[[str, str], bool] | None:
        """Whether a link may touch an obstacle, by their names; None where none may any."""
        return self.allows if self.allowed else None


@dataclass(frozen=True, eq=False)
class MoveItScene(Scene):
    """A planning scene of MoveIt, whose `matrix` says what may touch what, and may name what is not
    there."""

    matrix: AllowedCollisionMatrix = field(default_factory=AllowedCollisionMatrix)

    @classmethod
    def of(cls, planning: PlanningScene, file: Path) -> MoveItScene:
        """What a file says."""
        return cls(file, planning.obstacles, planning.names, matrix=planning.allowed)

    def allowed_links(self, links: Sequence[str]) -> frozenset[frozenset[str]]:
        return self.matrix.pairs(links)

    def touching(self, links: Sequence[str]) -> Callable[[str, str], bool] | None:
        return self.matrix.touching(links, self.names)


def read_scene(file: Path, frames: Mapping[str, Array] | None = None) -> Scene:
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
    most 4 MiB.

    Planning scenes of MoveIt are read as well: YAML (see `envs.files.moveit_yaml`), and the text of
    files that end in .scene (see `envs.files.moveit_text`).

    Args:
        file: any of these.
        frames: by the names of links that stand still, poses (4, 4) in the world, for planning
            scenes that have poses in them.

    Raises:
        InputError: there is no such file, or it is not such a file.
    """
    try:
        text = _text(file)
        if _is_text(file):
            return MoveItScene.of(read_scene_text(text), file)
        content = parsed_yaml(text)
        if isinstance(content, dict) and content.keys() & _OF_MOVEIT:
            return MoveItScene.of(planning_scene_of(content, frames or {}), file)
        return _own(content, file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


_MOST_BYTES = 2**22
"""Of a scene in YAML, tens of thousands of obstacles; a megabyte takes a second."""

_MOST_BYTES_OF_TEXT = 2**25
"""Of one in MoveIt's text."""

_OF_MOVEIT = frozenset(KEYS) - {"name"}
"""Keys by one of which a planning scene is known."""


def _is_text(file: Path) -> bool:
    """Whether it is a scene in MoveIt's text, and not in YAML."""
    return file.suffix.lower() == ".scene"


def _text(file: Path) -> bytes:
    if not exists(file.is_file):
        raise InputError("no such file")
    with input_error_of("cannot be read"):
        size = file.stat().st_size
        most = _MOST_BYTES_OF_TEXT if _is_text(file) else _MOST_BYTES
        if size > most:
            raise InputError(f"has {size} bytes; scenes of at most {most} are read")
        content = file.read_bytes()
    check_is_no_pointer(content)
    return content


def _own(content: Any, file: Path) -> Scene:
    """That of YAML as `read_scene` has it."""
    if not isinstance(content, dict):
        raise InputError("must be a mapping with the key 'obstacles'")
    for key in content:
        if key not in _KEYS:
            raise InputError(f"unknown key {brief(key)}; {suggestion(key, _KEYS)}")
    if not isinstance(content.get("obstacles"), list) or not content["obstacles"]:
        raise InputError("'obstacles' must be a list of at least one obstacle")
    named = [_obstacle(*one, file.parent) for one in enumerate(content["obstacles"], start=1)]
    allowed = _allowed(content.get("allowed_collisions", []))
    names, obstacles = zip(*named, strict=True)
    _check_unique(names)
    return Scene(file, obstacles, names, allowed)


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
