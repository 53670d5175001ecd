"""Curves over time, from the attempts of one planner in one environment."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bench.record import Verdict
from bench.report.history import cost_history
from bench.stats import improvement, solved_by_time
from envs.problem import Array

Curve = dict[str, Array]
"""Numbers of equal length by what they are; see the functions."""

_TIMES = 80


def solved_by(records: pd.DataFrame, limit_s: float) -> Curve:
    """The share `y` of all attempts that were verified successes by `x` seconds, from the first
    one up to the time limit; see `bench.stats.solved_by_time`."""
    solved = (records["outcome"] == Verdict.VALID.value).to_numpy()
    curve = solved_by_time(records["solve_s"].to_numpy(np.float64), solved, until_s=limit_s)
    # Time 0 has no place on a logarithmic axis: the first step rises from 0 where it is.
    return {"x": np.append(curve.times_s[1], curve.times_s[1:]), "y": np.append(0, curve.share[1:])}


def best_by(records: pd.DataFrame, limit_s: float) -> Curve | None:
    """The median `y` of the best length after `x` seconds, over all attempts, with the ends `low`
    and `high` of its interval; see `bench.stats.improvement`. None of planners that keep no
    history. What was no verified success in the end is infinitely long from the start."""
    solved = records["outcome"] == Verdict.VALID.value
    histories = [
        cost_history(stats) if ok else np.zeros((0, 2))
        for stats, ok in zip(records["stats"], solved, strict=True)
    ]
    begun = [history[0, 0] for history in histories if len(history)]
    if not begun:
        return None
    # The first solution is not lost to rounding.
    times = np.geomspace(max(min(begun), 1e-6), limit_s, _TIMES) * (1 + 1e-9)
    curve = improvement([history.tolist() for history in histories], times)
    return {"x": times, "y": curve.cost, "low": curve.cost_low, "high": curve.cost_high}
