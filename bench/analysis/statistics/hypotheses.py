"""Tests of whether two planners differ, and the correction for many of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtrc

from bench.analysis.statistics import effects
from bench.analysis.statistics.effects import subset_sums
from envs.problem import Array

_COUNTED = 13
"""Up to so many differences of which some are equal p is exact."""


@dataclass(frozen=True)
class McNemar:
    """Success of two planners on the same problems.

    Attributes:
        only_first, only_second: how many problems only one of them solved.
        p_value: of so uneven counts, or more uneven ones, if both were as good.
    """

    only_first: int
    only_second: int
    p_value: float

    @property
    def direction(self) -> int:
        """1 if the second solved more, -1 if the first did, else 0."""
        return int(np.sign(self.only_second - self.only_first))


@dataclass(frozen=True)
class SignedRank:
    """A measured quantity of two planners on the same problems.

    Attributes:
        differing: how many pairs differ, which are those that count.
        direction: 1 if the ranks of the pairs in which the second is larger weigh more, -1 if the
            others do, else 0.
        p_value: two-sided.
    """

    differing: int
    direction: int
    p_value: float


def mcnemar(first: ArrayLike, second: ArrayLike) -> McNemar:
    """The exact, two-sided McNemar test: which planner solved the problems that only one solved is
    as the toss of a coin, if both are as good.

    Q. McNemar, "Note on the sampling error of the difference between correlated proportions or
    percentages", Psychometrika 1947; exact by the binomial distribution. If there are no such
    problems, p is 1.

    Args:
        first, second: (n,) booleans, whether each planner solved each problem.

    Raises:
        ValueError: the shapes differ.
    """
    from scipy.stats import binomtest  # nearly a second, which most commands can save

    one, other = effects.flags(first, second)
    only_first, only_second = int((one & ~other).sum()), int((other & ~one).sum())
    discordant = only_first + only_second
    p = float(binomtest(only_first, discordant, 0.5).pvalue) if discordant else 1.0
    return McNemar(only_first, only_second, p)


def signed_rank(first: ArrayLike, second: ArrayLike) -> SignedRank:
    """Wilcoxon's signed-rank test, two-sided, of the differences second - first.

    F. Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1945. Pairs that
    do not differ are left out, as he did; if none is left, p is 1. Differences of equal size share
    the mean of their ranks. p is exact for up to 50 pairs, or 13 if sizes are equal, and else by
    the normal distribution with the variance corrected for equal sizes.

    Args:
        first, second: (n,) finite values of the same problems.

    Raises:
        ValueError: the shapes differ, or a value is not finite.
    """
    from scipy.stats import rankdata, wilcoxon

    one, other = effects.values(first, second)
    difference = other - one
    difference = difference[difference != 0]
    if len(difference) == 0:
        return SignedRank(0, 0, 1.0)
    ranks = rankdata(np.abs(difference))
    balance = float((np.sign(difference) * ranks).sum())
    tied = len(np.unique(ranks)) < len(ranks)
    if tied and len(ranks) <= _COUNTED:
        p = _counted_p(ranks, difference > 0)
    else:
        p = float(wilcoxon(difference, method="auto").pvalue)
    return SignedRank(len(difference), int(np.sign(balance)), p)


def _counted_p(ranks: Array, positive: NDArray[np.bool_]) -> float:
    """The exact two-sided p-value of signed ranks (n,), some of which are equal. SciPy comes to the
    same by all 2^n signs, in seconds."""
    doubled = np.rint(2 * ranks).astype(int)  # the mean of two ranks may end in a half
    likely = subset_sums(doubled)
    total = int(doubled[positive].sum())
    return min(1.0, 2 * float(min(likely[: total + 1].sum(), likely[total:].sum())))


def success_drop(before: tuple[int, int], after: tuple[int, int]) -> float:
    """The p-value of a success rate that fell: of so few successes after, or fewer, if the rate
    had not changed, given how many there are before and after together.

    Fisher's exact test, one-sided (R. A. Fisher, "The Design of Experiments", 1935), for attempts
    that are not paired. It never raises more false alarms than it says. Without trials on either
    side p is 1.

    Args:
        before, after: successes and trials.

    Raises:
        ValueError: the counts make no sense.
    """
    from scipy.stats import fisher_exact

    for successes, trials in (before, after):
        if not 0 <= successes <= trials:
            raise ValueError(f"{successes} successes of {trials} trials")
    table = [[successes, trials - successes] for successes, trials in (before, after)]
    return float(fisher_exact(table, alternative="greater").pvalue)


def paired_drop(lost: int, gained: int) -> float:
    """The p-value of a success rate that fell on the same problems: of so many of the problems that
    changed sides being lost, or more, if each was as likely to be gained.

    The exact McNemar test, one-sided; see `mcnemar`. It holds however unlike problems are, as long
    as each is solved as often before as after and attempts are independent. If none changed
    sides, p is 1.

    Raises:
        ValueError: a count is negative.
    """
    from scipy.stats import binomtest

    if min(lost, gained) < 0:
        raise ValueError(f"{lost} lost and {gained} gained")
    if lost + gained == 0:
        return 1.0
    return float(binomtest(lost, lost + gained, 0.5, alternative="greater").pvalue)


def changed_outcomes(changed: int, attempts: int, rate: float) -> float:
    """The p-value of outcomes that changed although everything was repeated: of so many, or more,
    if each changes with probability `rate` at most. Of none, or fewer, p is 1."""
    return float(bdtrc(min(changed - 1, attempts), attempts, rate))


def holm(p_values: ArrayLike) -> Array:
    """p-values (m,) corrected for their number, so that with probability 1 - a none of the true
    hypotheses has one of at most a, however the tests depend on each other.

    S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of
    Statistics 1979: the k-th smallest of m is multiplied by m - k + 1, none is less than one
    before it or more than 1. NaN stands for a test that was not made: it stays, and does not count.

    Raises:
        ValueError: a value is not between 0 and 1.
    """
    raw = np.asarray(p_values, dtype=float)
    if ((raw < 0) | (raw > 1)).any():
        raise ValueError("p-values must be between 0 and 1")
    made = np.flatnonzero(~np.isnan(raw))
    order = made[np.argsort(raw[made], kind="stable")]
    scaled = raw[order] * np.arange(len(order), 0, -1)
    corrected = np.full(raw.shape, np.nan)
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return corrected
