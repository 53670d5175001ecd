"""Tables of planners: measured by the harness, row by row beside the paper's."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from bench import measuring
from bench.paper import verdict
from bench.paper.experiment import Experiment, Place, Section, Table
from bench.paper.verdict import Verdict
from bench.record import Verdict as Judged
from bench.report import cells
from bench.report.recorded import RecordedRun
from bench.stats import wilson_interval
from bench.suite import make_suite

MEASURES = {
    "time_s": ("solve_s", 3),
    "length": ("length", 2),
    "safety_margin": ("safety_margin", 2),
}
"""Columns of the paper's tables: that of records, and digits."""

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
        suite = make_suite(
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
        run = measuring.measured(suite, place.out / self.name)
        rows = rows_beside(run, place.figures(self.name))
        scaled = f"Quick look: {problems} problems instead of {self.problems}."
        return Section(
            self.name,
            self.heading,
            self.caption(scaled if place.quick else "", run.caption, _HOW),
            Table([_cells(row) for row in rows], pd.DataFrame(rows)),
            remarks=[f"`{planner}`: {text}" for planner, text in self.explained.items()],
        )


_HOW = (
    "Time, length and margin: mean ± variance over verified successes, as in the paper. Success is "
    "of all attempts, with the 95 % Wilson interval; the verdict is by Newcombe's 95 % interval of "
    "the difference in success, `same` where it holds 0. Times are of different machines: their "
    "ratio is no part of the verdict."
)


def rows_beside(run: RecordedRun, figures: pd.DataFrame) -> list[dict[str, Any]]:
    """Ours and the paper's, a row for each planner in each environment that the paper lists.

    Args:
        figures: the paper's, with columns env (or `ALL`), planner, problems, success_rate, and
            mean and var of `MEASURES`.
    """
    rows = []
    for env in figures["env"].unique():
        records = run.records if env == ALL else run.records[run.records["env"] == env]
        theirs = figures[figures["env"] == env].set_index("planner")
        for planner in dict.fromkeys(planner for _, planner in run.order):
            own = records[records["planner"] == planner]
            paper = theirs.loc[planner] if planner in theirs.index else None
            rows.append(_row(env, planner, own, paper))
    return rows


def _row(env: str, planner: str, records: pd.DataFrame, paper: Any) -> dict[str, Any]:
    solved = records[records["outcome"] == Judged.VALID.value]
    low, high = wilson_interval(len(solved), len(records))
    row: dict[str, Any] = {
        "env": env,
        "planner": planner,
        "problems": len(records),
        "solved": len(solved),
        "success_rate": len(solved) / len(records) if len(records) else math.nan,
        "success_low": low,
        "success_high": high,
        "paper_problems": math.nan if paper is None else paper["problems"],
        "paper_success_rate": math.nan if paper is None else paper["success_rate"],
    }
    for name, (column, _) in MEASURES.items():
        values = solved[column].astype(float)
        row |= {f"{name}_mean": values.mean(), f"{name}_var": values.var()}
        for moment in ("mean", "var"):
            known = paper is not None and f"{name}_{moment}" in paper
            row[f"paper_{name}_{moment}"] = paper[f"{name}_{moment}"] if known else math.nan
    found = _verdict(row)
    return row | {"verdict": found.word, "reason": found.reason}


def _verdict(row: dict[str, Any]) -> Verdict:
    if math.isnan(row["paper_success_rate"]):
        return Verdict("not comparable", "not in the paper's table")
    found = verdict.of_success(
        row["solved"], row["problems"], row["paper_success_rate"], int(row["paper_problems"])
    )
    ratio = row["time_s_mean"] / row["paper_time_s_mean"]
    if math.isnan(ratio):
        return found
    return Verdict(found.word, f"{found.reason}; {ratio:.2g} of its time, on another machine")


def _cells(row: dict[str, Any]) -> dict[str, str]:
    shown = {
        "env": row["env"],
        "planner": row["planner"],
        "n": f"{row['problems']}",
        "success %": f"{_percent(row['success_rate'])} "
        f"[{_percent(row['success_low'])}, {_percent(row['success_high'])}]",
        "paper's": _percent(row["paper_success_rate"], "g"),
    }
    titles = {"time_s": "time s", "length": "length", "safety_margin": "margin"}
    for name, (_, digits) in MEASURES.items():
        shown[titles[name]] = _moments(row, name, digits)
        shown[f"paper's {titles[name]}"] = _moments(row, f"paper_{name}", 2)
    return shown | {"verdict": f"**{row['verdict']}**: {row['reason']}"}


def _moments(row: dict[str, Any], name: str, digits: int) -> str:
    if math.isnan(row[f"{name}_mean"]):
        return "-"
    mean = cells.number(row[f"{name}_mean"], digits)
    return mean if math.isnan(row[f"{name}_var"]) else f"{mean} ± {row[f'{name}_var']:.{digits}f}"


def _percent(rate: float, form: str = ".1f") -> str:
    return "-" if math.isnan(rate) else format(100 * rate, form)
