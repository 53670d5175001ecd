"""Paired comparisons and corrections: against SciPy, by hand, and by simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats as scipy_stats

from bench.analysis.statistics import (
    discordant_share,
    hodges_lehmann,
    holm,
    mcnemar,
    paired_drop,
    paired_effect,
    shift_interval,
    signed_rank,
    success_drop,
)

counts = st.integers(0, 40)
p_values = st.lists(st.floats(0, 1) | st.just(math.nan), max_size=12)


def outcomes(both: int, only_first: int, only_second: int, neither: int) -> list[NDArray[np.bool_]]:
    """Success of two planners with such counts."""
    first = [True] * both + [True] * only_first + [False] * (only_second + neither)
    second = [True] * both + [False] * only_first + [True] * only_second + [False] * neither
    return [np.array(first, dtype=bool), np.array(second, dtype=bool)]


def test_mcnemar_by_hand() -> None:
    """Of 8 problems that only one planner solved it is the same in 1: twice (1 + 8) / 2^8."""
    found = mcnemar(*outcomes(50, 1, 7, 3))
    assert (found.only_first, found.only_second) == (1, 7)
    assert found.p_value == pytest.approx(18 / 256)
    assert found.direction == 1
    assert mcnemar(*outcomes(50, 7, 1, 3)).direction == -1


@given(counts, counts, counts, counts)
def test_mcnemar_is_a_binomial_test_of_the_discordant(b: int, i: int, j: int, n: int) -> None:
    found = mcnemar(*outcomes(b, i, j, n))
    assert (found.only_first, found.only_second) == (i, j)
    p = scipy_stats.binomtest(j, i + j).pvalue if i + j else 1
    assert found.p_value == pytest.approx(p)


@given(counts, counts)
def test_the_share_excludes_one_half_where_mcnemar_is_significant(i: int, j: int) -> None:
    share = discordant_share(i, j)
    test = mcnemar(*outcomes(0, i, j, 0))
    assert (share.direction != 0) == (test.p_value < 0.05)
    assert share.direction in (0, test.direction)


def test_the_share_without_discordant_problems() -> None:
    share = discordant_share(0, 0)
    assert math.isnan(share.estimate)
    assert (share.low, share.high, share.direction) == (0, 1, 0)


def test_signed_rank_by_hand() -> None:
    """Differences +1, +2, +3, -4: the ranks of the rises sum to 6, of the falls to 4. Sums of at
    most 4 come of {}, 1, 2, 3, 1+2, 4, 1+3 out of 16 sets: p = 2 * 7 / 16."""
    found = signed_rank([10, 10, 10, 10], [11, 12, 13, 6])
    assert (found.differing, found.direction) == (4, 1)
    assert found.p_value == pytest.approx(14 / 16)


def test_equal_pairs_are_left_out() -> None:
    without = signed_rank([1, 2, 3, 4, 5, 6], [2, 4, 6, 8, 10, 12])
    found = signed_rank([1, 2, 3, 4, 5, 6, 7, 7], [2, 4, 6, 8, 10, 12, 7, 7])
    assert found == without
    assert found.p_value == 2 / 64, "all six rise"


@pytest.mark.parametrize("n", [0, 1, 5, 200])
def test_pairs_that_are_all_equal_show_nothing(n: int) -> None:
    found = signed_rank(np.ones(n), np.ones(n))
    assert (found.differing, found.direction, found.p_value) == (0, 0, 1)


def test_one_pair_shows_nothing() -> None:
    assert signed_rank([1.0], [2.0]).p_value == 1


@given(st.lists(st.sampled_from([-2, -1, 0, 1, 2, 3]), max_size=6))
def test_equal_sizes_are_exact_by_enumeration(differences: list[int]) -> None:
    found = signed_rank(np.zeros(len(differences)), differences)
    kept = np.array([d for d in differences if d])
    ranks = scipy_stats.rankdata(np.abs(kept))
    sums = [np.dot(signs, ranks) for signs in product((0, 1), repeat=len(kept))]
    rises = ranks[kept > 0].sum() if len(kept) else 0.0
    tail = min(np.mean([s <= rises for s in sums]), np.mean([s >= rises for s in sums]))
    assert found.p_value == pytest.approx(min(1, 2 * tail))


@pytest.mark.parametrize("n", [20, 50, 51, 300])
def test_signed_rank_is_scipys_in_either_order(n: int) -> None:
    random = np.random.default_rng(n)
    first = random.exponential(size=n)
    second = first * random.lognormal(0.1, 0.5, size=n)
    found = signed_rank(first, second)
    assert found.p_value == pytest.approx(scipy_stats.wilcoxon(first, second).pvalue)
    assert found.direction == -signed_rank(second, first).direction
    assert found.p_value == pytest.approx(signed_rank(second, first).p_value)


@pytest.mark.parametrize("seed", range(4))
def test_equal_sizes_are_counted_as_scipy_counts_them(seed: int) -> None:
    values = np.random.default_rng(seed).integers(-3, 5, 9)
    differences = values[values != 0].astype(float)
    found = signed_rank(np.zeros(len(differences)), differences)
    assert found.p_value == pytest.approx(scipy_stats.wilcoxon(differences).pvalue)


def test_an_effect_by_hand() -> None:
    first = np.array([1.0, 5, 2, 9, 4, 3, 8])
    found = paired_effect(first, 2 * first)
    assert (found.kind, found.estimate, found.low, found.high) == ("ratio", 2, 2, 2)
    less = paired_effect(first, first - 1, kind="difference")
    assert (less.kind, less.estimate, less.low, less.high) == ("difference", -1, -1, -1)
    same = paired_effect(first, first)
    assert (same.estimate, same.low, same.high) == (1, 1, 1)


@pytest.mark.parametrize("n", range(6))
def test_few_pairs_have_no_bounds(n: int) -> None:
    found = paired_effect(np.full(n, 2.0), np.full(n, 6.0))
    assert (found.low, found.high) == (0, math.inf)
    assert found.estimate == pytest.approx(3) if n else math.isnan(found.estimate)
    below = paired_effect(np.full(n, 2.0), np.full(n, -6.0), kind="difference")
    assert (below.low, below.high) == (-math.inf, math.inf)


@pytest.mark.parametrize("n", [1, 2, 5, 6, 21, 50, 51, 120])
def test_the_shift_is_the_median_of_all_means(n: int) -> None:
    values = np.random.default_rng(n).standard_t(2, n)
    means = [(a + b) / 2 for i, a in enumerate(values) for b in values[i:]]
    assert hodges_lehmann(values) == pytest.approx(np.median(means))


def test_many_differences_take_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(1).normal(size=301)
    values[:40] = values[40]  # some are the same
    made = hodges_lehmann(values), *shift_interval(values)
    monkeypatch.setattr("bench.analysis.statistics.effects._AT_ONCE", 10)
    assert (hodges_lehmann(values), *shift_interval(values)) == pytest.approx(made, abs=1e-12)
    many = np.random.default_rng(2).normal(0.3, size=100_000)
    assert hodges_lehmann(many) == pytest.approx(0.3, abs=0.02)


@given(st.lists(st.integers(-(10**6), 10**6).filter(bool), min_size=1, max_size=60, unique=True))
def test_the_interval_is_the_test_turned_round(values: list[int]) -> None:
    """It excludes 0 where SciPy's signed-rank test rejects; sizes all differ."""
    differences = np.array(values) + 0.25
    low, high = shift_interval(differences)
    assert low <= hodges_lehmann(differences) <= high
    p = scipy_stats.wilcoxon(differences, correction=False).pvalue
    excluded = low > 0 or high < 0
    if len(differences) <= 50:
        assert excluded == (p <= 0.05)
    elif abs(p - 0.05) > 0.002:
        assert excluded == (p < 0.05)


