"""How often `bench check` alarms: hardly ever at noise, almost always at what it is for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from records import recorded, row
from scipy.stats import binom

from bench.gate import Baseline, Check, Verdict, Wanted, check, p_of_worse_ratio
from bench.gate.text import text
from bench.stats import success_drop

RERUNS = 200
ALPHA = 0.05
ALLOWED = round(ALPHA * RERUNS)

RATES = {"reference": 1.0, "good": 0.95, "fair": 0.7, "poor": 0.3}
WANTED = Wanted(ALPHA, ("length", "margin", "time"), "reference", tolerance=0.1)


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


def reruns(wanted: Wanted, problems: int, seed: int) -> list[Check]:
    rng = np.random.default_rng(seed)
    world = hardness(rng, problems)
    return [check(drawn(rng, world), drawn(rng, world), wanted) for _ in range(RERUNS)]


def test_noise_alarms_no_more_often_than_alpha() -> None:
    found = reruns(WANTED, 25, seed=1)
    assert min(len(each.findings) for each in found) >= 4 + 6, "success and ratios"
    assert sum(bool(each.regressions) for each in found) <= ALLOWED


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


def test_a_slow_down_of_30_percent_is_found_with_50_problems() -> None:
    rng = np.random.default_rng(4)
    rates = {"reference": 1.0, "good": 1.0}
    wanted = Wanted(0.01, WANTED.measures, "reference", tolerance=0.1)
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
    checked = check(drawn(rng, world), drawn(rng, world), Wanted(0.01))
    assert {f.verdict for f in checked.findings} == {Verdict.BLIND}


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
