"""How much two planners differ, with intervals: estimates beside the tests of `hypotheses`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bench.stats import pairs
from bench.stats.intervals import clopper_pearson_interval
from bench.stats.walsh import hodges_lehmann, shift_interval

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
    signed-rank test of the same (`bench.stats.walsh`).

    As in that test, pairs that do not differ are left out: without any that do, the effect is none
    at all. With five or fewer the interval of 0.95 has no bounds: (0, inf) or (-inf, inf). Without
    pairs the estimate is NaN.

    Args:
        first, second: (n,) finite values of the same problems.
        kind: RATIO or DIFFERENCE; a ratio needs positive values.

    Raises:
        ValueError: the shapes differ, or a value is not finite, or not positive in a ratio.
    """
    one, other = pairs.values(first, second)
    difference = pairs.log_ratios(one, other) if kind == RATIO else other - one
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
