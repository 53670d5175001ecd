"""A run against a baseline: which rows fell, and what could not be compared."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from statistics import geometric_mean

import numpy as np

from bench.analysis.regression.baseline import Baseline, CheckOptions, Row, gated_metrics
from bench.analysis.regression.significance import (
    SuccessTest,
    least_p,
    noticed_factor,
    p_of_worse_ratio,
    success_test,
)
from bench.analysis.statistics import holm
from envs.problem import Array

SUCCESS = "success"

FALL = 0.05
"""The fall of success whose chance of being noticed is told: 100 to 95 %."""


class RegressionVerdict(str, Enum):
    """Of a finding."""

    REGRESSION = "regression"
    NO_DROP = "no drop shown"
    BLIND = "cannot tell"  # whatever the run had shown, it would not have been a regression


@dataclass(frozen=True)
class RegressionFinding:
    """One test of a planner in an environment.

    Attributes:
        what: SUCCESS, or one of `gated_metrics`: itself, or its ratio to the reference planner's.
        problems: of the baseline and of the run: the same ones, where success is paired; for
            measures, those solved in both, by the reference, too.
        before, now: success rates as fractions, or geometric means of the measure or its ratios,
            which alone change as those of single problems do (P. J. Fleming and J. J. Wallace, "How
            not to lie with statistics", Communications of the ACM 1986).
        p: of the test, and `p_holm` the same corrected for all tests of the check.
        least_p: the smallest `p` that any outcome of the run could have had.
        test: of success; None for measures.
        changes: of measures, (n,) logs of how much worse the run's is on each problem.
    """

    env: str
    planner: str
    what: str
    problems: tuple[int, int]
    before: float
    now: float
    p: float
    least_p: float
    test: SuccessTest | None = None
    changes: Array | None = None
    p_holm: float = math.nan
    verdict: RegressionVerdict = RegressionVerdict.NO_DROP


@dataclass(frozen=True)
class Check:
    """What was found, and notes on what was not compared, with the reason.

    Attributes:
        incomplete: what of the run is still to be attempted; see `RunResults.incomplete`.
    """

    wanted: CheckOptions
    findings: tuple[RegressionFinding, ...]
    notes: tuple[str, ...]
    incomplete: str = ""

    @property
    def regressions(self) -> tuple[RegressionFinding, ...]:
        """Those that fell."""
        return tuple(f for f in self.findings if f.verdict is RegressionVerdict.REGRESSION)

    @property
    def is_blind(self) -> bool:
        """Whether no outcome of the run would have been a regression."""
        return all(f.verdict is RegressionVerdict.BLIND for f in self.findings)

    @property
    def passes(self) -> bool:
        """Whether there might have been a regression, and is none."""
        return not (self.regressions or self.is_blind or self.incomplete)

    @property
    def threshold(self) -> float:
        """The p that one test alone must have to be a regression."""
        return self.wanted.alpha / max(len(self.findings), 1)

    def noticed(self, finding: RegressionFinding) -> float | None:
        """The least change for the worse that would be a regression: for success how many solved
        problems must be lost, for measures the factor by which the run's would have to be worse
        than the baseline's; None if no change would."""
        if finding.test is not None:
            return finding.test.noticed(self.threshold)
        assert finding.changes is not None
        return noticed_factor(finding.changes, self.wanted.tolerance, self.threshold)

    def power(self, finding: RegressionFinding, fall: float = FALL) -> float:
        """The probability that a fall of success is noticed in which each problem that the baseline
        solved is lost with this probability."""
        assert finding.test is not None
        return finding.test.power(fall, self.threshold)


def check(before: Baseline, now: Baseline, wanted: CheckOptions, incomplete: str = "") -> Check:
    """Tests each row of a baseline that compares with a run's.

    Success falls by `success.success_test`, which is paired on the same problems.
    Measures get worse by `p_of_worse_ratio`, on the problems that were solved both times: of
    lengths and margins, which depend on no machine, themselves; with a reference, which planner and
    reference solved both times, their ratios. A regression is a test whose p, corrected by Holm for
    all tests of the check, is at most `wanted.alpha`, so that noise raises any false alarm with at
    most this probability.

    A row compares if environment's fingerprint and settings are the same, whatever the environment
    is called; measures need the same problems, too.

    Args:
        before, now: each with values of `wanted.measures`; see `CheckOptions.of`, which also gives
            `wanted.reference` as it is here.
        incomplete: what of the run is still to be attempted, empty if nothing is.
    """
    now = now.called_as(before)
    reasons = {key: _why_not(row, now.rows.get(key)) for key, row in sorted(before.rows.items())}
    notes = [f"{_named(key)}: {reason}" for key, reason in reasons.items() if reason]
    pairs = {key: (before.rows[key], now.rows[key]) for key, why in reasons.items() if not why}
    found = []
    for own in pairs.values():
        found.append(_success(*own))
        notes += _unpaired(found[-1], *own)
        if wanted.measures and wanted.reference != own[0].planner:
            reference = pairs.get((own[0].env, str(wanted.reference)))
            compared, note = _ratios(own, reference, wanted)
            found += compared
            notes += [f"{_named(own[0].key)}: {note}"] if note else []
    notes += [
        f"{_named(key)}: not in the baseline yet; --update adds it"
        for key in sorted(now.attempted.rows.keys() - before.rows.keys())
    ]
    return Check(wanted, tuple(_judged(found, wanted.alpha)), tuple(notes), incomplete)


def _named(key: tuple[str, str]) -> str:
    return f"`{key[1]}` in `{key[0]}`"


def _why_not(before: Row, now: Row | None) -> str:
    """Why two rows do not compare, empty if they do."""
    if now is None:
        return "not compared, as this run lacks it; --update drops it"
    if now.problems == 0:
        return "not compared, as it was UNSUPPORTED or SKIPPED in this run"
    if now.fingerprint != before.fingerprint:
        return (
            "not compared, as the environment is another one: its fingerprint was "
            f"{before.fingerprint} and is {now.fingerprint}"
        )
    if now.settings != before.settings:
        was, is_ = set(before.settings.split()), set(now.settings.split())
        return (
            "not compared, as the settings are others: they were "
            f"{' '.join(sorted(was - is_))} and are {' '.join(sorted(is_ - was))}"
        )
    return ""


def _success(before: Row, now: Row) -> RegressionFinding:
    test = success_test(before, now)
    (was, of), (is_, now_of) = test.before, test.now
    return RegressionFinding(
        env=before.env,
        planner=before.planner,
        what=SUCCESS,
        problems=(of, now_of),
        before=was / of,
        now=is_ / now_of,
        p=test.p,
        least_p=test.least_p,
        test=test,
    )


def _unpaired(finding: RegressionFinding, before: Row, now: Row) -> list[str]:
    """A note if success of the same problems was not tested in pairs."""
    assert finding.test is not None
    if finding.test.name != "Fisher" or before.seed != now.seed:
        return []
    return [
        f"{_named(before.key)}: success is tested as if problems were others, which takes a larger "
        "fall to notice: the baseline does not say which were solved; --update writes it so"
    ]


def _ratios(
    own: tuple[Row, Row], reference: tuple[Row, Row] | None, wanted: CheckOptions
) -> tuple[list[RegressionFinding], str]:
    """A finding for each measure that compares; else why none, or some, does not."""
    what = "ratios" if wanted.reference else "measures"
    if reference is None and wanted.reference:
        return [], f"no ratios, as the reference `{wanted.reference}` does not compare there"
    seeds = sorted({row.seed for row in (*own, *(reference or ()))})
    if len(seeds) > 1:
        return [], f"no {what}, as the problems are others: their seeds are {seeds[0]}, {seeds[1]}"
    found, without = [], []
    for name in wanted.measures:
        before, now = _shared(name, own, reference)
        if len(before):
            found.append(_ratio(own[0], name, before, now, wanted.tolerance))
        else:
            without.append(name)
    if not without:
        return found, ""
    return found, f"no {what} of {', '.join(without)}, as no problem has them before and now"


def _shared(
    name: str, own: tuple[Row, Row], reference: tuple[Row, Row] | None
) -> tuple[Array, Array]:
    """(n,) values, or ratios to the reference's, before and now, of the problems for which there
    are both."""
    values = [row.values[name] for row in (*own, *(reference or ()))]
    size = min(map(len, values))
    table = np.array([each[:size] for each in values])
    own_before, own_now, *others = table[:, np.isfinite(table).all(axis=0)]
    before, now = others or (1.0, 1.0)
    return own_before / before, own_now / now


def _ratio(row: Row, name: str, before: Array, now: Array, tolerance: float) -> RegressionFinding:
    more_is_better = gated_metrics()[name].higher_is_better
    return RegressionFinding(
        env=row.env,
        planner=row.planner,
        what=name,
        problems=(len(now), len(now)),
        before=float(geometric_mean(before)),
        now=float(geometric_mean(now)),
        p=p_of_worse_ratio(before, now, tolerance=tolerance, more_is_better=more_is_better),
        least_p=least_p(len(now)),
        changes=np.log(before / now if more_is_better else now / before),
    )


def _judged(found: list[RegressionFinding], alpha: float) -> Iterator[RegressionFinding]:
    for finding, p in zip(found, holm([f.p for f in found]).tolist(), strict=True):
        if p <= alpha:
            verdict = RegressionVerdict.REGRESSION
        elif finding.least_p * len(found) > alpha:
            verdict = RegressionVerdict.BLIND
        else:
            verdict = RegressionVerdict.NO_DROP
        yield replace(finding, p_holm=p, verdict=verdict)
