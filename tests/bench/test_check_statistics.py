"""How often `bench check` alarms: hardly ever at noise, almost always at what it is for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from records import recorded, row
from scipy.stats import binom

from bench.analysis.regression import (
    Baseline,
    Check,
    CheckOptions,
    RegressionVerdict,
    Row,
    check,
    p_of_worse_ratio,
)
from bench.analysis.statistics import success_drop
from bench.report.regression_text import text

RERUNS = 200
ALPHA = 0.05
ALLOWED = round(ALPHA * RERUNS)

RATES = {"reference": 1.0, "good": 0.95, "fair": 0.7, "poor": 0.3}
WANTED = CheckOptions(ALPHA, ("length", "margin", "time"), "reference", tolerance=0.1)


def drawn(
    rng: np.random.Generator, hardness: np.ndarray, slower: float = 1.0, rates: Any = RATES
) -> Baseline:
    """A run over problems of some hardness (n,), whose measures are noisy by 10 %, and so their
    ratios by 14 %."""
    rows = []
    for planner, rate in rates.items():
        solved = rng.random(len(hardness)) < rate
        for i, (won, hard) in enumerate(zip(solved, hardness, strict=True)):
            noise = np.exp(0.1 * rng.standard_normal(3))
            factor = 1.0 if planner == "reference" else slower
            length, margin, time = hard * noise * [1.0, 1.0, factor]
            measured = {"length": length, "safety_margin": margin, "solve_s": time}
            rows.append(row(planner, i, "VALID" if won else "TIMEOUT", **measured))
    return Baseline.of(recorded(rows), WANTED.measures)


def hardness(rng: np.random.Generator, problems: int = 50) -> np.ndarray:
    return np.exp(rng.standard_normal(problems))


def reruns(wanted: CheckOptions, problems: int, seed: int) -> list[Check]:
    rng = np.random.default_rng(seed)
    world = hardness(rng, problems)
    return [check(drawn(rng, world), drawn(rng, world), wanted) for _ in range(RERUNS)]


@pytest.mark.slow
def test_noise_alarms_no_more_often_than_alpha() -> None:
    found = reruns(WANTED, 25, seed=1)
    assert min(len(each.findings) for each in found) >= 4 + 6, "success and ratios"
    assert sum(bool(each.regressions) for each in found) <= ALLOWED


@pytest.mark.slow
def test_noise_in_ratios_of_one_factor_within_the_tolerance_alarms_at_alpha() -> None:
    """Heavy tails, problems of very different kinds, and the worst factor that is allowed: here
    the test's error is all of alpha, neither more nor much less."""
    rng = np.random.default_rng(2)
    kinds = 10 ** rng.uniform(-4, 2, 40)
    alarms = 0
    for _ in range(2000):
        before, now = kinds * np.exp(rng.standard_t(2, (2, 40)))
        alarms += p_of_worse_ratio(before, 1.1 * now, tolerance=0.1) <= ALPHA
    assert binom.ppf(0.001, 2000, ALPHA) <= alarms <= binom.ppf(0.999, 2000, ALPHA)


def test_noise_in_success_alarms_no_more_often_than_alpha_at_any_rate() -> None:
    rng = np.random.default_rng(3)
    for rate in (0.05, 0.5, 0.9, 0.99):
        counts = rng.binomial(50, rate, (RERUNS, 2)).tolist()
        alarms = sum(success_drop((a, 50), (b, 50)) <= ALPHA for a, b in counts)
        assert alarms <= ALLOWED, rate


def kept(lengths: np.ndarray, letters: np.ndarray, times: np.ndarray) -> Baseline:
    """A planner's row in a baseline, of problems with such outcomes; margins are lengths."""
    won = (letters == "S") | (letters == "L")
    values = {
        name: np.where(won, each, np.nan)
        for name, each in (("length", lengths), ("margin", lengths), ("time", times))
    }
    counts = len(letters), int(won.sum())
    row = Row("c3d", "p", "f", 0, "time_limit_s=5.0", *counts, values, "".join(letters))
    return Baseline({row.key: row}, ("length", "margin", "time"))


