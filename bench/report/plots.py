"""Plots of a run as Matplotlib's axes, with the planners in the order of the tables."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from bench.analysis.claims import planned_here
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import solved_by_time
from bench.analysis.timing import anytime
from bench.storage.record import Verdict
from envs.errors import InputError, UnknownNameError


def success(run: RunResults, env: str | None, ax: Axes | None) -> Axes:
    """The share of problems solved over planning time; see `bench.Run.plot_success`."""
    axes = ax if ax is not None else plt.subplots(layout="constrained")[1]
    chosen, records = _of(run, env)
    for planner, attempts in planned_here(records).groupby("planner", sort=False):
        solved = (attempts["outcome"] == Verdict.VALID.value).to_numpy()
        times = attempts["solve_s"].to_numpy(np.float64)
        curve = solved_by_time(times, solved, until_s=_limit(run, chosen))
        axes.step(curve.times_s[1:], curve.share[1:], where="post", label=str(planner))
    axes.set(xscale="log", xlabel="planning time s", ylabel="share of problems solved")
    axes.set(ylim=(-0.02, 1.02), title=chosen)
    axes.legend()
    return axes


def metric(run: RunResults, name: str, env: str | None, ax: Axes | None) -> Axes:
    """A number's distribution over verified successes; see `bench.Run.plot_metric`."""
    known = {metric.name: metric for metric in run.metrics}
    if name not in known:
        raise UnknownNameError("metric", name, known)
    axes = ax if ax is not None else plt.subplots(layout="constrained")[1]
    chosen, records = _of(run, env)
    solved = records[records["outcome"] == Verdict.VALID.value]
    values = {str(p): rows[name].dropna() for p, rows in solved.groupby("planner", sort=False)}
    axes.boxplot(list(values.values()), tick_labels=list(values), orientation="horizontal")
    axes.invert_yaxis()  # the first on top, as in the tables
    axes.set(xlabel=run.heading(known[name]), title=chosen)
    if known[name].timed:
        axes.set_xscale("log")
    return axes


def costs(run: RunResults, env: str | None, problem: int | None, ax: Axes | None) -> Axes:
    """The best length over time; see `bench.Run.plot_anytime`."""
    axes = ax if ax is not None else plt.subplots(layout="constrained")[1]
    chosen, records = _of(run, env)
    if problem is not None:
        records = records[records["problem"] == problem]
        if records.empty:
            raise InputError(f"the run has no problem {problem} of {chosen}")
    for planner, attempts in records.groupby("planner", sort=False):
        found = anytime(attempts, _limit(run, chosen))
        if found is None:
            continue
        [line] = axes.plot(found.times_s, found.cost, drawstyle="steps-post", label=str(planner))
        known = np.isfinite(found.low) & np.isfinite(found.high)
        axes.fill_between(
            found.times_s, found.low, found.high, known, color=line.get_color(), alpha=0.16
        )
        if found.first is not None:
            axes.plot(*found.first, "o", color=line.get_color())
    [length] = [metric for metric in run.metrics if metric.name == "length"]
    axes.set(xscale="log", xlabel="planning time s", ylabel=f"best {run.heading(length)}")
    axes.set(title=chosen if problem is None else f"{chosen}, problem {problem}")
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    else:
        axes.text(
            0.5, 0.5, "no planner here improves its path", transform=axes.transAxes, ha="center"
        )
    return axes


def _limit(run: RunResults, env: str) -> float:
    [limit_s] = {s["settings"]["time_limit_s"] for s in run.selections if _has(s, env)}
    return float(limit_s)


def _of(run: RunResults, env: str | None) -> tuple[str, pd.DataFrame]:
    """The environment that is meant, and its attempts in the order of the tables."""
    known = list(dict.fromkeys(name for name, _ in run.order))
    if env is None and len(known) > 1:
        raise InputError(f"the run has several environments; choose one: {', '.join(known)}")
    chosen = known[0] if env is None else env
    if chosen not in known:
        raise UnknownNameError("environment of the run", chosen, known)
    return chosen, run.records[run.records["env"] == chosen]


def _has(selection: dict[str, object], env: str) -> bool:
    named = selection["envs"]
    return isinstance(named, list) and env in [one["id"] for one in named]