@pytest.mark.parametrize("alike", [0.0, 1.0])
def test_the_interval_covers_the_true_ratio(alike: float) -> None:
    """Of 300 samples of 40 log-normal pairs with a true ratio of 1.3; an exact 90 % interval holds
    it in 254 to 286 in all but one of 500 such tests, however alike the two find the problems."""
    random = np.random.default_rng(5)
    hits = 0
    for _ in range(300):
        hard = random.normal(size=40) * alike
        first = np.exp(hard + random.normal(0, 0.5, 40))
        second = 1.3 * np.exp(hard + random.normal(0, 0.5, 40))
        found = paired_effect(first, second, confidence=0.9)
        hits += found.low <= 1.3 <= found.high
    assert 254 <= hits <= 286


def test_pairs_stay_together() -> None:
    """Were they not, the interval would be as wide as the spread of the problems."""
    random = np.random.default_rng(6)
    first = np.exp(random.normal(0, 2, 60))
    found = paired_effect(first, first * np.exp(random.normal(0.2, 0.01, 60)))
    assert found.high / found.low < 1.01


def test_ratios_need_positive_values() -> None:
    with pytest.raises(ValueError, match="positive"):
        paired_effect([1.0, 0.0], [1.0, 1.0])


@pytest.mark.parametrize("compared", [mcnemar, signed_rank])
def test_pairs_of_different_length_are_refused(compared: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="one length"):
        compared([1, 0], [1])
    with pytest.raises(ValueError, match="one length"):
        paired_effect([1.0, 2.0], [1.0])


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_values_that_are_not_finite_are_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        signed_rank([1.0, bad], [1.0, 2.0])
    with pytest.raises(ValueError, match="finite"):
        paired_effect([1.0, bad], [1.0, 2.0])


