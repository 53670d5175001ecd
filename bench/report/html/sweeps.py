"""What the page shows of planners, and of environments, that differ in one number, as JSON data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

import envs
from bench.analysis.statistics import clustered_wilson_interval
from bench.analysis.summary import attempted_records
from bench.analysis.sweeps import Sweep, sweeps
from bench.judging.metric import Metric
from bench.report.formatting import plotted
from bench.report.html.problems import ProblemSetResults
from bench.storage.record import Verdict


def sweep_charts(
    problem_set: ProblemSetResults, numbers: dict[str, int], metrics: Sequence[Metric]
) -> list[dict[str, Any]]:
    """A chart of success, and of each metric that has a value, for each sweep of a problem set:
    objects with `title`; `axis`, what is along the other axis; whether that is `log`arithmic;
    `planner`, whose colour it has; and at the parameter's values `x` the lists `y`, `low` and
    `high`: of success the rate with its 95 % interval, of a metric the median over verified
    successes with the quartiles, None where there are none.

    Args:
        numbers: the planners' among all of the page.
    """
    return [
        chart
        for sweep in sweeps(problem_set.planners)
        for chart in _charts(sweep, problem_set, numbers, metrics)
    ]


def difficulty_charts(
    problem_sets: Sequence[ProblemSetResults], numbers: dict[str, int], metrics: Sequence[Metric]
) -> list[dict[str, Any]]:
    """The same over a parameter of an environment, of which a run has several values: objects with
    `title`, `axis`, `log`, `x`, `parameter`, and `curves`, one for each planner, with `planner`,
    `y`, `low` and `high`."""
    by_id = {problem_set.env: problem_set for problem_set in problem_sets}
    return [
        chart
        for sweep in sweeps(list(by_id), envs.REGISTRY)
        for chart in _of_worlds(sweep, [by_id[id] for _, id in sweep.values], numbers, metrics)
    ]


def _charts(
    sweep: Sweep, problem_set: ProblemSetResults, numbers: dict[str, int], metrics: Sequence[Metric]
) -> list[dict[str, Any]]:
    attempts = attempted_records(problem_set.records)
    rows = [attempts[attempts["planner"] == id] for _, id in sweep.values]
    planner = {"planner": numbers[sweep.values[0][1]]}
    measured = _measured(rows, metrics, problem_set.units)
    return [{**_along(sweep), **planner, **chart} for chart in measured]


def _of_worlds(
    sweep: Sweep,
    problem_sets: Sequence[ProblemSetResults],
    numbers: dict[str, int],
    metrics: Sequence[Metric],
) -> list[dict[str, Any]]:
    attempts = [attempted_records(problem_set.records) for problem_set in problem_sets]
    names = dict.fromkeys(name for one in problem_sets for name in one.planners)
    charts: dict[str, dict[str, Any]] = {}
    for name in names:
        rows = [table[table["planner"] == name] for table in attempts]
        for found in _measured(rows, metrics, problem_sets[0].units):
            axis = {"axis": found.pop("axis"), "log": found.pop("log")}
            chart = charts.setdefault(axis["axis"], {**_along(sweep), **axis, "curves": []})
            chart["curves"].append({"planner": numbers[name], **found})
    return list(charts.values())


def _along(sweep: Sweep) -> dict[str, Any]:
    return {
        "title": sweep.title,
        "parameter": sweep.parameter,
        "x": [value for value, _ in sweep.values],
    }


def _measured(
    rows: Sequence[pd.DataFrame], metrics: Sequence[Metric], units: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Of the attempts at each value of a parameter: success, and each metric that has a value."""
    charts = [{"axis": "share solved", "log": False, **_columns([_success(r) for r in rows])}]
    for metric in metrics:
        values = [_quartiles(r, metric.name) for r in rows]
        if any(value is not None for one in values for value in one):
            axis = metric.heading([units])
            charts.append({"axis": axis, "log": metric.timed, **_columns(values)})
    return charts


Spread = tuple[float | None, float | None, float | None]
"""Low, middle and high."""


def _columns(spreads: Sequence[Spread]) -> dict[str, list[float | None]]:
    low, middle, high = (list(column) for column in zip(*spreads, strict=True))
    return {"low": low, "y": middle, "high": high}


def _success(rows: pd.DataFrame) -> Spread:
    if rows.empty:
        return None, None, None
    solved = (rows["outcome"] == Verdict.VALID.value).groupby(rows["problem"])
    low, high = clustered_wilson_interval(solved.sum(), solved.count())
    return plotted(low), plotted(float(solved.sum().sum() / len(rows))), plotted(high)


def _quartiles(rows: pd.DataFrame, column: str) -> Spread:
    values = rows.loc[rows["outcome"] == Verdict.VALID.value, column].dropna().to_numpy(float)
    values = values[np.isfinite(values)]
    if not len(values):
        return None, None, None
    low, middle, high = np.percentile(values, [25, 50, 75]).tolist()
    return plotted(low), plotted(middle), plotted(high)