def repeated(
    rng: np.random.Generator, world: np.ndarray, lost: float, gained: float = 0.0
) -> Baseline:
    """A run whose paths are those of the world (n,) again and whose times are not; problems of
    negative hardness fail."""
    chance = rng.random(len(world))
    won = np.where(world > 0, chance >= lost, chance < gained)
    times = 0.01 * np.exp(rng.standard_normal(len(world)))
    return kept(np.abs(world), np.where(won, "S", "F"), times)


def test_reruns_that_repeat_their_paths_alarm_no_more_often_than_alpha() -> None:
    """One outcome in 10,000 changes for no reason."""
    rng = np.random.default_rng(11)
    for share in (1.0, 0.9, 0.5):
        world = hardness(rng, 60) * np.where(rng.random(60) < share, 1, -1)
        before = repeated(rng, world, 0.0)
        found = [
            check(before, repeated(rng, world, 1e-4, 1e-4), CheckOptions(ALPHA)) for _ in range(200)
        ]
        assert {f.test.name for each in found for f in each.findings if f.test} == {"repeated"}
        assert sum(bool(each.regressions) for each in found) <= ALLOWED


def test_5_points_less_are_noticed_at_60_problems_where_paths_are_as_they_were() -> None:
    """In at least 0.8 of all cases, and it says so."""
    rng = np.random.default_rng(12)
    world = hardness(rng, 60)
    before = repeated(rng, world, 0.0)
    found = [check(before, repeated(rng, world, 0.05), CheckOptions(0.01)) for _ in range(1000)]
    alarms = sum(bool(each.regressions) for each in found)
    assert binom.ppf(0.001, 1000, 0.808) <= alarms <= binom.ppf(0.999, 1000, 0.808)
    same = check(before, before, CheckOptions(0.01))
    assert same.power(same.findings[0]) >= 0.8
    told = text(same, Path("a"), Path("b"))
    assert "a fall to 58 of 60 (repeated)" in told
    assert "5 % of what was solved is lost is noticed with probability 0.81" in told


@pytest.mark.slow
def test_the_power_that_is_told_is_that_of_paths_drawn_anew() -> None:
    rng = np.random.default_rng(13)
    world = hardness(rng, 60)
    rates = {"reference": 1.0, "good": 1.0}
    before = drawn(rng, world, rates=rates)
    found = [
        check(
            before, drawn(rng, world, rates={"reference": 1.0, "good": 0.85}), CheckOptions(ALPHA)
        )
        for _ in range(100)
    ]
    told = found[0].power(next(f for f in found[0].findings if f.planner == "good"), 0.15)
    alarms = sum(bool(each.regressions) for each in found)
    assert binom.ppf(0.001, 100, told) <= alarms <= binom.ppf(0.999, 100, told)
    assert 0.5 < told < 0.95


def test_straight_lines_do_not_make_a_rerun_of_other_random_numbers_a_repetition() -> None:
    """Most paths are straight lines, the same with any random numbers; the rest succeed by luck."""
    rng = np.random.default_rng(14)
    lines = np.arange(60) < 50

    def luck() -> Baseline:
        letters = np.where(lines, "L", np.where(rng.random(60) < 0.5, "S", "F"))
        return kept(np.where(lines, 5.0, 5 + rng.random(60)), letters, np.full(60, 0.01))

    found = [check(luck(), luck(), CheckOptions(ALPHA)) for _ in range(RERUNS)]
    assert {f.test.name for each in found for f in each.findings if f.test} == {"McNemar"}
    assert sum(bool(each.regressions) for each in found) <= ALLOWED


def test_problems_near_the_time_limit_may_be_lost_to_a_slower_machine() -> None:
    """Paths are as they were, but three solved at 2 s of 5 are late on a machine half as fast."""
    rows = [row("p", i, "VALID", length=1.0 + i, solve_s=0.01) for i in range(20)]
    slow = [row("p", i, "VALID", length=1.0 + i, solve_s=2.6) for i in range(20, 23)]
    late = [row("p", i, "LATE", length=1.0 + i, solve_s=5.2) for i in range(20, 23)]
    before, now = (Baseline.of(recorded(rows + more)) for more in (slow, late))
    [finding] = check(before, now, CheckOptions(0.05)).findings
    assert finding.test is not None
    assert (finding.test.name, finding.test.lost, finding.test.lost_sure) == ("repeated", 3, 0)
    assert finding.verdict is RegressionVerdict.NO_DROP
    gone = [row("p", i, "TIMEOUT") for i in range(17, 20)]
    [finding] = check(
        before, Baseline.of(recorded(rows[:17] + gone + slow)), CheckOptions(0.05)
    ).findings
    assert finding.verdict is RegressionVerdict.REGRESSION


