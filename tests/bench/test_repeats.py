"""Several attempts at each problem: other seeds, and statistics that know they belong together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, Refused, records_of
from hypothesis import given
from hypothesis import strategies as st
from records import recorded, row

import bench as package
from bench.analysis.comparison import compare, pair_runs
from bench.analysis.regression import Baseline
from bench.analysis.statistics import clustered_wilson_interval, improvement, wilson_interval
from bench.analysis.timing import anytime
from bench.judging.metrics import METRICS
from envs import InputError

PRIMARY = tuple(metric for metric in METRICS if metric.primary)
RUN = ("run", "--env", "c3d", "--planners", "rrtconnect,ntfields", "--stop", "first", "--seed", 3)


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_each_repeat_has_a_seed_of_its_own_and_the_first_is_as_without(
    bench: Cli, tmp_path: Path
) -> None:
    once, thrice = tmp_path / "once", tmp_path / "thrice"
    assert bench(*RUN, "--problems", 2, "--out", once)[0] == 0
    assert bench(*RUN, "--problems", 2, "--out", thrice, "--repeats", 3)[0] == 0
    one, three = records_of(once), records_of(thrice)
    assert len(one) == 4
    assert len(three) == 12
    first = three[three["repeat"] == 0].reset_index(drop=True)
    assert first["path"].equals(one["path"])
    random = three[three["planner"] == "rrtconnect"]
    assert random["seed"].nunique() == 6
    assert random.groupby("problem")["path"].nunique().tolist() == [3, 3]
    assert three[three["planner"] == "ntfields"].groupby("problem")["path"].nunique().tolist() == [
        1,
        1,
    ]
    summary = pd.read_csv(thrice / "summary.csv").set_index("planner")
    assert summary.loc["ntfields", ["problems", "attempted", "solved"]].tolist() == [2, 6, 6]
    assert "2 problems an environment, 3 attempts a problem" in (thrice / "summary.md").read_text()


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_more_repeats_of_a_held_run_measure_only_what_is_new(bench: Cli, tmp_path: Path) -> None:
    few = (*RUN, "--problems", 2, "--out", tmp_path)
    assert bench(*few)[0] == 0
    before = records_of(tmp_path)
    assert bench(*few, "--repeats", 2)[0] == 0
    after = records_of(tmp_path)
    kept = after[after["repeat"] == 0].reset_index(drop=True)
    assert kept["measured_at"].equals(before["measured_at"])
    assert kept["solve_s"].equals(before["solve_s"])
    assert len(after) == 2 * len(before)
    assert bench(*few)[0] == 0
    assert len(records_of(tmp_path)) == len(before), "what was asked for last is shown"
    for command in (("report", tmp_path, "--format", "html,latex,planner-arena"),):
        assert bench(*command)[0] == 0


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_one_of_them_is_made_again_by_replay(bench: Cli, tmp_path: Path) -> None:
    assert bench(*RUN, "--problems", 2, "--repeats", 2, "--out", tmp_path)[0] == 0
    attempt = ("replay", tmp_path, "--planner", "rrtconnect", "--problem", 1)
    for repeat in (0, 1):
        code, out, err = bench(*attempt, "--repeat", repeat)
        assert code == 0, out + err
        assert "same path" in out
    code, _, err = bench(*attempt, "--repeat", 2)
    assert code == 2
    assert "repeat 2: rrtconnect has no problem 1" in err


@pytest.mark.parametrize("repeats", [0, -1, 10_001])
def test_numbers_that_make_no_sense_are_refused(refused: Refused, repeats: int) -> None:
    assert "--repeats" in refused(*RUN, "--repeats", repeats)


def rows(planner: str, outcomes: list[str], **lengths: Any) -> list[dict[str, Any]]:
    """A row an attempt: of each problem a word with a letter a repeat, V for a success."""
    return [
        row(
            planner,
            problem,
            "VALID" if letter == "V" else "TIMEOUT",
            repeat=repeat,
            solve_s=1.0 + repeat,
            length=lengths.get("length", 10.0) + repeat,
        )
        for problem, word in enumerate(outcomes)
        for repeat, letter in enumerate(word)
    ]


def test_success_counts_attempts_and_its_interval_problems() -> None:
    """Ten problems, five of which are always solved: 50 attempts tell no more than 10 do."""
    always = ["VVVVV"] * 5 + ["-----"] * 5
    mixed = ["VVV--"] * 5 + ["VV---"] * 5
    run = recorded([*rows("always", always), *rows("mixed", mixed)], repeats=5)
    a, b = (row for _, row in run.summary.iterrows())
    assert (a["problems"], a["attempted"], a["solved"], a["success_rate"]) == (10, 50, 25, 0.5)
    assert (a["success_low"], a["success_high"]) == pytest.approx(wilson_interval(5, 10), abs=0.02)
    assert (b["success_low"], b["success_high"]) == pytest.approx(wilson_interval(25, 50))


@given(st.lists(st.integers(0, 4), min_size=1, max_size=30))
def test_the_interval_is_between_that_of_problems_and_that_of_attempts(won: list[int]) -> None:
    low, high = clustered_wilson_interval(won, [4] * len(won))
    rate = sum(won) / (4 * len(won))
    assert 0 <= low <= rate <= high <= 1
    widest = wilson_interval(round(len(won) * rate), len(won))
    if (len(won) * rate).is_integer():
        assert high - low <= widest[1] - widest[0] + 1e-9
    narrowest = wilson_interval(sum(won), 4 * len(won))
    assert high - low >= narrowest[1] - narrowest[0] - 1e-9


def test_one_attempt_a_problem_is_wilsons_own() -> None:
    assert clustered_wilson_interval([1, 0, 1], [1, 1, 1]) == wilson_interval(2, 3)
    with pytest.raises(ValueError, match="clusters"):
        clustered_wilson_interval([2], [1])


def test_planners_are_compared_problem_by_problem() -> None:
    """B solves three problems more often and none less; its median is half as long on all."""
    a = rows("p", ["VV-", "V--", "---", "VVV", "VVV"])
    b = rows("p", ["VVV", "VV-", "V--", "VVV", "VVV"], length=20.0)
    table = compare(pair_runs(recorded(a), recorded(b)).pairs, PRIMARY).set_index("measure")
    assert table.loc["success", ["n", "only_a", "only_b"]].tolist() == [5, 0, 3]
    assert table.loc["length", "n"] == 4, "problems, not attempts"
    assert table.loc["length", "value_b"] == pytest.approx(21)


def test_a_baseline_is_of_first_attempts() -> None:
    once = Baseline.of(recorded(rows("p", ["V", "-", "V"])))
    thrice = Baseline.of(recorded(rows("p", ["V--", "-VV", "VVV"])))
    [one], [three] = once.rows.values(), thrice.rows.values()
    assert one.outcomes == three.outcomes
    assert (one.problems, one.solved) == (three.problems, three.solved) == (3, 2)


def history(*pairs: tuple[float, float]) -> str:
    return json.dumps({"cost_history": pairs})


def test_the_best_length_over_time_is_of_problems() -> None:
    """Of three problems with three attempts each; one problem is solved once only, and counts as
    infinitely long."""
    made = [
        row(
            "p",
            problem,
            "VALID",
            repeat=repeat,
            solve_s=2.0,
            length=10.0 * problem + repeat,
            stats=history((0.5, 20.0 * problem + repeat), (1.0, 10.0 * problem + repeat)),
        )
        for problem in (1, 2)
        for repeat in range(3)
    ]
    made += [row("p", 3, "TIMEOUT", repeat=r, solve_s=5.0) for r in (0, 1)]
    made += [row("p", 3, "VALID", repeat=2, solve_s=1.0, length=1.0, stats=history((0.1, 1.0)))]
    found = anytime(recorded(made).records, 5.0)
    assert found is not None
    assert found.cost[-1] == 21, "the median of 11, 21 and infinity"
    assert found.first is not None
    assert found.first[0] == 0.5
    assert np.isinf(found.cost[found.times_s < 0.49]).all()
    of_one = anytime(recorded([r for r in made if r["problem"] == 1]).records, 5.0)
    assert of_one is not None
    assert of_one.cost[-1] == 11
    assert anytime(recorded([row("p", 0, "TIMEOUT")]).records, 5.0) is None


def test_the_median_of_attempts_by_problem() -> None:
    curve = improvement(
        [[[1.0, 4.0]], [[1.0, 6.0]], [], [[1.0, 1.0]]], [0.5, 2.0], problems=[0, 0, 1, 1]
    )
    assert curve.cost[0] == np.inf
    assert curve.cost[1] == np.inf, "of 5 and infinity"


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_the_plot_has_a_line_a_planner_that_improves_and_dots(tmp_path: Path) -> None:
    run = package.run(
        "c3d",
        "rrtstar,rrtconnect",
        problems=3,
        repeats=2,
        stop="limit",
        time_limit=0.2,
        out=tmp_path,
    )
    axes = run.plot_anytime()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["rrtstar"]
    assert axes.get_ylabel() == "best length units"
    one = run.plot_anytime(problem=1)
    assert one.get_title() == "c3d, problem 1"
    with pytest.raises(InputError, match="no problem 7"):
        run.plot_anytime(problem=7)
