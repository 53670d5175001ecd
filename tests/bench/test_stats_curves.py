"""Curves over time: nothing that failed is dropped or counted as zero."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.analysis.statistics import censored_median, improvement, solved_by_time, wilson_interval

attempts = st.lists(st.tuples(st.floats(0, 10), st.booleans()), max_size=30)
histories = st.lists(
    st.lists(st.tuples(st.floats(0, 10), st.floats(1, 100)), max_size=5), min_size=1, max_size=15
)


def test_failures_hold_the_curve_down() -> None:
    """Four attempts: solved at 1 s and, twice, at 3 s; one failed, which took only 0.1 s."""
    curve = solved_by_time([3, 0.1, 1, 3], [True, False, True, True], until_s=5)
    assert curve.times_s.tolist() == [0, 1, 3, 5]
    assert curve.share.tolist() == [0, 0.25, 0.75, 0.75]
    bands = list(zip(curve.low, curve.high, strict=True))
    assert bands == [wilson_interval(k, 4) for k in (0, 1, 3, 3)]


def test_failures_need_no_time() -> None:
    curve = solved_by_time([math.nan, 2.0], [False, True])
    assert curve.times_s.tolist() == [0, 2]
    assert curve.share.tolist() == [0, 0.5]
    assert censored_median([math.nan, 2.0, 3.0], [False, True, True]) == 3


def test_curves_without_attempts() -> None:
    curve = solved_by_time([], [], until_s=5)
    assert curve.times_s.tolist() == [0, 5]
    assert np.isnan(curve.share).all()
    assert (curve.low.tolist(), curve.high.tolist()) == ([0, 0], [1, 1])
    assert math.isnan(censored_median([], []))


@given(attempts)
def test_the_curve_counts_what_was_solved_by_then(made: list[tuple[float, bool]]) -> None:
    times, solved = [t for t, _ in made], [ok for _, ok in made]
    curve = solved_by_time(times, solved)
    for time, share in zip(curve.times_s, curve.share, strict=True):
        by_then = sum(ok and t <= time for t, ok in made)
        assert share == by_then / len(made) if made else math.isnan(share)
    assert (np.diff(curve.times_s) > 0).all()


@pytest.mark.parametrize(
    ("solved", "median"),
    [
        ([True, True, True, True], 2.5),
        ([True, True, True, False], 2.5),
        ([True, True, False, False], math.inf),
        ([False, False, False, False], math.inf),
    ],
)
def test_a_failure_takes_for_ever(solved: list[bool], median: float) -> None:
    assert censored_median([1.0, 2.0, 3.0, 4.0], solved) == median


@given(attempts)
def test_the_median_is_infinite_if_half_or_more_fail(made: list[tuple[float, bool]]) -> None:
    times, solved = [t for t, _ in made], [ok for _, ok in made]
    if made:
        failed = solved.count(False)
        assert math.isinf(censored_median(times, solved)) == (2 * failed >= len(made))


@pytest.mark.parametrize("curve", [solved_by_time, censored_median])
def test_a_solved_attempt_needs_a_time(curve: Callable[..., object]) -> None:
    for times in ([math.nan], [math.inf], [-1.0]):
        with pytest.raises(ValueError, match="needs a time"):
            curve(times, [True])
    with pytest.raises(ValueError, match="must both be"):
        curve([1.0, 2.0], [True])


def test_improvement_by_hand() -> None:
    """Three attempts; at 1 s costs are (9, inf, inf), at 2 s (9, 7, inf), at 3 s (5, 7, inf)."""
    found = improvement([[[1, 9], [3, 5]], [[2, 7]], []], [0.5, 1, 2, 3])
    assert found.cost.tolist() == [math.inf, math.inf, 9, 7]
    assert found.solved.tolist() == [0, 1 / 3, 2 / 3, 2 / 3]
    assert (found.solved_low[2], found.solved_high[2]) == wilson_interval(2, 3)
    assert found.cost_low.tolist() == [0] * 4, "three say nothing certain of a median"
    assert np.isinf(found.cost_high).all()


def test_the_cost_band_is_between_order_statistics() -> None:
    """Nine attempts cost 1 ... 9, two of them only from 2 s on: the second and the eighth."""
    costs = [[[1.0, k]] if k < 8 else [[2.0, k]] for k in range(1, 10)]
    found = improvement(costs, [0, 1, 2])
    assert found.cost.tolist() == [math.inf, 5, 5]
    assert found.cost_low.tolist() == [math.inf, 2, 2]
    assert found.cost_high.tolist() == [math.inf, math.inf, 8]


def test_improvement_without_attempts() -> None:
    found = improvement([], [1.0, 2.0])
    assert np.isnan(found.cost).all()
    assert np.isnan(found.solved).all()
    assert (found.cost_low.tolist(), found.cost_high.tolist()) == ([0, 0], [math.inf] * 2)


@given(histories, st.lists(st.floats(0, 12), min_size=1, max_size=8).map(sorted))
def test_improvement_is_the_median_of_best_costs(
    made: list[list[tuple[float, float]]], times: list[float]
) -> None:
    found = improvement(made, times)
    for i, time in enumerate(times):
        best = [min((c for t, c in history if t <= time), default=math.inf) for history in made]
        assert found.cost[i] == np.median(best)
        assert found.cost_low[i] <= found.cost[i] <= found.cost_high[i]
        assert found.solved[i] == np.isfinite(best).mean()


@given(histories)
def test_costs_never_rise_and_success_never_falls(made: list[list[tuple[float, float]]]) -> None:
    found = improvement(made, np.linspace(0, 10, 9))
    for name in ("cost", "cost_low", "cost_high"):
        values = getattr(found, name)
        assert (values[1:] <= values[:-1]).all()
    assert (np.diff(found.solved) >= 0).all()


def test_the_band_covers_the_true_median() -> None:
    """Of 400 samples of 30 costs: at least 95 % on average, so fewer than 366 in one of 1000."""
    random = np.random.default_rng(8)
    hits = 0
    for costs in random.exponential(size=(400, 30)):
        found = improvement([[(0.0, cost)] for cost in costs], [1.0])
        hits += found.cost_low[0] <= math.log(2) <= found.cost_high[0]
    assert hits >= 366


@pytest.mark.parametrize("bad", [[[1.0]], [[1.0, math.nan]], [1.0, 2.0]])
def test_histories_must_be_of_pairs(bad: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="pairs"):
        improvement([bad], [1.0])
