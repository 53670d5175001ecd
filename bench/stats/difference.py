"""Two success rates of different problems."""

from __future__ import annotations

from math import sqrt

from bench.stats.intervals import wilson_interval


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
