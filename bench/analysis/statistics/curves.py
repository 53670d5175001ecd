"""Success and cost against time, over all attempts: what failed is censored, never left out.

Bands are pointwise: each place of a curve is covered with the confidence said, not all at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.analysis.statistics.intervals import median_ranks, wilson_band
from envs.problem import Array


@dataclass(frozen=True)
class SolvedByTime:
    """The share of all attempts that were solved by a time; steps that hold until the next time.

    Attributes:
        times_s: (k,) ascending; the first is 0.
        share, low, high: (k,) fractions: the share and the ends of its Wilson interval.
    """

    times_s: Array
    share: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Improvement:
    """Success and best cost against time, over all attempts.

    Attributes:
        times_s: (k,) as asked for.
        solved, solved_low, solved_high: (k,) fractions: the share solved by then and the ends of
            its Wilson interval.
        cost, cost_low, cost_high: (k,) the median of the best costs by then, where what is not
            solved yet costs infinity, and the ends of its interval.
    """

    times_s: Array
    solved: Array
    solved_low: Array
    solved_high: Array
    cost: Array
    cost_low: Array
    cost_high: Array


def solved_by_time(
    times_s: ArrayLike,
    solved: ArrayLike,
    *,
    until_s: float | None = None,
    confidence: float = 0.95,
) -> SolvedByTime:
    """The empirical distribution of planning time over all attempts.

    A failure is censored: it counts among the attempts at every time, and never as solved. Since
    all are given the same time limit, and a failure is one whatever time it took, this is the
    Kaplan-Meier estimate with failures censored at the limit (E. L. Kaplan and P. Meier,
    "Nonparametric estimation from incomplete observations", JASA 1958). Bands are Wilson's. Without
    attempts shares are NaN and bands (0, 1).

    Args:
        times_s: (n,) seconds; those of failures are not looked at and may be NaN.
        solved: (n,) booleans.
        until_s: where the curve ends, by default at the last solution.

    Raises:
        ValueError: the shapes differ, or a solved attempt has no time.
    """
    times = _times_of_all(times_s, solved)
    ends = [] if until_s is None else [until_s]
    steps = np.unique(np.concatenate([[0.0], times[np.isfinite(times)], ends]))
    counts = np.searchsorted(np.sort(times), steps, side="right")
    return SolvedByTime(steps, *_shares(counts, len(times), confidence))


def censored_median(times_s: ArrayLike, solved: ArrayLike) -> float:
    """The median time over all attempts, where a failure takes for ever: infinite if half of them
    or more fail. NaN without attempts.

    Args:
        times_s: (n,) seconds; those of failures are not looked at and may be NaN.
        solved: (n,) booleans.

    Raises:
        ValueError: the shapes differ, or a solved attempt has no time.
    """
    times = _times_of_all(times_s, solved)
    return float(np.median(times)) if len(times) else math.nan


def improvement(
    histories: Sequence[Sequence[Sequence[float]]],
    times_s: ArrayLike,
    *,
    problems: ArrayLike | None = None,
    confidence: float = 0.95,
) -> Improvement:
    """How success and cost of a planner that improves develop, over all attempts, or over problems
    of which each was attempted several times: the cost of a problem is then the median of its
    attempts', and solved is what at least half of them have solved.

    At each time the cost is the median over all of them, infinite where half or more are not solved
    yet, and its interval is between order statistics (`median_ranks`): no distribution is assumed,
    and infinite costs are values like others. With five attempts or fewer (at 0.95) it is (0, inf).
    Without attempts shares and costs are NaN.

    Args:
        histories: of each attempt the pairs (seconds, cost) at which it got better, as in
            `cost_history`; empty if it failed. A planner that does not improve has one pair.
        times_s: (k,) seconds at which to look, ascending.
        problems: (n,) which problem each history is of; by default another one each.

    Raises:
        ValueError: a history is not of pairs, or has a NaN.
    """
    times = np.asarray(times_s, dtype=float)
    costs = np.array([_best_costs(history, times) for history in histories])
    costs = costs.reshape(len(histories), len(times))
    costs = np.sort(costs if problems is None else _by_problem(costs, problems), axis=0)
    solved = _shares(np.isfinite(costs).sum(axis=0), len(costs), confidence)
    ranks = median_ranks(len(costs), confidence)
    if ranks is None:
        ends = np.zeros(len(times)), np.full(len(times), np.inf)
    else:
        ends = costs[ranks[0]], costs[ranks[1]]
    middle = np.median(costs, axis=0) if len(costs) else np.full(len(times), np.nan)
    return Improvement(times, *solved, middle, *ends)


def _best_costs(history: Sequence[Sequence[float]], times: Array) -> Array:
    """The least cost of the history by each time, infinite before its first."""
    if not len(history):
        return np.full(len(times), np.inf)
    pairs = np.asarray(history, dtype=float)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or np.isnan(pairs).any():
        raise ValueError("a cost history must be of pairs (seconds, cost)")
    ordered = pairs[np.argsort(pairs[:, 0], kind="stable")]
    best = np.concatenate([[np.inf], np.minimum.accumulate(ordered[:, 1])])
    reached: Array = best[np.searchsorted(ordered[:, 0], times, side="right")]
    return reached


def _by_problem(costs: Array, problems: ArrayLike) -> Array:
    """The medians (m, k) of each problem's rows of costs (n, k). Where the middle is between a
    number and infinity, it is infinite: no more than half are solved."""
    of = np.asarray(problems)
    medians = [np.median(costs[of == problem], axis=0) for problem in np.unique(of)]
    return np.array(medians).reshape(-1, costs.shape[1])


def _shares(counts: NDArray[np.intp], n: int, confidence: float) -> tuple[Array, Array, Array]:
    """Counts (k,) of n attempts as shares with the ends of their intervals."""
    share = counts / n if n else np.full(len(counts), np.nan)
    return share, *wilson_band(counts, n, confidence)


def _times_of_all(times_s: ArrayLike, solved: ArrayLike) -> Array:
    """Times (n,) with infinity for failures."""
    times, ok = np.asarray(times_s, dtype=float), np.asarray(solved, dtype=bool)
    if times.shape != ok.shape or times.ndim != 1:
        raise ValueError(f"times {times.shape} and successes {ok.shape} must both be (n,)")
    if not (np.isfinite(times[ok]) & (times[ok] >= 0)).all():
        raise ValueError("a solved attempt needs a time of at least 0 s")
    censored: Array = np.where(ok, times, np.inf)
    return censored
