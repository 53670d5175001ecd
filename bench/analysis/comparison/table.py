"""How pairs of planners compare: tests, effects and verdicts, a row a pair and measure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.analysis.comparison.conditions import why_times_differ
from bench.analysis.comparison.pairing import Pair
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import (
    DIFFERENCE,
    RATIO,
    Effect,
    McNemar,
    SignedRank,
    discordant_share,
    holm,
    mcnemar,
    paired_effect,
    signed_rank,
)
from bench.judging.metric import Metric
from bench.judging.metrics import SHORT
from envs.errors import UnknownNameError
from envs.problem import Array

Flags = NDArray[np.bool_]

SUCCESS = "success"

CONFIDENCE = 0.95
"""Of each interval, and of all verdicts of a table together."""

COLUMNS = (
    *("env", "env_fingerprint", "problems_seed", "folder_a", "planner_a", "folder_b", "planner_b"),
    *("measure", "n", "value_a", "value_b", "only_a", "only_b"),
    *("effect", "estimate", "low", "high", "p", "p_holm", "verdict", "reason"),
    "differing",
)


class ComparisonVerdict(str, Enum):
    """Of B, by A."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "same"  # no difference was shown
    CANNOT_TELL = "cannot tell"  # none could have been: there are too few problems
    NOT_COMPARABLE = "not comparable"


_ROUNDING = 1e-9
"""Values that differ by less than this part of them are the same: a straight line is as long in one
piece as in a hundred."""


@dataclass(frozen=True)
class _Comparison:
    """What was found of a pair by success or a metric. Without a test there is a reason why."""

    measure: str
    higher_is_better: bool
    n: int
    values: tuple[float, float]
    test: McNemar | SignedRank | None = None
    effect: Effect | None = None
    reason: str = ""

    @property
    def p(self) -> float:
        return math.nan if self.test is None else self.test.p_value

    def verdict(self, p_holm: float, tests: int) -> ComparisonVerdict:
        """A difference is shown by the test, corrected for so many, and by nothing else."""
        if self.test is None:
            return ComparisonVerdict.NOT_COMPARABLE
        direction = self.test.direction
        if p_holm > 1 - CONFIDENCE or direction == 0:
            too_few = _least_p(self.n) * tests > 1 - CONFIDENCE
            return ComparisonVerdict.CANNOT_TELL if too_few else ComparisonVerdict.SAME
        return (
            ComparisonVerdict.BETTER
            if (direction > 0) == self.higher_is_better
            else ComparisonVerdict.WORSE
        )


def _least_p(n: int) -> float:
    """The smallest p of both tests with so many problems: they differ on all, in one direction."""
    return min(1.0, 2.0 ** (1 - n))


def chosen_metrics(names: str | None, a: RunResults, b: RunResults) -> tuple[Metric, ...]:
    """The metrics that two runs are compared by: those of some names with commas between, in the
    tables' order, or the primary ones. Short names are as good as others.

    Raises:
        InputError: the runs know no such metric.
    """
    known = {metric.name: metric for metric in (*a.metrics, *b.metrics)}
    if names is None:
        return tuple(metric for metric in known.values() if metric.primary)
    full = {short: name for name, short in SHORT.items()}
    wanted = [full.get(name, name) for name in names.split(",")]
    for name in wanted:
        if name not in known:
            raise UnknownNameError("metric", name, [*known, *full])
    return tuple(metric for name, metric in known.items() if name in wanted)


def compare(pairs: Sequence[Pair], metrics: Sequence[Metric]) -> pd.DataFrame:
    """Compares A and B of each pair: a row for success and one for each metric, with these columns.

    `measure` is "success", or a metric's name, on the `n` problems that both solved. `value_a` and
    `value_b` are success rates (of `n` problems), as fractions, or medians, in the metric's unit.
    `only_a` and `only_b` count the problems that only one solved (of several attempts a problem:
    that it solved more often; a metric of a problem is then its median). `effect` says what
    `estimate` is, and `low` and `high` the ends of its interval: "share", of those problems, B's;
    else Hodges and Lehmann's estimate of what happens on a problem (`paired_effect`): "ratio", B's
    by A's, or "difference", B minus A, of metrics that say so and where a value is not positive.
    `p` is McNemar's or the signed-rank test's, of the logs where the effect is a ratio; `differing`
    counts the problems on which both differ, which alone the test and the effect are about.
    `p_holm` is p corrected for all tests of the table.

    `verdict` is of B, by A: better or worse if `p_holm` is at most 1 - CONFIDENCE; "same" means
    that no difference was shown, "cannot tell" that n problems are too few to show any, corrected
    for all tests of the table. Test and interval are two sides of one: uncorrected, the interval
    lies on one side where p is below 1 - CONFIDENCE. What does not compare has no test, and its
    `reason`.
    """
    found = [(pair, f) for pair in pairs for f in _findings(pair, metrics)]
    corrected = holm([finding.p for _, finding in found])
    tests = sum(finding.test is not None for _, finding in found)
    rows = [
        {
            **_place(pair),
            **_numbers(finding),
            "p_holm": p_holm,
            "verdict": finding.verdict(p_holm, tests).value,
            "reason": finding.reason,
        }
        for (pair, finding), p_holm in zip(found, corrected.tolist(), strict=True)
    ]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    typed: pd.DataFrame = table.astype({"only_a": "Int64", "only_b": "Int64", "differing": "Int64"})
    return typed


