"""Paths as CSV: a row a waypoint.

    problem,solve_s,status,q1,q2,q3
    0,0.012,,1.0,2.0,3.0
    0,,,4.0,5.0,6.0
    1,,TIMEOUT,,,

The coordinates are the columns q1, q2, ...; `path` tells several paths of one problem apart;
`problem`, `solve_s`, `status`, `failure` and `path` may be left out. A row without coordinates says
that there is no path. Comments in front, `# environment: FINGERPRINT` and `# seed: 0`, are of all.
Without a row of names there are coordinates only, and a blank line ends a path.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from envs.errors import brief, suggestion
from planners.recorded.matrix_format import comment, lines_of, parse_blocks, said_of, value_of
from planners.recorded.path_file import OF_FILES, OF_PATHS, PathFile, Raw, number

_PATH = "path"
Row = tuple[int, dict[str, str]]
"""The number of its line, and its cells by the columns' names."""


def parse(data: bytes) -> tuple[dict[str, Any], list[Raw]]:
    """What a file says of all paths, and each path.

    Raises:
        ValueError: it is malformed.
    """
    lines = lines_of(data)
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    if all(_is_number(cell) for cell in first.split(",")):
        return parse_blocks(lines, lambda line: line.split(","))
    of_file, rows = _rows(lines)
    return of_file, list(_paths(rows))


def serialised(paths: PathFile) -> bytes:
    """A file with these paths."""
    of_file = {"environment": paths.environment or None, "seed": paths.seed}
    text = io.StringIO()
    text.writelines(f"# {k}: {v}\n" for k, v in of_file.items() if v is not None)
    shapes = [path.waypoints.shape[1] for path in paths.paths if path.waypoints is not None]
    size = shapes[0] if shapes else 1
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([_PATH, *OF_PATHS, *(f"q{i + 1}" for i in range(size))])
    for at, path in enumerate(paths.paths):
        said = ["" if value is None else value for value in said_of(path).values()]
        for q in [[""] * size] if path.waypoints is None else path.waypoints.tolist():
            writer.writerow([at, *said, *q])
    return text.getvalue().encode()


def _is_number(cell: str) -> bool:
    try:
        number(cell.strip())
    except ValueError:
        return False
    return True


def _rows(lines: list[str]) -> tuple[dict[str, Any], list[Row]]:
    of_file: dict[str, Any] = {}
    names: list[str] = []
    rows: list[Row] = []
    for at, line in enumerate(lines, 1):
        if line.startswith("#"):
            told = comment(at, line, OF_FILES)
            if told is not None:
                of_file[told[0]] = told[1]
        elif line.strip():
            cells = [cell.strip() for cell in _cells(at, line)]
            if not names:
                names = _names(at, cells)
            elif len(cells) != len(names):
                raise ValueError(f"line {at} has {len(cells)} columns, the first {len(names)}")
            else:
                rows.append((at, dict(zip(names, cells, strict=True))))
    return of_file, rows


def _cells(at: int, line: str) -> list[str]:
    try:
        [cells] = csv.reader([line], strict=True)
    except csv.Error as error:
        raise ValueError(f"line {at}: {error}") from None
    return cells


def _names(at: int, names: list[str]) -> list[str]:
    known = (_PATH, *OF_PATHS)
    coordinates = [name for name in names if name not in known]
    wanted = [f"q{i + 1}" for i in range(len(coordinates))]
    for name, instead in zip(coordinates, wanted, strict=True):
        if name != instead:
            near = suggestion(name, (*known, instead))
            raise ValueError(
                f"line {at}: unknown column {brief(name)}; {near} (coordinates are q1, q2, ...)"
            )
    if not coordinates:
        raise ValueError(f"line {at}: there are no columns q1, q2, ... of coordinates")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"line {at}: the column {twice} is there twice")
    return names


def _paths(rows: list[Row]) -> Iterator[Raw]:
    """A path of the rows in turn with the same `path` and `problem`."""
    seen: set[tuple[str, str]] = set()
    for key, group in groupby(rows, key=lambda row: _key(row[1])):
        own = list(group)
        if key in seen:
            raise ValueError(
                f"line {own[0][0]} goes on with a path that other rows have ended; keep its rows "
                f"together, or tell paths apart by a column {_PATH}"
            )
        seen.add(key)
        yield _path(own)


def _key(row: dict[str, str]) -> tuple[str, str]:
    return row.get(_PATH, ""), row.get("problem", "")


def _path(rows: list[Row]) -> Raw:
    place = f"line {rows[0][0]}"
    said = {name: _said(rows, name) for name in OF_PATHS if name in rows[0][1]}
    coordinates = [name for name in rows[0][1] if name not in (_PATH, *OF_PATHS)]
    if len(rows) == 1 and not any(rows[0][1][name] for name in coordinates):
        if not any(rows[0][1].values()):
            raise ValueError(f"{place} is empty")
        return Raw(place, said)
    numbers = [[_coordinate(at, name, row[name]) for name in coordinates] for at, row in rows]
    return Raw(place, {**said, "waypoints": numbers}, [f"line {at}" for at, _ in rows])


def _said(rows: list[Row], name: str) -> Any:
    """What the rows of a path say, which may be said in the first alone."""
    texts = [(at, row[name]) for at, row in rows if row[name]]
    if not texts:
        return None
    [at, first] = texts[0]
    other = next((at for at, text in texts if text != first), None)
    if other is not None:
        raise ValueError(f"line {other}: another {name} than in line {at}, of the same path")
    try:
        return value_of(name, first)
    except ValueError:
        raise ValueError(f"line {at}: {name} {brief(first)} is no number") from None


def _coordinate(at: int, name: str, cell: str) -> float:
    try:
        return number(cell)
    except ValueError:
        raise ValueError(f"line {at}: {name} {brief(cell)} is no number") from None