def test_a_busy_machine_is_no_regression() -> None:
    """As once seen: paths as they were, and times up to twelve times as long, so that what took
    0.3 to 0.45 s of 5 is not done in time."""
    lengths, solved = np.arange(1.0, 21.0), np.full(20, "S")
    times = np.concatenate([np.full(17, 0.02), [0.3, 0.4, 0.45]])
    before = kept(lengths, solved, times)
    busy = kept(lengths, np.where(times > 0.1, "F", "S"), 12 * times)
    [finding] = check(before, busy, CheckOptions(0.05)).findings
    assert finding.test is not None
    assert (finding.test.name, finding.test.lost, finding.test.sure) == ("repeated", 3, 17)
    assert finding.verdict is RegressionVerdict.NO_DROP
    quiet = kept(lengths, np.where(times > 0.1, "F", "S"), times)
    [finding] = check(before, quiet, CheckOptions(0.05)).findings
    assert finding.verdict is RegressionVerdict.REGRESSION


def test_a_slow_down_of_30_percent_is_found_with_50_problems() -> None:
    rng = np.random.default_rng(4)
    rates = {"reference": 1.0, "good": 1.0}
    wanted = CheckOptions(0.01, WANTED.measures, "reference", tolerance=0.1)
    found = 0
    for _ in range(20):
        world = hardness(rng)
        checked = check(
            drawn(rng, world, rates=rates), drawn(rng, world, slower=1.3, rates=rates), wanted
        )
        found += [f.what for f in checked.regressions] == ["time"]
    assert found >= 18


def test_a_planner_weakened_by_a_third_is_found_and_no_other() -> None:
    rng = np.random.default_rng(5)
    world = hardness(rng)
    before = drawn(rng, world, rates={**RATES, "good": 1.0})
    now = drawn(rng, world, rates={**RATES, "good": 0.6})
    checked = check(before, now, WANTED)
    assert [(f.planner, f.what) for f in checked.regressions] == [("good", "success")]
    assert checked.regressions[0].p_holm >= checked.regressions[0].p
    assert "- regression: `good` in `c3d`: success from 100.0 % to " in text(
        checked, Path("a"), Path("b")
    )


def test_what_cannot_be_shown_is_called_so() -> None:
    rng = np.random.default_rng(6)
    world = hardness(rng, 3)
    checked = check(drawn(rng, world), drawn(rng, world), CheckOptions(0.01))
    assert {f.verdict for f in checked.findings} == {RegressionVerdict.BLIND}


def test_larger_changes_have_smaller_p() -> None:
    rng = np.random.default_rng(7)
    before = hardness(rng)
    now = before * np.exp(0.2 * rng.standard_normal(50))
    ps = [p_of_worse_ratio(before, now * factor, tolerance=0.1) for factor in (1.0, 1.2, 1.5, 3.0)]
    assert ps == sorted(ps, reverse=True)
    assert p_of_worse_ratio(before, now / 3, tolerance=0.1, more_is_better=True) < 1e-6
    assert p_of_worse_ratio(before, now * 3, tolerance=0.1, more_is_better=True) == 1.0
    assert p_of_worse_ratio([], [], tolerance=0.1) == 1.0


@pytest.mark.parametrize(("before", "now"), [([1.0, 0.0], [1.0, 1.0]), ([1.0], [1.0, 2.0])])
def test_ratios_that_are_none(before: list[float], now: list[float]) -> None:
    with pytest.raises(ValueError, match=r"ratios must be positive|one length"):
        p_of_worse_ratio(before, now, tolerance=0.1)
