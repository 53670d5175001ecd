"""A run against a baseline: which rows fell, and what could not be compared."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy.stats import gmean

from bench.gate.baseline import MEASURES, Baseline, Row
from bench.gate.ratios import least_p, p_of_worse_ratio
from bench.gate.wanted import Wanted
from bench.stats import holm, success_drop
from envs.problem import Array

SUCCESS = "success"


class Verdict(str, Enum):
    """Of a finding."""

    REGRESSION = "regression"
    NO_DROP = "no drop shown"
    BLIND = "cannot tell"  # whatever the run had shown, it would not have been a regression


@dataclass(frozen=True)
class Finding:
    """One test of a planner in an environment.

    Attributes:
        what: SUCCESS, or one of `MEASURES`: its ratio to the reference planner's.
        problems: of the baseline and of the run; for ratios, those that both planners solved in
            both.
        before, now: success rates as fractions, or geometric means of the ratios, which alone
            change as the ratios of single problems do (P. J. Fleming and J. J. Wallace, "How not
            to lie with statistics", Communications of the ACM 1986).
        p: of the test, and `p_holm` the same corrected for all tests of the check.
        least_p: the smallest `p` that any outcome of the run could have had.
    """

    env: str
    planner: str
    what: str
    problems: tuple[int, int]
    before: float
    now: float
    p: float
    least_p: float
    p_holm: float = math.nan
    verdict: Verdict = Verdict.NO_DROP


@dataclass(frozen=True)
class Check:
    """What was found, and notes on what was not compared, with the reason."""

    wanted: Wanted
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    @property
    def regressions(self) -> tuple[Finding, ...]:
        """Those that fell."""
        return tuple(f for f in self.findings if f.verdict is Verdict.REGRESSION)


def check(before: Baseline, now: Baseline, wanted: Wanted) -> Check:
    """Tests each row of a baseline that compares with a run's.

    Success falls by Fisher's exact test, one-sided (`bench.stats.success_drop`): it holds for
    independent problems, and errs on the safe side where both met the same ones. Ratios get worse
    by `p_of_worse_ratio`, on the problems that planner and reference solved both times. A
    regression is a test whose p, corrected by Holm for all tests of the check, is at most
    `wanted.alpha`, so that noise raises any false alarm with at most this probability.

    A row compares if environment's fingerprint and settings are the same; ratios need the same
    problems, too.

    Args:
        before, now: each with values of `wanted.measures`; see `Wanted.of`, which also gives
            `wanted.reference` as it is here.
    """
    reasons = {key: _why_not(row, now.rows.get(key)) for key, row in sorted(before.rows.items())}
    notes = [f"{_named(key)}: {reason}" for key, reason in reasons.items() if reason]
    pairs = {key: (before.rows[key], now.rows[key]) for key, why in reasons.items() if not why}
    found = []
    for own in pairs.values():
        found.append(_success(*own))
        if wanted.reference not in (None, own[0].planner):
            reference = pairs.get((own[0].env, str(wanted.reference)))
            compared, note = _ratios(own, reference, wanted)
            found += compared
            notes += [f"{_named(own[0].key)}: {note}"] if note else []
    notes += [
        f"{_named(key)}: not in the baseline yet; --update adds it"
        for key in sorted(now.attempted.rows.keys() - before.rows.keys())
    ]
    return Check(wanted, tuple(_judged(found, wanted.alpha)), tuple(notes))


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


def _success(before: Row, now: Row) -> Finding:
    counts = before.solved, before.problems
    rates = before.solved / before.problems, now.solved / now.problems
    return Finding(
        env=before.env,
        planner=before.planner,
        what=SUCCESS,
        problems=(before.problems, now.problems),
        before=rates[0],
        now=rates[1],
        p=success_drop(counts, (now.solved, now.problems)),
        least_p=success_drop(counts, (0, now.problems)),
    )


def _ratios(
    own: tuple[Row, Row], reference: tuple[Row, Row] | None, wanted: Wanted
) -> tuple[list[Finding], str]:
    """A finding for each measure that compares; else why none, or some, does not."""
    if reference is None:
        return [], f"no ratios, as the reference `{wanted.reference}` does not compare there"
    seeds = sorted({row.seed for row in (*own, *reference)})
    if len(seeds) > 1:
        return [], f"no ratios, as the problems are others: their seeds are {seeds[0]}, {seeds[1]}"
    found, without = [], []
    for name in wanted.measures:
        before, now = _shared(name, own, reference)
        if len(before):
            found.append(_ratio(own[0], name, before, now, wanted.tolerance))
        else:
            without.append(name)
    if not without:
        return found, ""
    return found, f"no ratios of {', '.join(without)}, as no problem has them before and now"


def _shared(name: str, own: tuple[Row, Row], reference: tuple[Row, Row]) -> tuple[Array, Array]:
    """(n,) ratios before and now, of the problems for which there are both."""
    values = [row.values[name] for row in (*own, *reference)]
    size = min(map(len, values))
    table = np.array([each[:size] for each in values])
    own_before, own_now, before, now = table[:, np.isfinite(table).all(axis=0)]
    return own_before / before, own_now / now


def _ratio(row: Row, name: str, before: Array, now: Array, tolerance: float) -> Finding:
    more_is_better = MEASURES[name].more_is_better
    return Finding(
        env=row.env,
        planner=row.planner,
        what=name,
        problems=(len(now), len(now)),
        before=float(gmean(before)),
        now=float(gmean(now)),
        p=p_of_worse_ratio(before, now, tolerance=tolerance, more_is_better=more_is_better),
        least_p=least_p(len(now)),
    )


def _judged(found: list[Finding], alpha: float) -> Iterator[Finding]:
    for finding, p in zip(found, holm([f.p for f in found]).tolist(), strict=True):
        if p <= alpha:
            verdict = Verdict.REGRESSION
        elif finding.least_p * len(found) > alpha:
            verdict = Verdict.BLIND
        else:
            verdict = Verdict.NO_DROP
        yield replace(finding, p_holm=p, verdict=verdict)
