"""A baseline as CSV: one row an environment and planner, sorted, so that differences read well."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.analysis.regression.baseline import (
    FAILED,
    MISSING,
    SOLVED,
    STRAIGHT,
    Baseline,
    Row,
    gated_metrics,
)
from envs import InputError
from envs.errors import suggestion
from envs.files.paths import atomic_write
from envs.problem import Array

VERSION = "1"

COLUMNS = ("version", "env", "planner", "fingerprint", "seed", "settings", "problems", "solved")
"""Those that every baseline has; after them comes OUTCOMES, which older ones lack, and those of
`gated_metrics` that it was written with, with a value for each of the problems 0, 1, ..., or a
dash."""

OUTCOMES = "outcomes"
"""The column of `Row.outcomes`."""

_NONE = "-"
_ANEW = "mend it, or delete it and write it anew with --update"


def read(file: Path) -> Baseline:
    """The baseline in a file.

    Raises:
        InputError: it cannot be read, is not a baseline of this version, or has a row that makes no
            sense; the message names the line.
    """
    header, lines = _cells(file)
    if header[:1] != ["version"]:
        raise InputError(f"{file} is not a baseline that `bench check --update` wrote")
    for number, cells in lines:
        if cells[:1] != [VERSION]:
            raise InputError(
                f"{file}, line {number}: version {''.join(cells[:1])!r}, this program reads "
                f"{VERSION}; delete the file and write it anew with --update"
            )
    named = _measures(file, header)
    if not lines:
        raise InputError(f"{file} has no rows; {_ANEW}")
    rows: dict[tuple[str, str], Row] = {}
    for number, cells in lines:
        try:
            row = _parsed(header, cells)
            if row.key in rows:
                raise ValueError(f"a second row of {row.planner!r} in {row.env!r}")
        except ValueError as error:
            raise InputError(f"{file}, line {number}: {error}; {_ANEW}") from error
        rows[row.key] = row
    return Baseline(rows, named)


def write(baseline: Baseline, file: Path) -> None:
    """Writes a baseline, whole or not at all; its folder is made if missing.

    Raises:
        InputError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, OUTCOMES, *baseline.measures])
    writer.writerows(_written(row) for _, row in sorted(baseline.rows.items()))
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(file) as part:
            part.write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {file}: {error}") from error


def _cells(file: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header, and of each row its line's number and its cells."""
    try:
        text = file.read_text(encoding="utf-8")
        found = _rows(text)
    except FileNotFoundError as error:
        raise InputError(f"there is no {file}; --update writes it") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot read {file} as a baseline: {error}") from error
    return (found[0][1] if found else []), found[1:]


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """Of a CSV file each row that has cells, after its line's number."""
    # The reader's own limit is reached by some ten thousand problems. It is the whole process's.
    before = csv.field_size_limit(max(csv.field_size_limit(), len(text)))
    try:
        reader = csv.reader(io.StringIO(text), strict=True)
        return [(reader.line_num, cells) for cells in reader if cells]
    finally:
        csv.field_size_limit(before)


def _measures(file: Path, header: Sequence[str]) -> tuple[str, ...]:
    known = (*COLUMNS, OUTCOMES, *gated_metrics())
    for name in header:
        if name not in known:
            raise InputError(f"{file}: unknown column {name!r}; {suggestion(name, known)}")
    missing = [name for name in COLUMNS if name not in header]
    if missing or len(set(header)) < len(header):
        wrong = f"without {', '.join(missing)}" if missing else "with a column twice"
        raise InputError(f"{file} is a baseline {wrong}; {_ANEW}")
    return tuple(name for name in gated_metrics() if name in header)


def _parsed(header: Sequence[str], cells: Sequence[str]) -> Row:
    """Raises ValueError if the row makes no sense."""
    if len(cells) != len(header):
        raise ValueError(f"{len(cells)} cells in {len(header)} columns")
    told = dict(zip(header, cells, strict=True))
    for name in ("env", "planner", "fingerprint"):
        if not told[name].strip():
            raise ValueError(f"no {name}")
    problems, solved = _count("problems", told), _count("solved", told)
    if problems == 0 or solved > problems:
        raise ValueError(f"{solved} solved of {problems} problems")
    values = {name: _values(name, told[name]) for name in gated_metrics() if name in told}
    for name, numbers in values.items():
        count = int(np.isfinite(numbers).sum())
        if count > solved or len(numbers) < problems:
            raise ValueError(
                f"{name} has {count} values for {len(numbers)} problems, where {solved} of "
                f"{problems} were solved"
            )
    outcomes = told.get(OUTCOMES, "")
    _check_outcomes(outcomes, problems, solved)
    return Row(
        env=told["env"],
        planner=told["planner"],
        fingerprint=told["fingerprint"],
        seed=_count("seed", told),
        settings=told["settings"],
        problems=problems,
        solved=solved,
        values=values,
        outcomes=outcomes,
    )


def _check_outcomes(outcomes: str, problems: int, solved: int) -> None:
    """Raises ValueError if they are not those of the row's counts."""
    known = SOLVED + STRAIGHT + FAILED + MISSING
    strange = set(outcomes) - set(known)
    if strange:
        raise ValueError(f"{OUTCOMES} has {min(strange)!r}, which is none of {' '.join(known)}")
    won = outcomes.count(SOLVED) + outcomes.count(STRAIGHT)
    made = won + outcomes.count(FAILED)
    if outcomes and (made, won) != (problems, solved):
        raise ValueError(f"{OUTCOMES} says {won} solved of {made}, not {solved} of {problems}")


def _count(name: str, told: dict[str, str]) -> int:
    if not re.fullmatch("[0-9]{1,15}", told[name]):
        raise ValueError(f"{name} is {told[name]!r}, not a count")
    return int(told[name])


def _values(name: str, cell: str) -> Array:
    return np.array([math.nan if word == _NONE else _positive(name, word) for word in cell.split()])


def _positive(name: str, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise ValueError(f"{name} has {word!r}, which is neither a positive number nor {_NONE!r}")
    return value


def _written(row: Row) -> list[str]:
    values = (" ".join(_word(value) for value in numbers) for numbers in row.values.values())
    counts = f"{row.problems}", f"{row.solved}"
    place = row.env, row.planner, row.fingerprint, f"{row.seed}", row.settings
    return [VERSION, *place, *counts, row.outcomes, *values]


def _word(value: float) -> str:
    return _NONE if math.isnan(value) else f"{value:g}"
