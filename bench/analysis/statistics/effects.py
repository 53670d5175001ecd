"""How much two planners differ on the same problems: estimates with intervals, beside the tests of
`hypotheses`. A shift is estimated by Hodges and Lehmann, its interval is that of signed ranks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.analysis.statistics.intervals import clopper_pearson_interval
from envs.problem import Array

RATIO, DIFFERENCE, SHARE = "ratio", "difference", "share"

NEUTRAL = {RATIO: 1.0, DIFFERENCE: 0.0, SHARE: 0.5}
"""What each kind of effect is where two planners are alike."""


@dataclass(frozen=True)
class Effect:
    """Second against first: an estimate and the ends of its interval.

    `kind` is RATIO (second by first), DIFFERENCE (second minus first, in their unit) or SHARE (of
    the problems that only one solved, the second's).
    """

    kind: str
    estimate: float
    low: float
    high: float

    @property
    def direction(self) -> int:
        """1 or -1 if the whole interval is above or below what it would be for equals, else 0."""
        neutral = NEUTRAL[self.kind]
        return int(self.low > neutral) - int(self.high < neutral)


def paired_effect(
    first: ArrayLike, second: ArrayLike, *, kind: str = RATIO, confidence: float = 0.95
) -> Effect:
    """How much the second differs from the first on the same problems: the Hodges-Lehmann estimate
    of the logs' differences, as a ratio, or of the differences, with the interval that inverts the
    signed-rank test of the same (`bench.analysis.statistics.effects`).

    As in that test, pairs that do not differ are left out: without any that do, the effect is none
    at all. With five or fewer the interval of 0.95 has no bounds: (0, inf) or (-inf, inf). Without
    pairs the estimate is NaN.

    Args:
        first, second: (n,) finite values of the same problems.
        kind: RATIO or DIFFERENCE; a ratio needs positive values.

    Raises:
        ValueError: the shapes differ, or a value is not finite, or not positive in a ratio.
    """
    one, other = values(first, second)
    difference = log_ratios(one, other) if kind == RATIO else other - one
    differing = difference[difference != 0]
    if len(difference) and not len(differing):
        return Effect(kind, NEUTRAL[kind], NEUTRAL[kind], NEUTRAL[kind])
    numbers = hodges_lehmann(differing), *shift_interval(differing, confidence)
    return Effect(kind, *(np.exp(numbers) if kind == RATIO else np.array(numbers)).tolist())


def discordant_share(only_first: int, only_second: int, confidence: float = 0.95) -> Effect:
    """Of the problems that only one planner solved, the share that the second did.

    The interval is Clopper and Pearson's: it excludes 1/2 exactly where McNemar's exact test has
    p < 1 - `confidence`. Without such problems the estimate is NaN and the interval (0, 1).

    Raises:
        ValueError: a count is negative.
    """
    discordant = only_first + only_second
    low, high = clopper_pearson_interval(only_second, discordant, confidence)
    estimate = only_second / discordant if discordant else math.nan
    return Effect(SHARE, estimate, low, high)


_EXACT = 50
"""Up to so many differences the distribution of signed ranks is counted, as in `signed_rank`."""

_AT_ONCE = 2000
"""Up to so many differences all their means are made; of more, one is found by halving."""


def hodges_lehmann(differences: ArrayLike) -> float:
    """The median of the means of all pairs of differences (n,), each with itself, too: an estimate
    of the centre that they lie about. NaN without differences.

    J. L. Hodges and E. L. Lehmann, "Estimates of location based on rank tests", Annals of
    Mathematical Statistics 1963.
    """
    values = np.sort(np.asarray(differences, dtype=float))
    count = len(values) * (len(values) + 1) // 2
    if not count:
        return math.nan
    return (_ranked(values, (count - 1) // 2) + _ranked(values, count // 2)) / 2


def shift_interval(differences: ArrayLike, confidence: float = 0.95) -> tuple[float, float]:
    """The interval of all shifts that Wilcoxon's signed-rank test does not reject, around
    `hodges_lehmann`: it excludes 0 where that test, of differences none of which is zero, has
    p < 1 - `confidence`.

    Its ends are means of two differences (J. W. Tukey, "The simplest signed-rank tests", 1949; M.
    Hollander, D. A. Wolfe and E. Chicken, "Nonparametric Statistical Methods", 3rd edition, section
    3.3). With so few differences that none could be shown (five for 0.95) it is (-inf, inf).
    """
    values = np.sort(np.asarray(differences, dtype=float))
    n = len(values)
    count = n * (n + 1) // 2
    left_out = _left_out(n, confidence)
    if left_out < 0:
        return -math.inf, math.inf
    return _ranked(values, left_out), _ranked(values, count - 1 - left_out)


def subset_sums(ranks: Iterable[int]) -> Array:
    """The probability of each sum 0, 1, ... of a random subset of some ranks, each of which is in
    it with probability 1/2: the distribution of signed ranks under the null hypothesis."""
    likely = np.ones(1)
    for rank in ranks:
        step = np.zeros(rank + 1)
        step[[0, -1]] = 0.5
        likely = np.convolve(likely, step)
    return likely


def _left_out(n: int, confidence: float) -> int:
    """How many of the means may lie beyond either end of the interval, or -1: one less than the
    most with P(signed ranks < that) <= (1 - confidence) / 2."""
    tail = (1 - confidence) / 2
    if n > _EXACT:
        mean, deviation = n * (n + 1) / 4, math.sqrt(n * (n + 1) * (2 * n + 1) / 24)
        return math.floor(mean + NormalDist().inv_cdf(tail) * deviation)
    likely = np.cumsum(subset_sums(range(1, n + 1)))
    return int(np.searchsorted(likely, tail, side="right")) - 1


def _ranked(values: Array, rank: int) -> float:
    """Of the means of two of the sorted values, the one with `rank` smaller ones."""
    if len(values) <= _AT_ONCE:
        one, other = np.triu_indices(len(values))
        means = (values[one] + values[other]) / 2
        return float(np.partition(means, rank)[rank])
    low, high = float(values[0]), float(values[-1])
    while low < (middle := (low + high) / 2) < high:
        # Ordered pairs with a mean of at most the middle, those of one value twice.
        below = int(np.searchsorted(values, 2 * middle - values, side="right").sum())
        below = (below + int(np.searchsorted(values, middle, side="right"))) // 2
        low, high = (low, middle) if below > rank else (middle, high)
    return high


def flags(first: ArrayLike, second: ArrayLike) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Two arrays (n,) of booleans.

    Raises:
        ValueError: the shapes differ.
    """
    one, other = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    _check_shapes(one.shape, other.shape)
    return one, other


def values(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array]:
    """Two arrays (n,) of finite numbers.

    Raises:
        ValueError: the shapes differ, or a value is not finite.
    """
    one, other = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    _check_shapes(one.shape, other.shape)
    if not (np.isfinite(one) & np.isfinite(other)).all():
        raise ValueError("values must be finite; leave out the problems that were not solved")
    return one, other


def log_ratios(first: Array, second: Array) -> Array:
    """The logarithms (n,) of the second by the first.

    Raises:
        ValueError: a value is not positive.
    """
    if not ((first > 0).all() and (second > 0).all()):
        raise ValueError("a ratio needs positive values")
    ratios: Array = np.log(second / first)
    return ratios


def _check_shapes(first: tuple[int, ...], second: tuple[int, ...]) -> None:
    if first != second or len(first) != 1:
        raise ValueError(f"pairs need arrays (n,) of one length, not {first} and {second}")