def test_a_drop_by_hand() -> None:
    """4 of 4, then 1 of 4: of the 56 ways in which 5 successes lie among 8 attempts, 4 have so
    few after, and none fewer."""
    assert success_drop((4, 4), (1, 4)) == pytest.approx(4 / 56)
    assert success_drop((1, 4), (4, 4)) == pytest.approx(1), "a rise is no drop"


@given(counts, counts, counts, counts)
def test_a_drop_is_a_hypergeometric_tail(s: int, f: int, t: int, g: int) -> None:
    before, after = (s, s + f), (t, t + g)
    tail = scipy_stats.hypergeom(s + f + t + g, s + t, t + g).cdf(t) if s + f and t + g else 1
    assert success_drop(before, after) == pytest.approx(tail)


@given(counts, counts)
def test_a_paired_drop_is_half_of_mcnemars_test(lost: int, gained: int) -> None:
    p = paired_drop(lost, gained)
    both = mcnemar(*outcomes(3, lost, gained, 2)).p_value
    assert p == pytest.approx(both / 2 if lost > gained else p)
    assert p == pytest.approx(scipy_stats.binom.sf(lost - 1, lost + gained, 0.5))


def test_impossible_counts_are_refused() -> None:
    with pytest.raises(ValueError, match="successes"):
        success_drop((5, 4), (1, 4))
    with pytest.raises(ValueError, match="successes"):
        discordant_share(-1, 4)
    with pytest.raises(ValueError, match="lost"):
        paired_drop(-1, 4)


def test_holm_by_hand() -> None:
    """0.01 * 4; 0.02 * 3; 0.03 * 2, which is no more than the one before; 0.6 * 1."""
    assert holm([0.6, 0.02, 0.01, 0.03]) == pytest.approx([0.6, 0.06, 0.04, 0.06])
    corrected = holm([0.02, math.nan, 0.04])
    assert corrected[[0, 2]] == pytest.approx([0.04, 0.04]), "what was not tested does not count"
    assert np.isnan(corrected[1])
    assert len(holm([])) == 0


@given(p_values)
def test_holm_is_never_below_the_raw_p_and_keeps_their_order(raw: list[float]) -> None:
    corrected = holm(raw)
    tested = ~np.isnan(raw)
    assert (np.isnan(corrected) == ~tested).all()
    values, given_ = corrected[tested], np.array(raw)[tested]
    assert (values >= given_).all()
    assert (values <= np.minimum(1, given_ * len(given_))).all(), "Bonferroni is no gentler"
    assert (np.diff(values[np.argsort(given_)]) >= 0).all()


@pytest.mark.parametrize("bad", [-0.1, 1.1])
def test_holm_refuses_what_is_no_probability(bad: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        holm([0.5, bad])
