"""Files of robometrics (fishbotics/robometrics): problems of Franka's Panda by the names of their
scenes.

    box_panda:
      - start: [0, -0.785, 0, -2.356, 0, 1.571, 0.785]
        goal_ik:                    # configurations, any of which will do
          - [0.3, 0.2, 0.1, -1.9, 0.1, 2.2, 0.9]
        goal_pose: {frame: panda_hand, position_xyz: [...], quaternion_wxyz: [...]}
        collision_buffer_ik: 0.0
        world_frame: panda_link0
        obstacles:
          cuboid: {side: {dims: [0.7, 0.7, 0.04], pose: [x, y, z, qw, qx, qy, qz]}}
          cylinder: {can: {height: 0.14, radius: 0.03, pose: [x, y, z, qw, qx, qy, qz]}}

Lengths are in metres, full ones; angles in radians. Poses are in the world's frame, which is that
of a link. The goal's pose is passed over, as the configurations are what reaches it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from envs.collision.shapes import Box, Cylinder, PlacedShape, Solid, Sphere
from envs.errors import InputError, brief, input_error_of, suggestion, tell_once
from envs.files.git_lfs import check_file_is_no_pointer
from envs.files.paths import atomic_write, cache_folder, exists
from envs.files.yaml_text import (
    list_of,
    mapping_of,
    name_of,
    number_of,
    numbers_of,
    parsed_yaml,
    rotation_of,
)
from envs.problem import Array

_MOST_BYTES = 2**26
"""Of a file; that of the largest set has 13 MB."""

_LARGE = 2**20
"""Bytes that take a second or so."""

_KEPT = 1
"""The version of what is kept of a file."""

_KEYS = ("start", "goal_ik", "obstacles")
"""What each problem has."""


@dataclass(frozen=True, eq=False)
class RobometricsProblem:
    """A problem as the file has it.

    Attributes:
        scene: the name of its scene.
        start: (d,).
        goals: (g, d), any of which will do; of some problems there are none.
        obstacles: in the world's frame.
        names: of the obstacles.
        frame: the link whose frame the world's is; "" for the robot's base.
        buffer: what was added to the radii of the robot's spheres when the goals were sought, in
            metres: below 0, there were none with the spheres as they are.
    """

    scene: str
    start: Array
    goals: Array
    obstacles: tuple[PlacedShape, ...]
    names: tuple[str, ...]
    frame: str
    buffer: float


@dataclass(frozen=True, eq=False)
class RobometricsFile:
    """What a file says.

    Attributes:
        file: for messages.
        digest: of its content.
        scenes: by name, its problems as the file has them, in its order.
    """

    file: Path
    digest: str
    scenes: Mapping[str, Sequence[Any]]

    def problems(self, scene: str, size: int) -> Sequence[RobometricsProblem]:
        """The problems of a scene, in the file's order.

        Args:
            scene: its name.
            size: the numbers d of a configuration.

        Raises:
            InputError: there is no such scene, or one of its problems is malformed.
        """
        if scene not in self.scenes:
            hint = suggestion(scene, self.scenes)
            raise InputError(f"{self.file}: no scene is called {scene!r}; {hint}")
        return [
            self._problem(scene, number, entry, size)
            for number, entry in enumerate(self.scenes[scene])
        ]

    def _problem(self, scene: str, number: int, entry: Any, size: int) -> RobometricsProblem:
        try:
            return _problem(scene, mapping_of(entry, "a problem"), size)
        except InputError as error:
            raise InputError(f"{self.file}: {scene}, problem {number}: {error}") from error


def read_robometrics(file: Path) -> RobometricsFile:
    """Reads a file. What is in it is kept in the user's cache, as parsing such YAML takes seconds.

    Raises:
        InputError: it cannot be read, or is no mapping of scenes' names to lists.
    """
    if not exists(file.is_file):
        raise InputError(f"no such file: {file}")
    check_file_is_no_pointer(file)
    with input_error_of(f"{file} cannot be read"):
        if file.stat().st_size > _MOST_BYTES:
            raise InputError(f"{file} has more than {_MOST_BYTES} bytes")
        text = file.read_bytes()
    digest = hashlib.sha256(text).hexdigest()
    return RobometricsFile(file, digest, _scenes(file, digest))


@lru_cache(maxsize=2)
def _scenes(file: Path, digest: str) -> Mapping[str, Sequence[Any]]:
    kept = cache_folder() / "problems" / f"{digest[:16]}-robometrics-{_KEPT}.json"
    with suppress(OSError, ValueError):
        found = json.loads(kept.read_bytes())
        if isinstance(found, dict):
            return found
    text = file.read_bytes()
    if len(text) > _LARGE:
        tell_once(
            f"{file}: it is parsed once, which takes some {len(text) / _LARGE:.0f} s, and kept"
        )
    try:
        content = mapping_of(parsed_yaml(text), "its content")
        scenes = {name_of(name): _shortened(name, problems) for name, problems in content.items()}
        if not any(scenes.values()):
            raise InputError("it has no problems")
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    # Where nothing can be kept, or it holds what JSON cannot, it is parsed each time.
    with suppress(OSError, ValueError, TypeError):
        kept.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(kept) as part:
            part.write_text(json.dumps(scenes, allow_nan=False), encoding="utf-8")
    return scenes


def _shortened(name: Any, problems: Any) -> list[Any]:
    """The problems of a scene, without what is passed over."""
    entries = list_of(problems, f"scene {brief(name)}")
    return [
        {key: value for key, value in entry.items() if key != "goal_pose"}
        if isinstance(entry, dict)
        else entry
        for entry in entries
    ]


def _problem(scene: str, entry: Mapping[Any, Any], size: int) -> RobometricsProblem:
    for key in _KEYS:
        if key not in entry:
            raise InputError(f"it has no {key}")
    start = numbers_of(entry["start"], size, "start")
    goals = [numbers_of(one, size, "a goal_ik") for one in list_of(entry["goal_ik"], "goal_ik")]
    named = list(_obstacles(mapping_of(entry["obstacles"], "obstacles")))
    frame = entry.get("world_frame") or ""
    if not isinstance(frame, str):
        raise InputError("world_frame must be the name of a link")
    return RobometricsProblem(
        scene,
        start,
        np.array(goals).reshape(-1, size),
        tuple(placed for _, placed in named),
        tuple(name for name, _ in named),
        frame,
        number_of(entry.get("collision_buffer_ik", 0), "collision_buffer_ik"),
    )


def _obstacles(kinds: Mapping[Any, Any]) -> Iterator[tuple[str, PlacedShape]]:
    for kind, obstacles in kinds.items():
        if kind not in _SOLIDS:
            hint = suggestion(kind, _SOLIDS)
            raise InputError(f"obstacles are no {brief(kind)} here; {hint}")
        for name, said in mapping_of(obstacles or {}, str(kind)).items():
            what = f"{kind} {brief(name)}"
            entry = mapping_of(said, what)
            yield name_of(name), PlacedShape(_SOLIDS[kind](entry, what), _pose(entry, what))


def _box(entry: Mapping[Any, Any], what: str) -> Solid:
    sides = numbers_of(entry.get("dims"), 3, f"dims of {what}")
    if not (sides > 0).all():
        raise InputError(f"dims of {what} must be above 0, not {sides.tolist()}")
    return Box(np.zeros(3), sides)


def _size(entry: Mapping[Any, Any], key: str, what: str) -> float:
    size = number_of(entry.get(key), f"{key} of {what}")
    if not size > 0:
        raise InputError(f"{key} of {what} must be above 0, not {size:g}")
    return size


def _cylinder(entry: Mapping[Any, Any], what: str) -> Solid:
    return Cylinder(_size(entry, "radius", what), _size(entry, "height", what))


def _sphere(entry: Mapping[Any, Any], what: str) -> Solid:
    return Sphere(_size(entry, "radius", what))


_SOLIDS: Mapping[str, Callable[[Mapping[Any, Any], str], Solid]] = {
    "cuboid": _box,
    "cylinder": _cylinder,
    "sphere": _sphere,
}
"""By the keys of obstacles."""


def _pose(entry: Mapping[Any, Any], what: str) -> Array:
    """(4, 4), of x, y, z and a quaternion w, x, y, z."""
    numbers = numbers_of(entry.get("pose"), 7, f"pose of {what}")
    pose = np.eye(4)
    pose[:3, 3] = numbers[:3]
    pose[:3, :3] = rotation_of(numbers[[4, 5, 6, 3]], f"the end of pose of {what}")
    return pose
