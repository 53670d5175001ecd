"""Files of problems, which users have planned in place of problems that are drawn.

As JSON or YAML, a list, or a mapping with it as `problems`:

    [{"start": [0, 0, 0], "goal": [1, 2, 3], "name": "to the shelf"},
     {"start": [0, 0, 0], "goals": [[1, 2, 3], [3, 2, 1]]}]

of which a name may be left out, and of several goals any will do. As CSV, a row a problem, with the
columns `start_1`, `start_2`, ..., `goal_1`, `goal_2`, ... and perhaps `name`, or without names of
columns start and goal one after the other. Rows one after another of the same name and start are
several goals of one problem.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from envs import Environment, InputError, Problem
from envs.errors import brief, input_error_of, suggestion
from envs.files.git_lfs import check_is_no_pointer
from envs.files.json_text import parsed_json
from envs.files.paths import atomic_write
from envs.files.yaml_text import parsed_yaml
from envs.problem import Array
from envs.seeding import derived_seed

_MOST_BYTES = 2**26
"""Of a file."""

_MOST_YAML = 2**20
"""Of one in YAML, of which a megabyte takes seconds."""

_KEYS = ("start", "goal", "goals", "name")

_NAMED = 3
"""Faults that a message names."""


@dataclass(frozen=True, eq=False)
class PosedProblem:
    """A problem as a file has it.

    Attributes:
        start: float64 (d,).
        goals: float64 (g, d), any of which will do.
        name: "" where it has none.
        row: where it is in the file, as in "row 3".
    """

    start: Array
    goals: Array
    name: str = ""
    row: str = ""


@dataclass(frozen=True, eq=False)
class GivenProblems:
    """What a file says.

    Attributes:
        file: its name, for messages.
        posed: at least one problem, in the file's order.
    """

    file: str
    posed: tuple[PosedProblem, ...]

    @staticmethod
    def read(file: Path) -> GivenProblems:
        """Reads a file in the format that its name ends in: .csv, .json, .yaml or .yml.

        Raises:
            InputError: it cannot be read, or is malformed; the message names the row.
        """
        if file.suffix.lower() not in _READERS:
            known = ", ".join(_READERS)
            raise InputError(f"{file}: files of problems end in {known}, not {file.suffix!r}")
        with input_error_of(f"cannot read {file}", UnicodeDecodeError):
            if file.stat().st_size > _MOST_BYTES:
                raise InputError(f"{file} has more than {_MOST_BYTES} bytes")
            content = file.read_bytes()
            text = content.decode("utf-8-sig")
        try:
            check_is_no_pointer(content)
            posed = tuple(_READERS[file.suffix.lower()](text))
        except ValueError as error:
            raise InputError(f"{file}: {' '.join(str(error).split())}") from error
        if not posed:
            raise InputError(f"{file} has no problems")
        return GivenProblems(str(file), posed)

    @staticmethod
    def of_data(data: Mapping[str, Any]) -> GivenProblems:
        """What `data` gave."""
        return GivenProblems(data["file"], tuple(_of_entries(data["problems"])))

    @property
    def data(self) -> dict[str, Any]:
        """As JSON data, of which `of_data` makes the same."""
        return {"file": self.file, "problems": [_entry(one) for one in self.posed]}

    @property
    def digest(self) -> str:
        """Of the problems, the same for all files that say the same."""
        numbers = [[one.start.tolist(), one.goals.tolist()] for one in self.posed]
        return hashlib.sha256(json.dumps(numbers).encode()).hexdigest()[:12]

    def problems(self, env: Environment, seed: int) -> list[Problem]:
        """In an environment, with seeds for planners that are drawn from `seed`.

        Raises:
            InputError: they do not fit its configurations, or it has a scene for each problem.
        """
        if env.scenes_differ:
            raise InputError(
                f"{self.file}: each problem of this environment has a scene of its own; choose one "
                "scene, as in scene=3, for problems of your own"
            )
        size = env.space.size
        faults = [
            f"{one.row}: a configuration has {size} numbers, not {wrong[0]}"
            for one in self.posed
            if (wrong := [n for n in (len(one.start), one.goals.shape[1]) if n != size])
        ]
        self.refuse(faults)
        return [
            Problem(one.start, one.goals[0], index, _seed(seed, index), one.goals)
            for index, one in enumerate(self.posed)
        ]

    def refuse(self, faults: Sequence[str]) -> None:
        """Raises InputError if there are any faults, each said with its row."""
        if faults:
            more = f"; and {len(faults) - _NAMED} more" if len(faults) > _NAMED else ""
            raise InputError(f"{self.file}: {'; '.join(faults[:_NAMED])}{more}")


def write(problems: Sequence[Problem], file: Path) -> None:
    """Writes problems to a file, from which `GivenProblems.read` has the same numbers.

    Raises:
        InputError: it cannot be written, or ends in no known format.
    """
    suffix = file.suffix.lower()
    if suffix not in _READERS:
        raise InputError(f"{file}: files of problems end in {', '.join(_READERS)}, not {suffix!r}")
    posed = [PosedProblem(p.start, p.all_goals, f"problem {p.index}") for p in problems]
    text = _csv_text(posed) if suffix == ".csv" else _json_text(posed)
    with input_error_of(f"cannot write {file}"), atomic_write(file) as part:
        part.write_text(text, encoding="utf-8")


def _seed(seed: int, index: int) -> int:
    return derived_seed("problem file", seed, index)


def _entry(posed: PosedProblem) -> dict[str, Any]:
    several = len(posed.goals) > 1
    goals = {"goals": posed.goals.tolist()} if several else {"goal": posed.goals[0].tolist()}
    return {"start": posed.start.tolist(), **goals, **({"name": posed.name} if posed.name else {})}


def _json_text(posed: Sequence[PosedProblem]) -> str:
    """A line a problem, which is YAML, too."""
    lines = ",\n".join(f" {json.dumps(_entry(one))}" for one in posed)
    return f"[\n{lines}\n]\n"


def _csv_text(posed: Sequence[PosedProblem]) -> str:
    size = len(posed[0].start)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", *_columns("start", size), *_columns("goal", size)])
    for one in posed:
        for goal in one.goals:
            writer.writerow([one.name, *one.start.tolist(), *goal.tolist()])
    return text.getvalue()


def _columns(end: str, size: int) -> list[str]:
    return [f"{end}_{n + 1}" for n in range(size)]


def _of_json(text: str) -> Iterator[PosedProblem]:
    return _of_entries(_listed(parsed_json(text)))


def _of_yaml(text: str) -> Iterator[PosedProblem]:
    if len(text) > _MOST_YAML:
        raise ValueError(f"YAML of at most {_MOST_YAML} characters is read; use JSON or CSV")
    return _of_entries(_listed(parsed_yaml(text.encode())))


def _listed(content: Any) -> Any:
    if isinstance(content, dict):
        for key in content:
            if key != "problems":
                raise ValueError(f"unknown key {brief(key)}; {suggestion(key, ['problems'])}")
        content = content.get("problems")
    if not isinstance(content, list):
        raise ValueError("it must be a list of problems, or a mapping with one as 'problems'")
    return content


def _of_entries(entries: Sequence[Any]) -> Iterator[PosedProblem]:
    for number, entry in enumerate(entries, start=1):
        row = f"row {number}"
        if not isinstance(entry, dict):
            raise ValueError(f"{row}: a problem has start and goal, it is {brief(entry)}")
        for key in entry:
            if key not in _KEYS:
                raise ValueError(f"{row}: unknown key {brief(key)}; {suggestion(key, _KEYS)}")
        if "start" not in entry or ("goal" in entry) == ("goals" in entry):
            raise ValueError(f"{row}: a problem has a start, and either a goal or goals")
        goals = [entry["goal"]] if "goal" in entry else entry["goals"]
        if not isinstance(goals, list) or not goals:
            raise ValueError(f"{row}: goals must be a list of at least one goal")
        name = entry.get("name", "")
        if not isinstance(name, str):
            raise ValueError(f"{row}: a name is text, not {brief(name)}")
        yield _posed(row, entry["start"], goals, name)


def _posed(row: str, start: Any, goals: Sequence[Any], name: str) -> PosedProblem:
    begin = _numbers(start, f"{row}: start")
    ends = [_numbers(goal, f"{row}: goal") for goal in goals]
    for goal in ends:
        if len(goal) != len(begin):
            raise ValueError(f"{row}: its start has {len(begin)} numbers, its goal {len(goal)}")
    return PosedProblem(begin, np.array(ends), name, row)


def _numbers(values: Any, what: str) -> Array:
    if not isinstance(values, list) or not values:
        raise ValueError(f"{what} must be a list of numbers, not {brief(values)}")
    for value in values:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (is_number and abs(value) <= sys.float_info.max):
            raise ValueError(f"{what} must have finite numbers, not {brief(value)}")
    return np.array(values, dtype=np.float64)


def _of_csv(text: str) -> Iterator[PosedProblem]:
    rows = [row for row in _rows(text) if any(map(str.strip, row))]
    if not rows:
        return
    has_names = any(_number(cell) is None for cell in rows[0])
    columns = [cell.strip() for cell in rows.pop(0)] if has_names else _unnamed(len(rows[0]))
    starts, goals = _places(columns)
    name = columns.index("name") if "name" in columns else None
    read = []
    for number, row in enumerate(rows, start=1):
        where = f"row {number}"
        if len(row) != len(columns):
            raise ValueError(f"{where} has {len(row)} cells, not {len(columns)}")
        start, goal = (
            [_cell(row[place], f"{where}, {columns[place]}") for place in places]
            for places in (starts, goals)
        )
        read.append((where, "" if name is None else row[name].strip(), start, goal))
    for (called, start), together in groupby(_with_alone(read), key=lambda one: one[0]):
        several = [entry for _, entry in together]
        yield _posed(several[0][0], list(start), [goal for *_, goal in several], str(called))


def _rows(text: str) -> list[list[str]]:
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        return list(reader)
    except csv.Error as error:
        raise ValueError(f"line {reader.line_num}: it is no CSV: {error}") from error


def _with_alone(read: Sequence[Any]) -> Iterator[Any]:
    """What makes rows one problem: the name and the start, unless there is no name."""
    for number, entry in enumerate(read):
        _, name, start, _ = entry
        yield (name or number, tuple(start)), entry


def _unnamed(count: int) -> list[str]:
    if count % 2:
        raise ValueError(f"row 1 has {count} numbers, which are no start and goal of one size")
    return [*_columns("start", count // 2), *_columns("goal", count // 2)]


def _places(columns: Sequence[str]) -> tuple[list[int], list[int]]:
    """Where the numbers of start and goal are."""
    size = sum(column.startswith("start_") for column in columns)
    known = [*_columns("start", size), *_columns("goal", size)]
    for column in columns:
        if column not in (*known, "name"):
            raise ValueError(f"unknown column {column!r}; {suggestion(column, [*known, 'name'])}")
        if columns.count(column) > 1:
            raise ValueError(f"column {column!r} is there twice")
    missing = [column for column in known or ["start_1"] if column not in columns]
    if missing:
        raise ValueError(f"column {missing[0]!r} is missing")
    return [columns.index(c) for c in known[:size]], [columns.index(c) for c in known[size:]]


def _cell(text: str, what: str) -> float:
    value = _number(text)
    if value is None or not math.isfinite(value):
        raise ValueError(f"{what} must be a finite number, not {brief(text)}")
    return value


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


_READERS = {".csv": _of_csv, ".json": _of_json, ".yaml": _of_yaml, ".yml": _of_yaml}
