"""What the page shows of all problems together, as JSON data: outcomes, curves over time, tables,
and how the run came about.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from bench.analysis import claims
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import solved_by_time
from bench.analysis.summary import CLAIMED_TIME
from bench.analysis.timing import anytime
from bench.judging.metric import Metric
from bench.report import formatting
from bench.report.html.problems import ProblemSetResults
from bench.report.html.sweeps import sweep_charts
from bench.storage.record import Verdict
from envs.problem import Array


def overview_data(
    problem_set: ProblemSetResults, numbers: dict[str, int], metrics: Sequence[Metric]
) -> dict[str, Any]:
    """A problem set's `outcomes`: for each of its `problems` a list of the words of its
    `planners`, None without an attempt; and its curves, lists of objects with `planner` and what
    follows:

    - `solved`: `x` seconds, `y` the share of attempts verified by then;
    - `costs`: `x` seconds, `y` the median of the best length so far, `low` and `high` the ends of
      its interval, None where infinite; `first`, where half had a first solution, if they had;
    - `metrics`: of each metric that has a value here its `title`, whether its axis is logarithmic
      (`log`), and `curves`: `values` of verified successes;
    - `sweeps`: see `bench.report.html.sweeps`.

    Args:
        numbers: the planners' among all of the page.
    """
    table = problem_set.first_attempts.pivot(index="problem", columns="planner", values="outcome")
    table = table.reindex(index=problem_set.problems, columns=problem_set.planners)

    def curves(of: Callable[[pd.DataFrame], Curve | None]) -> list[dict[str, Any]]:
        groups = problem_set.measured.groupby("planner", sort=False)
        made = [(str(planner), of(records)) for planner, records in groups]
        return [{"planner": numbers[name], **_listed(curve)} for name, curve in made if curve]

    return {
        "title": problem_set.env,
        "limit": problem_set.time_limit_s,
        "planners": [numbers[planner] for planner in problem_set.planners],
        "problems": problem_set.problems,
        "outcomes": table.astype(object).where(table.notna(), None).to_numpy().tolist(),
        "solved": curves(partial(solved_by, limit_s=problem_set.time_limit_s)),
        "costs": curves(partial(best_by, limit_s=problem_set.time_limit_s)),
        "metrics": [
            {"title": metric.heading([problem_set.units]), "log": metric.timed, "curves": made}
            for metric in metrics
            if (made := curves(partial(_values, column=metric.name)))
        ],
        "sweeps": sweep_charts(problem_set, numbers, metrics),
    }


def _values(records: pd.DataFrame, column: str) -> Curve | None:
    values = records.loc[records["outcome"] == Verdict.VALID.value, column].dropna()
    return {"values": values.to_numpy(dtype=np.float64)} if len(values) else None


def _listed(curve: Curve) -> dict[str, list[float | None]]:
    """Arrays as lists, with None for what is infinite."""
    return {name: [formatting.plotted(value) for value in values] for name, values in curve.items()}


Curve = dict[str, Array]
"""Numbers by what they are; see the functions."""


def solved_by(records: pd.DataFrame, limit_s: float) -> Curve | None:
    """The share `y` of all attempts that were verified successes by `x` seconds, from the first
    one up to the time limit; see `bench.analysis.statistics.solved_by_time`. None of what was
    planned elsewhere."""
    if claims.were_planned_elsewhere(records):
        return None
    solved = (records["outcome"] == Verdict.VALID.value).to_numpy()
    curve = solved_by_time(records["solve_s"].to_numpy(np.float64), solved, until_s=limit_s)
    # Time 0 has no place on a logarithmic axis: the first step rises from 0 where it is.
    return {"x": np.append(curve.times_s[1], curve.times_s[1:]), "y": np.append(0, curve.share[1:])}


def best_by(records: pd.DataFrame, limit_s: float) -> Curve | None:
    """The median `y` of the best length after `x` seconds, with the ends `low` and `high` of its
    interval, and, in `first`, the place where half of the attempts had a first solution; see
    `bench.analysis.timing`. None of planners that keep no history."""
    found = anytime(records, limit_s)
    if found is None:
        return None
    first = np.array(found.first or ())
    return {
        "x": found.times_s,
        "y": found.cost,
        "low": found.low,
        "high": found.high,
        "first": first,
    }


_SORTED_BY = {
    "problems": "problems",
    formatting.INVALID: "invalid_problems",
    "n": "problems",
    "success %": "success_rate",
    "setup s": "setup_s",
    "training s": "train_s",
    "offline s": "offline_s",
    formatting.CLAIMED: f"{CLAIMED_TIME}_mean",
    formatting.SCENE_TIME: "scene_s_median",
    formatting.BLOCKED_SUCCESS: "blocked_success_rate",
    **{title: f"time_s_to_{level}" for level, title in formatting.REACHED.items()},
}
"""Titles of columns with numbers, besides those of metrics, to the summary's columns."""


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


