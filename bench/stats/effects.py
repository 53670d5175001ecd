"""How much two planners differ, with intervals: estimates beside the tests of `hypotheses`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import bootstrap

from bench.stats import pairs
from bench.stats.intervals import clopper_pearson_interval, median_ranks
from envs.problem import Array

RATIO, DIFFERENCE, SHARE = "ratio", "difference", "share"

NEUTRAL = {RATIO: 1.0, DIFFERENCE: 0.0, SHARE: 0.5}
"""What each kind of effect is where two planners are alike."""

_AT_ONCE = 2_000_000  # resampled values in memory


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


def ratio_of_medians(
    first: ArrayLike,
    second: ArrayLike,
    *,
    seed: int,
    confidence: float = 0.95,
    resamples: int = 9999,
) -> Effect:
    """The median of the second by that of the first, over the same problems, with a percentile
    bootstrap interval that resamples problems, so that pairs stay together.

    B. Efron and R. J. Tibshirani, "An Introduction to the Bootstrap", 1993, section 13.3. The
    percentile interval, since the others need a derivative or a variance that a median lacks; it
    is wider than it need be where pairs are much alike.

    Where a value is zero or negative a ratio means nothing: the effect is the difference of the
    medians. With so few pairs that they cannot enclose a median at all (`median_ranks`; five for
    0.95) the interval has no bounds: (0, inf) or (-inf, inf). Without pairs the estimate is NaN.

    Args:
        first, second: (n,) finite values of the same problems.
        seed: of the resampling; the same gives the same interval.

    Raises:
        ValueError: the shapes differ, or a value is not finite.
    """
    one, other = pairs.values(first, second)
    kind = RATIO if (one > 0).all() and (other > 0).all() else DIFFERENCE
    statistic = _ratio if kind == RATIO else _difference
    estimate = float(statistic(one, other)) if len(one) else math.nan
    if median_ranks(len(one), confidence) is None:
        return Effect(kind, estimate, 0.0 if kind == RATIO else -math.inf, math.inf)
    interval = bootstrap(
        (one, other),
        statistic,
        paired=True,
        vectorized=True,
        n_resamples=resamples,
        batch=max(1, _AT_ONCE // len(one)),
        confidence_level=confidence,
        method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    return Effect(kind, estimate, float(interval.low), float(interval.high))


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


def _ratio(first: Array, second: Array, axis: int = -1) -> Array:
    ratio: Array = np.median(second, axis=axis) / np.median(first, axis=axis)
    return ratio


def _difference(first: Array, second: Array, axis: int = -1) -> Array:
    difference: Array = np.median(second, axis=axis) - np.median(first, axis=axis)
    return difference