def _findings(pair: Pair, metrics: Sequence[Metric]) -> list[_Comparison]:
    rate_a, rate_b = pair.a.success, pair.b.success
    both = (rate_a > 0) & (rate_b > 0)
    measured = [_measured(metric, pair, both) for metric in metrics]
    return [_success(rate_a, rate_b), *measured]


def _success(a: Array, b: Array) -> _Comparison:
    """Of each problem's success rates; of several attempts a problem it counts for who solved it
    more often."""
    test = mcnemar(a > b, b > a)
    effect = discordant_share(test.only_first, test.only_second, CONFIDENCE)
    return _Comparison(SUCCESS, True, len(a), (float(a.mean()), float(b.mean())), test, effect)


_SOLVED_BY_NONE = "no problem was solved by both"


def _measured(metric: Metric, pair: Pair, both: Flags) -> _Comparison:
    result = partial(_Comparison, metric.name, metric.higher_is_better)
    apart = _why_apart(metric, pair)
    a, b = (side.values(metric.name)[both] for side in (pair.a, pair.b))
    known = np.isfinite(a) & np.isfinite(b)  # a scene without obstacles has no margin
    a, b = a[known], b[known]
    if len(a) == 0:
        reason = apart or "it has no value there" if both.any() else _SOLVED_BY_NONE
        return result(0, (math.nan, math.nan), reason=reason)
    medians = float(np.median(a)), float(np.median(b))
    if apart:
        return result(len(a), medians, reason=apart)
    b = np.where(np.isclose(a, b, rtol=_ROUNDING, atol=0.0), a, b)
    kind = metric.effect if min(a.min(), b.min()) > 0 else DIFFERENCE
    effect = paired_effect(a, b, kind=kind, confidence=CONFIDENCE)
    test = signed_rank(np.zeros(len(a)), np.log(b / a)) if kind == RATIO else signed_rank(a, b)
    return result(len(a), medians, test, effect)


def _why_apart(metric: Metric, pair: Pair) -> str:
    """What keeps values of a metric from comparing, empty if nothing does."""
    if len(pair.a.definitions(metric.name) | pair.b.definitions(metric.name)) > 1:
        return (
            f"{metric.name} was computed by different versions of it; run again into both folders "
            "with the one that is meant"
        )
    return why_times_differ(pair.a.conditions, pair.b.conditions) if metric.timed else ""


def _place(pair: Pair) -> dict[str, object]:
    return {
        "env": pair.env,
        "env_fingerprint": pair.fingerprint,
        "problems_seed": pair.seed,
        "folder_a": pair.a.folder,
        "planner_a": pair.a.planner,
        "folder_b": pair.b.folder,
        "planner_b": pair.b.planner,
    }


def _numbers(finding: _Comparison) -> dict[str, object]:
    """The columns from the measure to p."""
    test, effect = finding.test, finding.effect
    numbers: dict[str, object] = {
        "measure": finding.measure,
        "n": finding.n,
        "value_a": finding.values[0],
        "value_b": finding.values[1],
        "p": finding.p,
    }
    if isinstance(test, McNemar):
        numbers |= {"only_a": test.only_first, "only_b": test.only_second}
    if isinstance(test, SignedRank):
        numbers |= {"differing": test.differing}
    if effect is not None:
        estimate, low, high = effect.estimate, effect.low, effect.high
        numbers |= {"effect": effect.kind, "estimate": estimate, "low": low, "high": high}
    return numbers
