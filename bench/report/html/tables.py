"""The page's tables: cells as text, with what they are sorted by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bench.report import cells

_SORTED_BY = {
    "problems": "problems",
    "n": "problems",
    "success %": "success_rate",
    "time s": "time_s_mean",
    "length": "length_mean",
    "safety margin": "safety_margin_mean",
    "offline s": "offline_s",
    cells.BLOCKED_SUCCESS: "blocked_success_rate",
    cells.BLOCKED_LENGTH: "blocked_length_mean",
    **{title: f"time_s_to_{level}" for level, title in cells.REACHED.items()},
}
"""Titles of columns with numbers to the summary's columns."""


@dataclass(frozen=True)
class Cell:
    """A cell.

    Attributes:
        text: as in every other format.
        value: the number that it is sorted by, None for none.
        interval: (rate, low, high) as fractions, where a bar is drawn below the text.
    """

    text: str
    value: float | None = None
    interval: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Table:
    """`numeric` are the titles of columns that are sorted as numbers."""

    titles: list[str]
    numeric: frozenset[str]
    rows: list[list[Cell]]


def success_table(summary: pd.DataFrame, spread: str) -> Table:
    """The main table; see `bench.report.cells.success_rows`."""
    return _table(cells.success_rows(summary, spread), summary)


def common_table(common: pd.DataFrame) -> Table:
    """The table of commonly solved problems; see `bench.report.cells.common_rows`."""
    return _table(cells.common_rows(common), common)


def offline_table(summary: pd.DataFrame) -> Table:
    """What was spent before any problem was known."""
    rows = [
        {
            "env": row["env"],
            "planner": row["planner"],
            "setup s": cells.number(row["setup_s"], 2),
            "training s": cells.number(row["train_s"], 2),
            "offline s": cells.number(row["offline_s"], 2),
        }
        for row in summary.to_dict("records")
    ]
    return _table(rows, summary, {"setup s": "setup_s", "training s": "train_s", **_SORTED_BY})


def _table(
    rows: Sequence[dict[str, str]], data: pd.DataFrame, sorted_by: dict[str, str] = _SORTED_BY
) -> Table:
    titles = list(rows[0]) if rows else []
    made = [
        [_cell(title, text, numbers, sorted_by) for title, text in row.items()]
        for row, numbers in zip(rows, data.to_dict("records"), strict=True)
    ]
    return Table(titles, frozenset(titles) & frozenset(sorted_by), made)


def _cell(title: str, text: str, numbers: dict[Any, Any], sorted_by: dict[str, str]) -> Cell:
    if title not in sorted_by:
        return Cell(text)
    value = numbers[sorted_by[title]]
    interval = None
    if title == "success %" and not pd.isna(value):
        interval = (numbers["success_rate"], numbers["success_low"], numbers["success_high"])
    # What is endless has no place among numbers.
    return Cell(text, float(value) if np.isfinite(value) else None, interval)
