"""Whether ours is better than the paper's, by intervals."""

from __future__ import annotations

from dataclasses import dataclass

from bench.report.comparison import Verdict
from bench.stats import difference_interval


@dataclass(frozen=True)
class Finding:
    """A verdict on ours by the paper's, and why."""

    verdict: Verdict
    reason: str


def of_success(solved: int, problems: int, rate: float, paper_problems: int) -> Finding:
    """On our success against the paper's: whether the interval of the difference holds 0.

    Args:
        solved, problems: ours.
        rate, paper_problems: the paper's, a fraction, and the number of its problems.
    """
    if problems == 0:
        return Finding(Verdict.NOT_COMPARABLE, "nothing was measured")
    theirs = round(rate * paper_problems)
    low, high = difference_interval(solved, problems, theirs, paper_problems)
    gain = 100 * (solved / problems - rate)
    reason = f"success {gain:+.1f} points [{100 * low:+.1f}, {100 * high:+.1f}]"
    if low > 0:
        return Finding(Verdict.BETTER, reason)
    if high < 0:
        return Finding(Verdict.WORSE, reason)
    return Finding(Verdict.SAME, reason)
