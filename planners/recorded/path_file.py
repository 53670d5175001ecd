"""Files of paths, as other programs write them: what they say, and what is wrong with one.

A file holds any number of paths. Each may say which problem it is for, how long planning took, and
what its planner says of the attempt. A module a format reads and writes: `csv_format`,
`json_format`, `npz_format` and `matrix_format`, by how the file's name ends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from envs import Environment
from envs.errors import InputError, brief, input_error_of, printable, suggestion
from envs.files.git_lfs import check_is_no_pointer
from envs.files.paths import atomic_write
from envs.problem import Array
from planners.base import Status

_MODULES = {
    ".csv": "planners.recorded.csv_format",
    ".json": "planners.recorded.json_format",
    ".npz": "planners.recorded.npz_format",
    ".txt": "planners.recorded.matrix_format",
}

MOST_BYTES = 2**30
"""Of a file, and of what it unpacks to."""

OF_FILES = ("environment", "seed")
OF_PATHS = ("problem", "solve_s", "status", "failure")
"""What files may say of all paths, and of each besides its waypoints."""

_MOST_INTEGER = 2**63 - 1


@dataclass(frozen=True, eq=False)
class RecordedPath:
    """A path that was planned elsewhere, or that none was found.

    Attributes:
        waypoints: float64 (k, d), k >= 2, finite, in the environment's unit; None without a path.
        problem: the index of the problem, from 0; None where it is not said.
        solve_s: the planning time in seconds that is claimed, None where none is.
        status: what its planner says of the attempt.
        failure: why there is no path, in a line; "" where it is not said.
        place: where in the file it is, as in "paths[3]" or "line 12".
    """

    waypoints: Array | None
    problem: int | None = None
    solve_s: float | None = None
    status: Status = Status.EXACT_SOLUTION
    failure: str = ""
    place: str = ""


@dataclass(frozen=True, eq=False)
class PathFile:
    """What a file says.

    Attributes:
        paths: at least one, all with configurations of the same size.
        environment: the fingerprint of the environment that they are for, "" where not said.
        seed: of the problems, None where it is not said.
    """

    paths: tuple[RecordedPath, ...]
    environment: str = ""
    seed: int | None = None


@dataclass(frozen=True)
class Raw:
    """A path as it was read, unchecked.

    Attributes:
        place: where it is.
        said: of `OF_PATHS` and "waypoints", rows of numbers, what the file says. What is left out
            or None is not said.
        rows: where each waypoint is; by default its number.
    """

    place: str
    said: Mapping[str, Any]
    rows: Sequence[str] = ()

    def row(self, number: int) -> str:
        """Where a waypoint is."""
        return self.rows[number] if self.rows else f"{self.place}, waypoint {number}"


def read(file: Path) -> PathFile:
    """Reads a file of paths, in the format that its name ends in.

    Raises:
        InputError: it cannot be read, or is malformed: one line names the file, the place in it,
            and what is wrong.
    """
    module = _module(file)
    with input_error_of(f"cannot read {file}"):
        size = file.stat().st_size
        if size > MOST_BYTES:
            raise InputError(f"{file} has {size} bytes; {MOST_BYTES} are the most")
        data = file.read_bytes()
    try:
        check_is_no_pointer(data)
        of_file, raw = module.parse(data)
        return _checked(of_file, raw)
    except ValueError as error:
        raise InputError(f"{file}: {error}") from error


def write(paths: PathFile, file: Path) -> None:
    """Writes a file of paths, in the format that its name ends in, of which `read` gives the same
    numbers, to the last bit.

    Raises:
        InputError: it cannot be written.
    """
    data: bytes = _module(file).serialised(paths)
    with input_error_of(f"cannot write {file}"), atomic_write(file) as part:
        part.write_bytes(data)


def check_fits(paths: PathFile, env: Environment, file: Path) -> None:
    """Raises InputError if the paths are said to be for another environment, or have configurations
    of another size."""
    if paths.environment not in ("", env.fingerprint):
        raise InputError(
            f"{file} is for the environment of fingerprint {paths.environment}, and this one's is "
            f"{env.fingerprint}: its paths are not for this environment"
        )
    for path in paths.paths:
        if path.waypoints is not None and path.waypoints.shape[1] != env.space.size:
            raise InputError(
                f"{file}: {path.place}: waypoints have {path.waypoints.shape[1]} numbers, and "
                f"configurations here {env.space.size}, in {env.space}"
            )


def decoded(data: bytes) -> str:
    """Text in UTF-8, with or without a mark of byte order in front.

    Raises:
        ValueError: it is none.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is no text in UTF-8") from None


