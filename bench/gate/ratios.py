"""Whether a planner did worse than before by the measure of a reference planner."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bench.stats import hodges_lehmann, signed_rank

_WORST = 1e3
"""The largest factor that is looked for."""


def p_of_worse_ratio(
    before: ArrayLike, now: ArrayLike, *, tolerance: float, more_is_better: bool = False
) -> float:
    """The p-value of ratios to a reference planner that got worse by more than a tolerance.

    On each problem the change is log(now / before), its sign turned where more is better, less
    log(1 + tolerance). The test is Wilcoxon's signed-rank test, one-sided, of whether changes are
    above zero. It assumes that, if nothing changed, each problem's two ratios could as well have
    come in the other order; then their logs' difference is symmetric about 0, whatever the
    distribution and however unlike the problems are, and the test's error is at most what it says.
    The same holds if all ratios grew by one factor of at most 1 + tolerance, as they may from one
    machine to another.

    It assumes, too, that problems change independently of each other. A roadmap that is shared by
    all problems, and as large as time allowed, breaks that: such planners are no good for this.

    The error is that over baselines and runs alike: against one baseline that happened to come
    out well, alarms are more frequent.

    Args:
        before, now: (n,) positive; a planner's measure by the reference's, on the same problems.
        tolerance: a fraction, at least 0.

    Raises:
        ValueError: the shapes differ, or a value is not positive and finite.
    """
    earlier, later = np.asarray(before, dtype=float), np.asarray(now, dtype=float)
    if not ((earlier > 0).all() and (later > 0).all()):
        raise ValueError("ratios must be positive")
    sign = -1.0 if more_is_better else 1.0
    allowed = np.log1p(tolerance)
    # As the second of a pair lies above the first, so the change lies above what is allowed.
    test = signed_rank(sign * np.log(earlier) + allowed, sign * np.log(later))
    return test.p_value / 2 if test.direction > 0 else 1.0


def least_p(pairs: int) -> float:
    """The smallest p-value that so many pairs can have: all changes on one side."""
    return 0.5**pairs


def noticed_factor(changes: ArrayLike, tolerance: float, threshold: float) -> float | None:
    """By what factor all would have to be worse for the p-value of `p_of_worse_ratio` to be at most
    a threshold, with noise such as was seen; None if no factor up to a thousand is enough.

    Args:
        changes: (n,) logs of how much worse each problem's value is than before; noise is what is
            left of them without their centre (`hodges_lehmann`).
    """
    from scipy.optimize import bisect  # a fifth of a second, which most commands can save

    logs = np.asarray(changes, dtype=float)
    noise = logs - hodges_lehmann(logs)

    def excess(worse: float) -> float:
        test = signed_rank(np.full(len(noise), np.log1p(tolerance)), noise + worse)
        return (test.p_value / 2 if test.direction > 0 else 1.0) - threshold

    if excess(np.log(_WORST)) > 0:
        return None
    return float(np.exp(bisect(excess, -np.log(_WORST), np.log(_WORST), xtol=1e-3)))
