"""How the best length of planners that go on improving falls with time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from bench.analysis.statistics import censored_median, improvement
from bench.storage.record import Verdict, cost_history
from envs.problem import Array

_TIMES = 80
_SHORTEST_S = 1e-6


@dataclass(frozen=True)
class Anytime:
    """A planner's best length over time.

    Attributes:
        times_s: (k,) seconds, in geometric progression up to the time limit.
        cost, low, high: (k,) the median of the best lengths by then over all problems, infinite
            where no more than half are solved, and the ends of its 95 % interval, which assumes no
            distribution.
        first: seconds in which half of the attempts had a first solution, and the median length
            then; None if half never had one.
    """

    times_s: Array
    cost: Array
    low: Array
    high: Array
    first: tuple[float, float] | None


def anytime(records: pd.DataFrame, limit_s: float) -> Anytime | None:
    """Of a planner's attempts; None if it keeps no history. What was no verified success in the end
    is infinitely long from the start. Of several attempts at a problem the median counts.

    Args:
        records: rows of one planner, of one environment or one problem.
        limit_s: the time limit.
    """
    solved = (records["outcome"] == Verdict.VALID.value).to_numpy(dtype=bool)
    histories = [
        cost_history(stats) if ok else np.zeros((0, 2))
        for stats, ok in zip(records["stats"], solved, strict=True)
    ]
    begun = [history[0, 0] for history in histories if len(history)]
    if not begun:
        return None
    # The first solution is not lost to rounding.
    times = np.geomspace(max(min(begun), _SHORTEST_S), limit_s, _TIMES) * (1 + 1e-9)
    problems = records["problem"].to_numpy()
    several = len(np.unique(problems)) > 1
    curve = improvement(
        [history.tolist() for history in histories], times, problems=problems if several else None
    )
    return Anytime(
        times, curve.cost, curve.cost_low, curve.cost_high, _first(histories, times, curve.cost)
    )


def _first(histories: list[Array], times: Array, cost: Array) -> tuple[float, float] | None:
    has_one = np.array([len(history) > 0 for history in histories])
    when = np.array([history[0, 0] if len(history) else np.nan for history in histories])
    half_s = censored_median(when, has_one)
    if not np.isfinite(half_s):
        return None
    by_then = cost[min(int(np.searchsorted(times, half_s)), len(times) - 1)]
    return (half_s, float(by_then)) if np.isfinite(by_then) else None
