"""Problems of OMPL.app: `.cfg` files of a rigid body, a world, a start and a goal.

    [problem]
    robot = table.dae
    world = house.dae
    start.x = 10
    start.y = 20
    start.z = 46
    start.theta = 1.57
    start.axis.x = 0
    start.axis.y = 0
    start.axis.z = 1
    ... the same of goal ...
    volume.min.x = 0
    ...
    volume.max.z = 142

The form is that of Boost's program options. A problem without z and axis is one in the plane.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envs.errors import InputError, brief, input_error_of, suggestion
from envs.files.git_lfs import check_file_is_no_pointer
from envs.files.paths import exists, safe_join
from envs.problem import Array

_MOST_BYTES = 2**20

_FARTHEST = 1e9
"""Of all numbers, whose squares shall not overflow."""

_IN_PLANE = ("x", "y", "theta")
_OF_POSE = ("x", "y", "z", "theta", "axis.x", "axis.y", "axis.z")
_ENDS = ("start", "goal")
_SPATIAL = [f"{end}.{key}" for end in _ENDS for key in _OF_POSE if key not in _IN_PLANE]
_OF_VOLUME = tuple(f"volume.{end}.{axis}" for end in ("min", "max") for axis in "xyz")
_KEYS = (
    "robot",
    "world",
    "control",
    *(f"{end}.{key}" for end in _ENDS for key in _OF_POSE),
    *_OF_VOLUME,
)
"""Of the section `problem`, those that say what the problem is."""

_PLACES = ("start.", "goal.", "volume.")
"""What other keys begin with that may only be misspelt."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the body is: the position (3,), and how it is turned, about an axis (3,) of any length
    by an angle in radians. In the plane z is 0 and the axis is that of z."""

    position: Array
    axis: Array
    angle: float

    @property
    def quaternion(self) -> Array:
        """As x, y, z, w; of an axis without length that of no turn."""
        length = float(np.linalg.norm(self.axis))
        if length == 0:
            return np.array([0.0, 0, 0, 1])
        sine = math.sin(self.angle / 2) / length
        return np.array([*(sine * self.axis), math.cos(self.angle / 2)])


@dataclass(frozen=True, eq=False)
class RigidBodyProblem:
    """What a file says.

    Attributes:
        robot, world: mesh files.
        planar: whether the body moves in the plane.
        start, goal: of the body's centre.
        volume: the bounds of positions, lower and upper, each (3,) or in the plane (2,); None where
            the file has none.
    """

    robot: Path
    world: Path
    planar: bool
    start: Pose
    goal: Pose
    volume: tuple[Array, Array] | None


def read_problem(file: str | Path) -> RigidBodyProblem:
    """Reads a `.cfg` file. Paths in it are relative to its folder; sections other than `problem`
    are passed over.

    Raises:
        InputError: there is no such file, or it does not hold a problem of a rigid body that moves
            freely.
    """
    path = Path(file)
    if not exists(path.is_file):
        raise InputError(f"no such file: {file}")
    if path.stat().st_size > _MOST_BYTES:
        raise InputError(f"{file} has more than {_MOST_BYTES} bytes, which no problem needs")
    check_file_is_no_pointer(path)
    with input_error_of(f"cannot read {file}", UnicodeDecodeError):
        text = path.read_text(encoding="utf-8-sig")
    return _Section(dict(_entries(text, file)), file).problem(path.parent)


def _entries(text: str, file: str | Path) -> Iterator[tuple[str, str]]:
    """Keys and values of the section `problem`."""
    section, seen = "", set[str]()
    for number, line in enumerate(text.splitlines(), 1):
        line = line.partition("#")[0].strip()
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1].strip() + "."
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        key = section + key
        if not line or not key.startswith("problem."):
            continue
        key = key.removeprefix("problem.")
        if not equals:
            raise InputError(f"{file}: line {number} is no KEY = VALUE: {brief(line)}")
        if key in seen:
            raise InputError(f"{file}: line {number} says {key} again; keep one")
        if key.startswith(_PLACES) and key not in _KEYS:
            raise InputError(f"{file}: line {number}: unknown {key!r}; {suggestion(key, _KEYS)}")
        seen.add(key)
        yield key, value


class _Section:
    """The section `problem` of a file."""

    def __init__(self, values: Mapping[str, str], file: str | Path) -> None:
        self._values = values
        self._file = file

    def problem(self, folder: Path) -> RigidBodyProblem:
        if not self._values:
            raise InputError(f"{self._file}: no [problem] in it; is it a .cfg file of OMPL.app?")
        control = self._values.get("control")
        if control:
            raise InputError(
                f"{self._file}: control = {control}: what moves by controls is no rigid body that "
                "moves freely; take that line out to plan for one"
            )
        planar = not any(key in self._values for key in _SPATIAL)
        return RigidBodyProblem(
            safe_join(folder, self._text("robot")),
            safe_join(folder, self._text("world")),
            planar,
            self._pose("start", planar),
            self._pose("goal", planar),
            self._volume(2 if planar else 3),
        )

    def _pose(self, end: str, planar: bool) -> Pose:
        keys = _IN_PLANE if planar else _OF_POSE
        said = {key: self._number(f"{end}.{key}") for key in keys}
        if planar:
            position, axis = [said["x"], said["y"], 0.0], [0.0, 0.0, 1.0]
        else:
            position, axis = ([said[f"{of}{key}"] for key in "xyz"] for of in ("", "axis."))
        pose = Pose(np.array(position), np.array(axis), said["theta"])
        if pose.angle and not pose.axis.any():
            raise InputError(
                f"{self._file}: {end}.theta is {pose.angle:g}, but {end}.axis has no length; give "
                "the axis it turns about"
            )
        return pose

    def _volume(self, size: int) -> tuple[Array, Array] | None:
        wanted = [key for key in _OF_VOLUME if size == 3 or not key.endswith(".z")]
        missing = [key for key in wanted if key not in self._values]
        if len(missing) == len(wanted):
            return None
        if missing:
            raise InputError(
                f"{self._file}: the volume lacks {', '.join(missing)}; give all of it, or none for "
                "that of the world"
            )
        lower, upper = np.array([self._number(key) for key in wanted]).reshape(2, size)
        for axis, low, high in zip("xyz", lower, upper, strict=False):
            if low >= high:
                raise InputError(
                    f"{self._file}: volume.min.{axis} is {low:g}, which is not below "
                    f"volume.max.{axis}, {high:g}"
                )
        return lower, upper

    def _text(self, key: str) -> str:
        value = self._values.get(key, "")
        if not value:
            raise InputError(f"{self._file}: its [problem] has no {key}; {self._near(key)}")
        return value

    def _number(self, key: str) -> float:
        text = self._text(key)
        try:
            value = float(text) if text.isascii() and "_" not in text else math.nan
        except ValueError:
            value = math.nan
        if not abs(value) <= _FARTHEST:
            raise InputError(
                f"{self._file}: {key} must be a finite number up to {_FARTHEST:g}, not "
                f"{brief(text)}"
            )
        return value

    def _near(self, key: str) -> str:
        others = [one for one in self._values if one not in _KEYS]
        near = difflib.get_close_matches(key, others, n=1)
        return f"is it what {near[0]!r} should say?" if near else f"add {key} = ..."
