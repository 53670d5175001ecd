"""Tables of planners: measured by the harness, row by row beside the paper's, with a verdict on the
difference by its interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from bench import api
from bench.analysis.comparison import ComparisonVerdict
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import difference_interval
from bench.analysis.summary import summarise
from bench.execution.config import make_run_config
from bench.judging.metrics import METRICS
from bench.paper.experiment import Experiment, Place, Section, Table
from bench.report import formatting

MEASURES = {metric.name: metric for metric in METRICS if metric.primary}
"""What the paper's tables have besides success."""

_OURS = ("env", "planner", "attempted", "solved", "success_low", "success_high", "reason")
_COMPARED = (
    *("problems", "success_rate"),
    *(f"{name}_{moment}" for name in MEASURES for moment in ("mean", "var")),
)
"""Columns of the summary; those that the paper has, too."""

ALL = "all"
"""Stands for all environments of an experiment together."""


@dataclass(frozen=True, kw_only=True)
class Comparison(Experiment):
    """Planners in environments.

    Attributes:
        env, planners: as on the command line.
        problems: in each environment, as in the paper.
        quick: the number of them for a quick look.
        explained: remarks by planner, on rows that fall short of the paper's.
    """

    env: tuple[str, ...]
    planners: tuple[str, ...]
    problems: int
    quick: int
    seed: int = 7
    time_limit_s: float = 5.0
    stop: str = "paper"
    explained: dict[str, str] = field(default_factory=dict)

    def carried_out(self, place: Place) -> Section:
        problems = self.quick if place.quick else self.problems
        config = make_run_config(
            env=",".join(self.env),
            planner=",".join(self.planners),
            problems=problems,
            seed=self.seed,
            time_limit_s=self.time_limit_s,
            stop=self.stop,
            jobs=1,
            memory_limit_mb=4096,
            train=False,
        )
        run = api.carry_out(config, place.out / self.name)
        rows = rows_beside(run, place.figures(self.name))
        scaled = f"Quick look: {problems} problems instead of {self.problems}."
        return Section(
            self.name,
            self.heading,
            self.caption(scaled if place.quick else "", run.caption, _HOW),
            Table([_cells(row, run) for row in rows], pd.DataFrame(rows)),
            remarks=[f"`{planner}`: {text}" for planner, text in self.explained.items()],
        )


_HOW = (
    "Time, length and margin: mean ± variance over verified successes, as in the paper. Success is "
    "of all attempts, with the 95 % Wilson interval; the verdict is by Newcombe's 95 % interval of "
    "the difference in success, `same` where it holds 0. Times are of different machines: their "
    "ratio is no part of the verdict."
)


def rows_beside(run: RunResults, figures: pd.DataFrame) -> list[dict[str, Any]]:
    """Ours and the paper's, a row for each planner in each environment that the paper lists: some
    columns of the summary, the paper's with "paper_" in front, and the verdict.

    Args:
        figures: the paper's, with columns env (or `ALL`), planner, problems, success_rate, and
            mean and var of `MEASURES`.
    """
    rows = []
    planners = list(dict.fromkeys(planner for _, planner in run.order))
    for env, theirs in figures.groupby("env", sort=False):
        records = run.records.assign(env=ALL) if env == ALL else run.records
        order = [(str(env), planner) for planner in planners]
        ours = summarise(records, order, run.metrics)
        by_planner = theirs.set_index("planner").reindex(columns=_COMPARED)
        rows += [_row(own, by_planner) for own in ours.to_dict("records")]
    return rows


def _row(ours: dict[Any, Any], theirs: pd.DataFrame) -> dict[str, Any]:
    listed = ours["planner"] in theirs.index
    paper = theirs.loc[ours["planner"]] if listed else pd.Series(math.nan, index=theirs.columns)
    row = {name: ours[name] for name in (*_OURS, *_COMPARED)}
    row |= {f"paper_{name}": float(paper[name]) for name in _COMPARED}
    found = _finding(row)
    return row | {"verdict": found.verdict.value, "reason": found.reason}


def _finding(row: dict[str, Any]) -> PaperVerdict:
    if math.isnan(row["paper_success_rate"]):
        return PaperVerdict(ComparisonVerdict.NOT_COMPARABLE, "not in the paper's table")
    found = of_success(
        row["solved"], row["attempted"], row["paper_success_rate"], int(row["paper_problems"])
    )
    if row["attempted"] == 0:
        return replace(found, reason=f"not attempted{formatting.because(row)}")
    ratio = row["time_s_mean"] / row["paper_time_s_mean"]
    if math.isnan(ratio):
        return found
    return replace(found, reason=f"{found.reason}; {ratio:.2g} of its time, on another machine")


def _cells(row: dict[str, Any], run: RunResults) -> dict[str, str]:
    paper_rate = 100 * row["paper_success_rate"]
    shown = {
        "env": row["env"],
        "planner": row["planner"],
        "n": f"{row['problems']}",
        "success %": formatting.success(row),
        "paper's": "-" if math.isnan(paper_rate) else f"{paper_rate:g}",
    }
    for name, metric in MEASURES.items():
        title = run.heading(metric)
        shown[title] = _moments(row, name, metric.digits)
        shown[f"paper's {title}"] = _moments(row, f"paper_{name}", 2)
    return shown | {"verdict": f"**{row['verdict']}**: {row['reason']}"}


def _moments(row: dict[str, Any], name: str, digits: int) -> str:
    mean, variance = (formatting.number(row[f"{name}_{of}"], digits) for of in ("mean", "var"))
    return mean if variance == "-" else f"{mean} ± {variance}"


@dataclass(frozen=True)
class PaperVerdict:
    """A verdict on ours by the paper's, and why."""

    verdict: ComparisonVerdict
    reason: str


def of_success(solved: int, problems: int, rate: float, paper_problems: int) -> PaperVerdict:
    """On our success against the paper's: whether the interval of the difference holds 0.

    Args:
        solved, problems: ours.
        rate, paper_problems: the paper's, a fraction, and the number of its problems.
    """
    if problems == 0:
        return PaperVerdict(ComparisonVerdict.NOT_COMPARABLE, "nothing was measured")
    theirs = round(rate * paper_problems)
    low, high = difference_interval(solved, problems, theirs, paper_problems)
    gain = 100 * (solved / problems - rate)
    reason = f"success {gain:+.1f} points [{100 * low:+.1f}, {100 * high:+.1f}]"
    if low > 0:
        return PaperVerdict(ComparisonVerdict.BETTER, reason)
    if high < 0:
        return PaperVerdict(ComparisonVerdict.WORSE, reason)
    return PaperVerdict(ComparisonVerdict.SAME, reason)
