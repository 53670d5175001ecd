"""Confidence intervals for a rate, the difference of two rates, and a median; none assumes a
distribution of what is measured.
"""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import bdtr, betainccinv, betaincinv

from envs.problem import Array


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval for a success rate, as fractions.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA
    1927. No trials give (0, 1).

    Raises:
        ValueError: the counts or the confidence make no sense.
    """
    low, high = wilson_band([successes], trials, confidence)
    return float(low[0]), float(high[0])


def wilson_band(
    successes: ArrayLike, trials: float, confidence: float = 0.95
) -> tuple[Array, Array]:
    """Wilson's score interval for many counts (m,) of successes among as many trials, which need
    not be whole numbers: the lower and the upper ends, each (m,), as fractions. See
    `wilson_interval`."""
    counts = np.asarray(successes, dtype=float)
    _check(counts, trials, confidence)
    if trials == 0:
        return np.zeros_like(counts), np.ones_like(counts)
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    rate = counts / trials
    shrink = 1 + z * z / trials
    centre = (rate + z * z / (2 * trials)) / shrink
    spread = z / shrink * np.sqrt(rate * (1 - rate) / trials + (z / (2 * trials)) ** 2)
    low = np.where(counts == 0, 0.0, np.maximum(0.0, centre - spread))
    high = np.where(counts == trials, 1.0, np.minimum(1.0, centre + spread))
    return low, high


def clustered_wilson_interval(
    successes: ArrayLike, trials: ArrayLike, confidence: float = 0.95
) -> tuple[float, float]:
    """Wilson's score interval for the success rate of trials that come in clusters, as repeated
    attempts at each of some problems do, which are more alike than attempts at others.

    As many trials count as independent ones would be needed for the same variance (J. N. K. Rao
    and A. J. Scott, "A simple method for the analysis of clustered binary data", Biometrics 1992):
    the variance of the rate is estimated between clusters. At most all trials count, and at least
    one of each cluster; where that variance is not known, as with a rate of 0 or 1, no more than
    these. With one trial a cluster it is `wilson_interval`.

    Args:
        successes, trials: (m,) counts of each cluster, with at least one trial each.

    Raises:
        ValueError: the counts or the confidence make no sense.
    """
    won, of = np.asarray(successes, dtype=float), np.asarray(trials, dtype=float)
    if won.shape != of.shape or won.ndim != 1 or not ((won >= 0) & (won <= of) & (of >= 1)).all():
        raise ValueError("clusters need trials, and at most as many successes")
    n, m = float(of.sum()), len(of)
    if n == m:
        return wilson_interval(int(won.sum()), m, confidence)
    rate = float(won.sum()) / n
    effective = float(m)
    between = float(((won - rate * of) ** 2).sum()) / n**2 * m / max(m - 1, 1)
    if between > 0:
        effective = min(max(rate * (1 - rate) / between, float(m)), n)
    low, high = wilson_band([rate * effective], effective, confidence)
    return float(low[0]), float(high[0])


def clopper_pearson_interval(
    successes: int, trials: int, confidence: float = 0.95
) -> tuple[float, float]:
    """The exact interval for a success rate, as fractions, which covers it at least as often as
    `confidence` says.

    C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in the
    case of the binomial", Biometrika 1934; by quantiles of the beta distribution. No trials give
    (0, 1).

    Raises:
        ValueError: the counts or the confidence make no sense.
    """
    _check(np.array([successes]), trials, confidence)
    tail, failures = (1 - confidence) / 2, trials - successes
    low = 0.0 if successes == 0 else float(betaincinv(successes, failures + 1, tail))
    high = 1.0 if failures == 0 else float(betainccinv(successes + 1, failures, tail))
    return low, high


def median_ranks(n: int, confidence: float = 0.95) -> tuple[int, int] | None:
    """Which of n sorted values, counted from 0, are the ends of an interval for the median of what
    they are drawn from; None if n is so small that not even the least and the largest are.

    The number of values below the median is binomial, so the r-th from below and the r-th from
    above enclose it with probability at least 1 - 2 P(Bin(n, 1/2) < r), whatever the distribution.
    (With confidence 0.95 it takes six values.) H. A. David and H. N. Nagaraja, "Order Statistics",
    3rd edition, section 7.1.

    Raises:
        ValueError: the confidence is not between 0 and 1.
    """
    _check(np.array([0]), n, confidence)
    # As many values as may be left out at either end: the most with P(Bin <= left out) <= tail.
    tail = (1 - confidence) / 2
    left_out = int((bdtr(np.arange(n // 2), n, 0.5) <= tail).sum()) - 1
    return None if left_out < 0 else (left_out, n - 1 - left_out)


def _check(successes: Array, trials: float, confidence: float) -> None:
    if not ((successes >= 0) & (successes <= trials)).all():
        raise ValueError(f"there must be between 0 and {trials} successes, the number of trials")
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, not {confidence}")


def difference_interval(
    successes: int,
    trials: int,
    other_successes: int,
    other_trials: int,
    confidence: float = 0.95,
) -> tuple[float, float]:
    """Newcombe's hybrid score interval for a success rate less another one, as fractions.

    R. G. Newcombe, "Interval estimation for the difference between independent proportions:
    comparison of eleven methods", Statistics in Medicine 1998, method 10: the distances of both
    rates from the ends of their Wilson intervals add up as squares.

    Raises:
        ValueError: the counts make no sense, or there are no trials.
    """
    if trials == 0 or other_trials == 0:
        raise ValueError("no trials")
    low, high = wilson_interval(successes, trials, confidence)
    other_low, other_high = wilson_interval(other_successes, other_trials, confidence)
    rate, other = successes / trials, other_successes / other_trials
    difference = rate - other
    return (
        difference - sqrt((rate - low) ** 2 + (other_high - other) ** 2),
        difference + sqrt((high - rate) ** 2 + (other - other_low) ** 2),
    )
