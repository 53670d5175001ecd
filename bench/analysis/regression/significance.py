"""The tests behind `bench check`: whether a planner solves fewer of the same problems than before,
and whether it got worse by the measure of a reference planner.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtrc

from bench.analysis.regression.baseline import FAILED, MISSING, STRAIGHT, Row
from bench.analysis.statistics import (
    changed_outcomes,
    hodges_lehmann,
    paired_drop,
    signed_rank,
    success_drop,
)

Flags = NDArray[np.bool_]

TESTS = {
    "Fisher": "different problems, or a baseline that does not say which were solved: Fisher's "
    "exact test",
    "McNemar": "the same problems, paths drawn anew: McNemar's exact test",
    "repeated": "the same problems, and all paths as they were, so that nothing is left to chance "
    "but time",
}
"""How success was tested, and what that means."""

FLIPS = 2.5e-4
"""The share of outcomes that may change although the same paths come again: bad luck with time
that margins for slower machines do not cover."""

_SLOWER = 10
"""How many times slower than the baseline's a machine may always be without a word: a problem that
took more than this part of the time limit may be lost by a slower one alone."""

_SLOWER_THAN_SEEN = 2
"""The same, in times of the worst that was seen on a problem that both solved: that is what a busy
machine did to this run."""

_TELLING = 3
"""So many paths with bends must be as they were before a run counts as repeated. That paths of
other random numbers agree to four digits in length and margin is no chance of this world."""


@dataclass(frozen=True)
class SuccessTest:
    """Success before and now, made comparable.

    Attributes:
        name: of `TESTS`.
        before, now: (solved, problems).
        lost, gained: how many of the shared problems only the baseline, or only the run, solved;
            None if problems are not shared.
        sure: how many the baseline solved so fast that only a change can lose them.
        lost_sure: how many of `lost` are of these.
    """

    name: str
    before: tuple[int, int]
    now: tuple[int, int]
    lost: int = 0
    gained: int = 0
    sure: int = 0
    lost_sure: int = 0

    @property
    def p(self) -> float:
        """Of so large a fall, or a larger one, if nothing changed for the worse."""
        return self._p(self.now[0], self.lost, self.gained, self.lost_sure)

    @property
    def least_p(self) -> float:
        """The least that any outcome of the run could have had."""
        return self._p_after(self.before[0])

    def noticed(self, threshold: float) -> int | None:
        """How many solved problems must be lost, whichever they are, for `p` to be at most a
        threshold, if none is gained: None if all are not enough."""
        enough = [k for k in range(1, self.before[0] + 1) if self._p_after(k) <= threshold]
        return enough[0] if enough else None

    def power(self, fall: float, threshold: float) -> float:
        """The probability that `p` is at most a threshold if each problem that was solved is lost
        with probability `fall`, and none is gained: at least that of as many lost as are always
        enough, or of as many of those that only a change can lose."""
        needed = self.noticed(threshold)
        always = 0.0 if needed is None else float(bdtrc(needed - 1, self.before[0], fall))
        if self.name != "repeated":
            return always
        sure = [k for k in range(1, self.sure + 1) if self._p(0, k, 0, k) <= threshold]
        return max(always, float(bdtrc(sure[0] - 1, self.sure, fall)) if sure else 0.0)

    def _p_after(self, lost: int) -> float:
        problems = self.now[1]
        left = round(self.before[0] * problems / self.before[1]) - lost
        return self._p(max(left, 0), lost, 0, max(lost - (self.before[0] - self.sure), 0))

    def _p(self, solved: int, lost: int, gained: int, lost_sure: int) -> float:
        if self.name == "Fisher":
            return success_drop(self.before, (solved, self.now[1]))
        drawn_anew = paired_drop(lost, gained)
        if self.name == "McNemar":
            return drawn_anew
        repeated = changed_outcomes(lost_sure - gained, self.sure, FLIPS)
        # The better of two tests, at twice its p.
        return min(1.0, 2 * min(drawn_anew, repeated))


def success_test(before: Row, now: Row) -> SuccessTest:
    """The test that suits two rows of the same environment, planner and settings.

    On the same problems (one seed, and a baseline that says which were solved) it is paired. If
    the paths come out as they did, as those of repeatable planners do with the same seeds, only
    time is left to chance: then a lost problem that was solved well within the time limit is all
    but proof of a change (at most `FLIPS` of them are lost otherwise). Else paths are drawn anew,
    and a problem is as likely to be lost as to be gained, whatever the problems are like:
    McNemar's exact test, one-sided. Of different problems Fisher's holds.
    """
    if before.seed != now.seed or not before.outcomes or not now.outcomes:
        counts = (before.solved, before.problems), (now.solved, now.problems)
        return SuccessTest("Fisher", *counts)
    size = min(len(before.outcomes), len(now.outcomes))
    was, is_ = (np.array(list(row.outcomes[:size])) for row in (before, now))
    shared = (was != MISSING) & (is_ != MISSING)
    won, wins = shared & _solved(was), shared & _solved(is_)
    sure = won & _within(before, now, won & wins)
    problems = int(shared.sum())
    if problems == 0:
        counts = (before.solved, before.problems), (now.solved, now.problems)
        return SuccessTest("Fisher", *counts)
    return SuccessTest(
        "repeated" if _repeated(before, now, was, won & wins) else "McNemar",
        (int(won.sum()), problems),
        (int(wins.sum()), problems),
        int((won & ~wins).sum()),
        int((wins & ~won).sum()),
        int(sure.sum()),
        int((sure & ~wins).sum()),
    )


def _solved(outcomes: NDArray[np.str_]) -> Flags:
    solved: Flags = (outcomes != FAILED) & (outcomes != MISSING)
    return solved


def _within(before: Row, now: Row, both: Flags) -> Flags:
    """Which problems were solved so fast that a slower, or busier, machine would solve them, too;
    `both` are those that it did solve."""
    size = len(both)
    limit = re.search(r"\btime_limit_s=([0-9.]+)", before.settings)
    if "time" not in before.values or "time" not in now.values or limit is None:
        return np.zeros(size, dtype=bool)
    earlier, later = before.values["time"][:size], now.values["time"][:size]
    seen = float(np.max(later[both] / earlier[both], initial=0.0))
    fast: Flags = earlier * max(_SLOWER, _SLOWER_THAN_SEEN * seen) <= float(limit[1])
    return fast


def _repeated(before: Row, now: Row, was: NDArray[np.str_], both: Flags) -> bool:
    """Whether lengths and margins are as they were wherever both have them, and paths with bends,
    whose lengths tell one seed from another, are among them."""
    size = len(both)
    names = [n for n in ("length", "margin") if n in before.values and n in now.values]
    pairs = [(before.values[n][:size][both], now.values[n][:size][both]) for n in names]
    same = all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)
    telling = int((both & (was != STRAIGHT)).sum())
    return "length" in names and same and telling >= _TELLING


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
