"""The Hodges-Lehmann estimate of a shift, and its interval by signed ranks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from envs.problem import Array

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
