"""Paths as OMPL's `printAsMatrix` prints them: a line a waypoint, numbers with spaces between.

A blank line ends a path. Lines with `#` in front are comments, of which some say what the other
formats have keys for: `# environment: FINGERPRINT` and `# seed: 0` of all paths, `# problem: 3`,
`# solve_s: 0.01`, `# status: TIMEOUT` and `# failure: TEXT` of the path below.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from envs.errors import brief, suggestion
from planners.recorded.path_file import (
    OF_FILES,
    OF_PATHS,
    PathFile,
    Raw,
    RecordedPath,
    decoded,
    number,
)

_SAID = re.compile(r"#\s*(\w+)\s*:\s*(.*)")


def parse(data: bytes) -> tuple[dict[str, Any], list[Raw]]:
    """What a file says of all paths, and each path.

    Raises:
        ValueError: it is malformed.
    """
    return parse_blocks(lines_of(data), str.split)


def lines_of(data: bytes) -> list[str]:
    """The lines of a text, counted as editors do.

    Raises:
        ValueError: it is no text.
    """
    return re.split(r"\r\n|\r|\n", decoded(data))


def parse_blocks(
    lines: list[str], split: Callable[[str], list[str]]
) -> tuple[dict[str, Any], list[Raw]]:
    """The same of lines that are split into numbers in some way."""
    of_file: dict[str, Any] = {}
    found = []
    numbered = [(at, line.strip()) for at, line in enumerate(lines, 1)]
    for blank, block in groupby(numbered, key=lambda one: not one[1]):
        if not blank:
            found += list(_path(list(block), split, of_file))
    return of_file, found


def comment(at: int, line: str, known: tuple[str, ...]) -> tuple[str, Any] | None:
    """What a comment says, if it says something: a key and its value.

    Raises:
        ValueError: its key is unknown, or its value is none.
    """
    said = _SAID.fullmatch(line.strip())
    if said is None:
        return None
    name, text = said[1], said[2].strip()
    if name not in known:
        raise ValueError(f"line {at}: unknown {brief(name)}; {suggestion(name, known)}")
    try:
        return name, value_of(name, text)
    except ValueError:
        raise ValueError(f"line {at}: {name} {brief(text)} is no number") from None


def value_of(name: str, text: str) -> Any:
    """A value in its type.

    Raises:
        ValueError: it is none.
    """
    if name == "solve_s":
        return number(text)
    if name in ("problem", "seed"):
        return int(text) if re.fullmatch("[0-9]{1,30}", text) else number(text)
    return text


def serialised(paths: PathFile) -> bytes:
    """A file with these paths."""
    of_file = [*_comments({"environment": paths.environment or None, "seed": paths.seed})]
    blocks = ["\n".join(of_file)] if of_file else []
    blocks += ["\n".join(_lines(path)) for path in paths.paths]
    return ("\n\n".join(blocks) + "\n").encode()


def _lines(path: RecordedPath) -> Iterator[str]:
    yield from _comments(said_of(path))
    for q in [] if path.waypoints is None else path.waypoints.tolist():
        yield " ".join(map(repr, q))


def said_of(path: RecordedPath) -> dict[str, Any]:
    """All that is said of a path besides its waypoints, by its name; None where nothing is."""
    return {
        "problem": path.problem,
        "solve_s": path.solve_s,
        "status": path.status.value,
        "failure": path.failure or None,
    }


def _comments(said: dict[str, Any]) -> Iterator[str]:
    for name, value in said.items():
        if value is not None:
            yield f"# {name}: {value if isinstance(value, str) else repr(value)}"


@dataclass
class _Rows:
    """A path's waypoints as far as they were read."""

    numbers: list[list[float]] = field(default_factory=list)
    places: list[str] = field(default_factory=list)


def _path(
    block: list[tuple[int, str]],
    split: Callable[[str], list[str]],
    of_file: dict[str, Any],
) -> Iterator[Raw]:
    said: dict[str, Any] = {}
    rows = _Rows()
    for at, line in block:
        if line.startswith("#"):
            told = comment(at, line, (*OF_FILES, *OF_PATHS))
            if told is not None:
                where = of_file if told[0] in OF_FILES else said
                if told[0] in where or (rows.numbers and where is said):
                    raise ValueError(f"line {at}: {told[0]} is said twice, or too late")
                where[told[0]] = told[1]
            continue
        rows.numbers.append([_number(at, cell) for cell in split(line)])
        rows.places.append(f"line {at}")
    if rows.numbers:
        said["waypoints"] = rows.numbers
    if said:
        first = rows.places[0] if rows.places else f"line {block[0][0]}"
        yield Raw(first, said, rows.places)


def _number(at: int, cell: str) -> float:
    try:
        return number(cell.strip())
    except ValueError:
        raise ValueError(f"line {at}: {brief(cell)} is no number") from None
