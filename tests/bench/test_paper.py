"""The paper's experiments: what describes them, verdicts and tables by hand."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from records import recorded, row

import envs
import planners
from bench.analysis.statistics import difference_interval
from bench.paper import comparison, fmm_scaling, runner
from bench.paper.comparison import ALL, Comparison, rows_beside
from bench.paper.experiment import Experiment, Place
from bench.paper.figures import Fields, Paths
from bench.paper.fmm_scaling import LEFT_OUT, SOLVED, TOO_LARGE, Dimensions
from bench.paper.training_cost import Offline
from bench.report import formatting
from envs import InputError
from planners.learning.learned_planner import LearnedPlanner

EXPERIMENTS = runner.experiments(runner.data_folder())


def test_newcombes_own_example() -> None:
    """56 of 70 against 48 of 80: his Table II, method 10."""
    low, high = difference_interval(56, 70, 48, 80)
    assert (round(low, 4), round(high, 4)) == (0.0524, 0.3339)
    assert difference_interval(10, 10, 0, 20) == pytest.approx((0.6791, 1.0), abs=1e-4)
    with pytest.raises(ValueError, match="no trials"):
        difference_interval(0, 0, 1, 2)


@given(st.integers(1, 300), st.integers(1, 300), st.data())
def test_a_difference_lies_within_its_interval_and_turns_with_it(
    n: int, m: int, data: st.DataObject
) -> None:
    k, j = data.draw(st.integers(0, n)), data.draw(st.integers(0, m))
    low, high = difference_interval(k, n, j, m)
    assert -1 - 1e-12 <= low <= k / n - j / m <= high <= 1 + 1e-12
    assert difference_interval(j, m, k, n) == pytest.approx((-high, -low))


@pytest.mark.parametrize(
    ("solved", "problems", "rate", "word"),
    [
        (1000, 1000, 0.95, "better"),
        (900, 1000, 0.95, "worse"),
        (50, 50, 0.96, "same"),
        (950, 1000, 0.95, "same"),
        (0, 0, 0.95, "not comparable"),
    ],
)
def test_verdicts_are_by_the_interval(solved: int, problems: int, rate: float, word: str) -> None:
    found = comparison.of_success(solved, problems, rate, 1000)
    assert found.verdict.value == word
    if problems:
        assert f"{100 * (solved / problems - rate):+.1f} points" in found.reason


FIGURES = pd.DataFrame(
    {
        "env": [ALL, ALL],
        "planner": ["a", "missing"],
        "problems": [100, 100],
        "success_rate": [0.5, 0.5],
        "time_s_mean": [4.0, 4.0],
        "time_s_var": [0.1, 0.1],
    }
)


OTHER = {"env": "other", "env_fingerprint": "g"}


def test_rows_beside_the_papers_by_hand() -> None:
    rows = [
        row("a", 0, "VALID", solve_s=1.0, length=10.0, safety_margin=0.5),
        row("a", 1, "VALID", solve_s=3.0, length=20.0, safety_margin=1.5),
        row("a", 2, "COLLISION", solve_s=9.0),
        row("b", 0, "TIMEOUT"),
        row("a", 0, "VALID", **OTHER, solve_s=2.0, length=30.0, safety_margin=1.0),
    ]
    a, b = rows_beside(recorded(rows), FIGURES)
    assert (a["planner"], a["problems"], a["solved"]) == ("a", 4, 3)
    assert a["length_mean"] == 20
    assert a["length_var"] == 100, "the variance, as in the paper, not its root"
    assert a["time_s_mean"] == 2
    assert (a["paper_time_s_mean"], a["paper_time_s_var"]) == (4, 0.1)
    assert math.isnan(a["paper_length_mean"])
    assert a["verdict"] == "same"
    assert a["reason"].endswith("0.5 of its time, on another machine")
    assert (b["verdict"], b["solved"]) == ("not comparable", 0)
    assert math.isnan(b["length_mean"])


@pytest.mark.parametrize("status", ["UNSUPPORTED", "SKIPPED"])
def test_what_was_not_attempted_has_no_verdict(status: str) -> None:
    rows = [row("a", i, status, error="no weights") for i in range(20)]
    [told] = rows_beside(recorded(rows), FIGURES)
    assert (told["verdict"], told["reason"]) == ("not comparable", "not attempted: no weights")
    assert math.isnan(told["success_rate"])


def test_what_the_paper_shows_is_all_there() -> None:
    """Its main table, eight scenes, Gibson, arms, training, dimensions, and its figures."""
    names = [one.name for one in EXPERIMENTS]
    assert {"c3d", "scenes", "gibson", "arms", "offline", "dimensions"} < set(names)
    assert {"fields-bunny", "fields-operator", "fields-c3d", "fields-gibson"} < set(names)
    assert {"fields-encoder", "paths-c3d", "paths-gibson", "sweep-arm4", "sweep-arm6"} < set(names)
    assert len({one.order for one in EXPERIMENTS}) == len(EXPERIMENTS)
    problems = {one.name: one.problems for one in EXPERIMENTS if isinstance(one, Comparison)}
    assert problems == {"c3d": 2000, "scenes": 1000, "gibson": 500, "arms": 100}


@pytest.mark.parametrize("one", EXPERIMENTS, ids=lambda one: one.name)
def test_experiments_name_what_exists_and_have_the_papers_figures(one: Experiment) -> None:
    place = Place(runner.data_folder(), Path("unused"), quick=False)
    if isinstance(one, Comparison):
        figures = place.figures(one.name)
        assert set(figures["planner"]) <= set(one.planners)
        assert set(figures["env"]) <= {ALL, *one.env}
        assert figures["success_rate"].between(0, 1).all()
    if isinstance(one, Offline):
        figures = place.figures(one.name)
        listed = set(zip(figures["env"], figures["planner"], strict=True))
        assert listed <= set(one.rows)
        assert all(isinstance(planners.make(p), LearnedPlanner) for _, p in one.rows)
    if isinstance(one, Dimensions):
        figures = place.figures(one.name)
        grid = {(env, n) for env in one.env for n in one.resolutions}
        assert set(zip(figures["env"], figures["resolution"], strict=True)) == grid
    if isinstance(one, Fields):
        assert "fmm" in one.planners, "errors are against it"
    if isinstance(one, Paths):
        [of] = [other for other in EXPERIMENTS if other.name == one.of]
        assert isinstance(of, Comparison)
        assert of.order < one.order
        assert one.env in of.env
        assert set(one.planners) <= set(of.planners)
    named = getattr(one, "env", ())
    for env in (named,) if isinstance(named, str) else named:
        envs.REGISTRY.entry(env)
    for planner in getattr(one, "planners", ()):
        planners.REGISTRY.entry(planner)


GOOD = """
kind = "comparison"
order = 1
title = "T"
where = "here"
env = ["arm4"]
planners = ["rrtconnect"]
problems = 4
quick = 2
"""


def test_an_experiment_is_read_with_its_defaults(tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(GOOD + "time_limit_s = 2\n[explained]\nfmm = 'why'\n")
    [one] = runner.experiments(tmp_path)
    assert isinstance(one, Comparison)
    assert (one.name, one.env, one.stop, one.time_limit_s) == ("one", ("arm4",), "paper", 2.0)
    assert one.explained == {"fmm": "why"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind =", "is not TOML"),
        (GOOD.replace("comparison", "comparisons"), "did you mean 'comparison'"),
        (GOOD + "problem = 3", "unknown key 'problem'; did you mean 'problems'"),
        (GOOD.replace("problems = 4", ""), "problems is missing"),
        (GOOD.replace("problems = 4", "problems = '4'"), "problems: '4' is not of the kind"),
        (GOOD.replace("problems = 4", "problems = true"), "problems: True is not of the kind"),
        (GOOD.replace('["arm4"]', '"arm4"'), "env: 'arm4' is not of the kind"),
        (GOOD.replace('["arm4"]', "[4]"), "env: 4 is not of the kind"),
        (GOOD + "explained = 3", "explained: 3 is not of the kind"),
        (GOOD + "[explained]\na = 3", "explained: 3 is not of the kind"),
        (GOOD + "time_limit_s = inf", "time_limit_s: inf is not of the kind"),
        (GOOD + "note = 1979-05-27", "note: .*1979-05-27.* is not of the kind"),
        (GOOD + "name = 'other'", "unknown key 'name'; an experiment is called as its file"),
        (GOOD.replace("problems = 4", "problem = 3"), "unknown key 'problem'"),
        (GOOD.replace("order = 1", "order = 0x" + "f" * 4000), "a number of it is too long"),
    ],
)
def test_what_describes_no_experiment_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(text)
    with pytest.raises(InputError, match=said):
        runner.experiments(tmp_path)


def test_durations_have_the_unit_that_suits_them() -> None:
    shown = [formatting.duration(s) for s in (0.0081, 3.74, 100, 900, 9360, 200_000, math.nan)]
    assert shown == ["0.0081 s", "3.74 s", "100 s", "15.0 min", "2.6 h", "2.3 d", "-"]


def test_fast_marchings_cost_is_measured_where_it_fits() -> None:
    small = fmm_scaling.measured("arm4", 7)
    assert small["outcome"] == SOLVED
    assert small["nodes"] == 7**4
    assert 0 < small["solve_s"] < 5
    assert fmm_scaling.measured("arm4", 7, most_nodes=100)["outcome"] == LEFT_OUT
    large = fmm_scaling.measured("arm6", 51)
    assert large["outcome"] == TOO_LARGE
    assert large["memory_gb"] > 1000
    assert math.isnan(large["solve_s"])
