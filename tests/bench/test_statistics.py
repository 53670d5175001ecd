"""Intervals against SciPy and published values."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

from bench.analysis.statistics import (
    clopper_pearson_interval,
    median_ranks,
    wilson_band,
    wilson_interval,
)

Interval = Callable[..., tuple[float, float]]

INTERVALS: dict[str, Interval] = {"wilson": wilson_interval, "exact": clopper_pearson_interval}


@given(
    st.integers(1, 5000),
    st.floats(0, 1),
    st.sampled_from([0.8, 0.9, 0.95, 0.99]),
    st.sampled_from(sorted(INTERVALS)),
)
def test_both_intervals_are_scipys(
    trials: int, share: float, confidence: float, method: str
) -> None:
    successes = round(share * trials)
    theirs = binomtest(successes, trials).proportion_ci(confidence, method=method)
    assert INTERVALS[method](successes, trials, confidence) == pytest.approx(
        (theirs.low, theirs.high), abs=1e-9
    )


@pytest.mark.parametrize("interval", INTERVALS.values())
def test_the_ends_of_both_intervals(interval: Interval) -> None:
    assert interval(0, 10)[0] == 0
    assert interval(10, 10)[1] == 1
    assert interval(0, 0) == (0, 1)


def test_a_published_value() -> None:
    low, high = wilson_interval(81, 263)  # Newcombe 1998, table I
    assert (round(low, 4), round(high, 4)) == (0.2553, 0.3662)


def test_clopper_pearson_by_hand() -> None:
    """Of 10 successes in 10 trials the lower end p has p^10 = 0.025."""
    assert clopper_pearson_interval(10, 10) == (pytest.approx(0.025**0.1), 1)
    assert clopper_pearson_interval(0, 10) == (0, pytest.approx(1 - 0.025**0.1))


def test_a_band_is_an_interval_for_each_count() -> None:
    low, high = wilson_band(np.arange(8), 7)
    pairs = list(zip(low, high, strict=True))
    assert pairs == [wilson_interval(k, 7) for k in range(8)]


@pytest.mark.parametrize("interval", INTERVALS.values())
@pytest.mark.parametrize(("successes", "trials"), [(-1, 3), (4, 3)])
def test_nonsense_is_refused(interval: Interval, successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match="successes"):
        interval(successes, trials)


@pytest.mark.parametrize("confidence", [0.0, 1.0, 95.0, float("nan")])
def test_impossible_confidence_is_refused(confidence: float) -> None:
    with pytest.raises(ValueError, match="confidence"):
        wilson_interval(1, 3, confidence)
    with pytest.raises(ValueError, match="confidence"):
        clopper_pearson_interval(1, 3, confidence)
    with pytest.raises(ValueError, match="confidence"):
        median_ranks(3, confidence)


def test_ranks_about_a_median_by_hand() -> None:
    """Of 6 values all are above the median, or all below it, with probability 2 / 64 = 0.031; of
    5 with 2 / 32 = 0.063. Of 9, the second and the eighth leave out 2 (1 + 9) / 512 = 0.039."""
    assert [median_ranks(n) for n in (0, 1, 5, 6, 9)] == [None, None, None, (0, 5), (1, 7)]
    assert median_ranks(6, 0.97) is None
    assert median_ranks(100) == (39, 60), "the 40th and the 61st, as in tables"


@given(st.integers(0, 400), st.sampled_from([0.5, 0.9, 0.95, 0.999]))
def test_ranks_cover_as_promised_and_no_wider(n: int, confidence: float) -> None:
    ranks = median_ranks(n, confidence)
    left_out = -1 if ranks is None else ranks[0]
    assert 2 * binom.cdf(left_out, n, 0.5) <= 1 - confidence + 1e-12
    assert 2 * binom.cdf(left_out + 1, n, 0.5) > 1 - confidence
    if ranks is not None:
        assert sum(ranks) == n - 1