def success_table(run: RunResults) -> Table:
    """The main table; see `bench.report.formatting.success_rows`."""
    return _table(formatting.success_rows(run), run.summary, run)


def further_table(run: RunResults) -> Table:
    """The metrics that are not in the main table; see `bench.report.formatting.further_rows`."""
    rows = formatting.further_rows(run)
    return _table(rows, run.summary if rows else run.summary[:0], run)


def common_table(run: RunResults) -> Table:
    """The table of commonly solved problems; see `bench.report.formatting.common_rows`."""
    return _table(formatting.common_rows(run), run.common, run)


def offline_table(run: RunResults) -> Table:
    """What was spent before any problem was known."""
    rows = [
        {
            "env": row["env"],
            "planner": row["planner"],
            "setup s": formatting.number(row["setup_s"], 2),
            "training s": formatting.number(row["train_s"], 2),
            "offline s": formatting.number(row["offline_s"], 2),
        }
        for row in run.summary.to_dict("records")
    ]
    return _table(rows, run.summary, run)


def _table(rows: Sequence[dict[str, str]], data: pd.DataFrame, run: RunResults) -> Table:
    sorted_by = {**_SORTED_BY, **formatting.metric_columns(run)}
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


_OF_PLACES = (
    "machine",
    "python",
    "versions",
    "git",
    "threads_per_worker",
    "thread_variables",
)
"""What a session says of where it was measured; the rest is when, and at what cost."""

_TOLD_ELSEWHERE = ("settings", "order")


@dataclass(frozen=True)
class Facts:
    """Names and texts under a title."""

    title: str
    lines: list[tuple[str, str]]


def facts_of(run: RunResults) -> list[Facts]:
    """What was asked for in each folder; the machines and versions, each once; the sessions."""
    asked = [
        Facts(f"Asked for: {folder.name}", list(_lines(selection)))
        for folder, selection in zip(run.folders, run.selections, strict=True)
    ]
    places: dict[str, Facts] = {}
    sessions = []
    for session in run.sessions:
        place = {name: session[name] for name in _OF_PLACES if name in session}
        if place:
            places.setdefault(json.dumps(place), Facts("Machine", list(_lines(place))))
        rest = {n: v for n, v in session.items() if n not in (*_OF_PLACES, *_TOLD_ELSEWHERE)}
        sessions.append(Facts("Session", list(_lines(rest))))
    return [*asked, *places.values(), *sessions]


def _lines(data: dict[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    """JSON data line by line, names of what is within others after theirs."""
    for name, value in data.items():
        words = f"{above} {name.replace('_', ' ')}".strip()
        if isinstance(value, dict):
            yield from _lines(value, words)
        elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
            for number, item in enumerate(value, 1):
                yield from _lines(item, f"{words} {number}")
        elif isinstance(value, list):
            yield words, ", ".join(str(item) for item in value)
        else:
            yield words, "unknown" if value is None else str(value)