def number(text: str) -> float:
    """The number that a text is, NaN and infinities among them.

    Raises:
        ValueError: it is none.
    """
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


def _module(file: Path) -> Any:
    suffix = file.suffix.lower()
    if suffix not in _MODULES:
        raise InputError(
            f"{file}: the name of a file of paths ends in {', '.join(_MODULES)}; .txt is what "
            "OMPL's printAsMatrix prints"
        )
    return import_module(_MODULES[suffix])


def _checked(of_file: Mapping[str, Any], raw: Sequence[Raw]) -> PathFile:
    """Raises ValueError where something is wrong."""
    _known("it", of_file, OF_FILES)
    environment = of_file.get("environment")
    if environment is not None and not isinstance(environment, str):
        raise ValueError(f"environment is a fingerprint, not {brief(environment)}")
    seed = _count("seed", of_file.get("seed"))
    paths = tuple(_path(one) for one in raw)
    if not paths:
        raise ValueError("it holds no paths")
    _check_widths(paths)
    return PathFile(paths, environment or "", seed)


def _path(raw: Raw) -> RecordedPath:
    said = {name: value for name, value in raw.said.items() if value is not None}
    try:
        _known("it", said, (*OF_PATHS, "waypoints"))
        problem = _count("problem", said.get("problem"))
        solve_s = _seconds(said.get("solve_s"))
        waypoints = None if "waypoints" not in said else _waypoints(raw, said["waypoints"])
        status = _status(said.get("status"), waypoints)
        failure = _line(said.get("failure", ""))
    except _InRowError:
        raise
    except ValueError as error:
        raise ValueError(f"{raw.place}: {error}") from None
    return RecordedPath(waypoints, problem, solve_s, status, failure, raw.place)


class _InRowError(ValueError):
    """Names its place already."""


def _known(what: str, said: Mapping[str, Any], known: Sequence[str]) -> None:
    for name in said:
        if name not in known:
            raise ValueError(f"{what} has an unknown {brief(name)}; {suggestion(name, known)}")


def _count(name: str, value: Any) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _MOST_INTEGER:
        raise ValueError(f"{name} is a whole number from 0, not {brief(value)}")
    return value


def _seconds(value: Any) -> float | None:
    if value is None:
        return None
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not 0 <= value < 1e300:
        raise ValueError(f"solve_s is a number of seconds from 0, not {brief(value)}")
    return float(value)


def _status(value: Any, waypoints: Array | None) -> Status:
    if value is None:
        return Status.TIMEOUT if waypoints is None else Status.EXACT_SOLUTION
    known = [status.value for status in Status]
    if value not in known:
        raise ValueError(f"unknown status {brief(value)}; {suggestion(value, known)}")
    return Status(value)


def _line(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"failure is a text, not {brief(value)}")
    return printable(" ".join(value.split()))


def _waypoints(raw: Raw, rows: Any) -> Array:
    found = np.array(rows, np.float64) if isinstance(rows, np.ndarray) else _array(raw, rows)
    if len(found) == 0:
        raise ValueError("it has no waypoints; leave them out where there is no path")
    if len(found) == 1:
        raise _InRowError(f"{raw.row(0)}: a path of one waypoint; at least 2 are needed")
    if found.shape[1] == 0:
        raise ValueError("its waypoints have no coordinates")
    finite = np.isfinite(found).all(axis=1)
    if not finite.all():
        raise _InRowError(f"{raw.row(int(np.argmin(finite)))} holds NaN or an infinite number")
    found.flags.writeable = False
    return found


def _array(raw: Raw, rows: Any) -> Array:
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise ValueError(f"waypoints are a list of lists of numbers, not {brief(rows)}")
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise _InRowError(f"{raw.row(i)} has {len(row)} numbers, the first has {len(rows[0])}")
        for value in row:
            if type(value) not in (int, float):
                raise _InRowError(f"{raw.row(i)}: {brief(value)} is no number")
    floats = [[_float(value) for value in row] for row in rows]
    return np.array(floats, dtype=np.float64).reshape(len(rows), -1 if rows and rows[0] else 0)


def _float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _check_widths(paths: Sequence[RecordedPath]) -> None:
    first: RecordedPath | None = None
    for path in paths:
        if path.waypoints is None:
            continue
        first = first or path
        assert first.waypoints is not None
        own, others = path.waypoints.shape[1], first.waypoints.shape[1]
        if own != others:
            raise ValueError(
                f"{path.place}: waypoints have {own} numbers, those of {first.place} {others}"
            )
