"""Planners against each other, on records made by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd
import pytest
from records import changed, recorded, row, value

from bench.analysis.comparison import compare, pair_runs
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import holm, mcnemar, paired_effect, signed_rank
from bench.judging.metric import Metric
from bench.judging.metrics import METRICS
from bench.report.comparison_text import text
from envs import InputError

PRIMARY = tuple(metric for metric in METRICS if metric.primary)

WHO = "; --planners P,Q sets P of A against Q of B"

N = 12
TIMES = np.arange(1.0, N + 1)


def planner(name: str, scale: float = 1.0, failed: Sequence[int] = (), **others: Any) -> list[Any]:
    """Its attempts at N problems: times, lengths and margins `scale` times those of problems."""
    return [
        row(name, i, "TIMEOUT", solve_s=5.0, **others)
        if i in failed
        else row(
            name,
            i,
            "VALID",
            solve_s=scale * TIMES[i] / 10,
            length=scale * (20 + TIMES[i]),
            **{"safety_margin": scale * TIMES[i] / 100, **others},
        )
        for i in range(N)
    ]


def with_settings(run: RunResults, **changed: Any) -> RunResults:
    [selection] = run.selections
    return replace(
        run, selections=({**selection, "settings": {**selection["settings"], **changed}},)
    )


def on_machine(run: RunResults, **machine: Any) -> RunResults:
    return replace(run, sessions=tuple({**s, "machine": machine} for s in run.sessions))


def compared(a: RunResults, b: RunResults, who: tuple[str, str] | None = None) -> pd.DataFrame:
    return compare(pair_runs(a, b, who).pairs, PRIMARY).set_index("measure")


def test_verdicts_know_which_way_is_better() -> None:
    a, b = recorded(planner("fmm")), recorded(planner("fmm", 0.5))
    table = compared(a, b)
    assert table["verdict"].to_dict() == {
        "success": "same",
        "time_s": "better",
        "length": "better",
        "safety_margin": "worse",
    }
    assert compared(b, a)["verdict"].tolist() == ["same", "worse", "worse", "better"]
    assert compared(a, a)["verdict"].tolist() == ["same"] * 4


def test_each_number_is_that_of_its_statistic() -> None:
    """b fails where a does not in 0; a where b does not in 1 and 2; both in 3."""
    a, b = planner("fmm", failed=[1, 2, 3]), planner("fmm", 0.5, failed=[0, 3])
    table = compared(recorded(a), recorded(b))
    success, time = table.loc["success"], table.loc["time_s"]
    assert (success["n"], success["value_a"], success["value_b"]) == (12, 9 / 12, 10 / 12)
    assert (success["only_a"], success["only_b"]) == (1, 2)
    ok_a, ok_b = ([r["outcome"] == "VALID" for r in rows] for rows in (a, b))
    assert success["p"] == mcnemar(ok_a, ok_b).p_value
    assert (success["effect"], success["estimate"]) == ("share", pytest.approx(2 / 3))
    times = TIMES[4:] / 10
    expected = paired_effect(times, 0.5 * times)
    assert (time["n"], time["value_a"], time["value_b"]) == pytest.approx((8, 0.85, 0.425))
    assert (time["effect"], time["estimate"]) == ("ratio", expected.estimate)
    assert (time["low"], time["high"]) == (expected.low, expected.high)
    assert time["p"] == signed_rank(times, 0.5 * times).p_value
    assert table["p_holm"].tolist() == holm(table["p"]).tolist()


def test_success_that_differs_clearly() -> None:
    a, b = recorded(planner("fmm")), recorded(planner("fmm", failed=range(N)))
    table = compared(a, b)
    assert table.loc["success", "verdict"] == "worse"
    assert (table.loc["success", "only_a"], table.loc["success", "only_b"]) == (N, 0)
    assert compared(b, a).loc["success", "verdict"] == "better"
    for measure in ("time_s", "length", "safety_margin"):
        found = table.loc[measure]
        assert (found["n"], found["verdict"]) == (0, "not comparable")
        assert found["reason"] == "no problem was solved by both"
        assert math.isnan(found["p"])
        assert math.isnan(found["p_holm"])


def test_what_has_no_value_does_not_compare() -> None:
    a = planner("fmm", safety_margin=None)
    found = compared(recorded(a), recorded(planner("fmm", 0.5))).loc["safety_margin"]
    assert (found["n"], found["verdict"]) == (0, "not comparable")
    assert found["reason"] == "it has no value there"


def test_many_tests_correct_each_other() -> None:
    """Eight common problems, all shorter by one planner: p = 2 / 2^8, three times, of four tests,
    and then of 32."""
    names = "abcdefgh"
    a = [planner(name, failed=range(4)) for name in names]
    b = [planner(name, 0.9 if name == "a" else 1.0, failed=range(4)) for name in names]
    alone = compared(recorded(a[0]), recorded(b[0])).loc["length"]
    assert (alone["p"], alone["p_holm"], alone["verdict"]) == (2 / 256, 4 * 2 / 256, "better")
    table = compare(pair_runs(recorded([*chain(*a)]), recorded([*chain(*b)])).pairs, PRIMARY)
    assert len(table) == 32
    among = table[(table["planner_a"] == "a") & (table["measure"] == "length")].iloc[0]
    assert (among["p"], among["p_holm"], among["verdict"]) == (2 / 256, 32 * 2 / 256, "cannot tell")


def test_a_difference_in_few_problems_is_shown_with_its_size_there() -> None:
    """The short paths and the long ones get longer, but not those in the middle."""
    lengths = [10 + i / 100 for i in range(15)] + [50.0] * 15 + [90 + i / 100 for i in range(15)]
    a = [row("p", i, "VALID", solve_s=1.0, length=x) for i, x in enumerate(lengths)]
    b = [changed(r, length=value(r, "length") + (value(r, "length") != 50)) for r in a]
    found = compared(recorded(a), recorded(b)).loc["length"]
    assert found["p_holm"] < 0.001
    assert (found["n"], found["differing"], found["verdict"]) == (45, 30, "worse")
    assert 1 < found["low"] < found["estimate"] < found["high"] < 1.1
    first, second = recorded(a), recorded(b)
    assert " of 30 " in text(
        first, second, compare(pair_runs(first, second).pairs, PRIMARY), (), PRIMARY
    )


def test_rounding_is_no_difference() -> None:
    a = planner("fmm")
    b = [changed(r, length=value(r, "length") * (1 + 1e-15)) for r in a]
    found = compared(recorded(a), recorded(b)).loc["length"]
    assert (found["differing"], found["p"], found["verdict"]) == (0, 1, "same")
    assert (found["estimate"], found["low"], found["high"]) == (1, 1, 1)


@pytest.mark.slow
def test_shorter_by_5_percent_is_shown_as_often_as_signed_ranks_show_it() -> None:
    """60 problems of very different lengths, noise of 10 %: signed ranks alone show it in 89 %."""
    rng = np.random.default_rng(8)
    shown = tested = 0
    for _ in range(60):
        hard = np.exp(rng.normal(size=60))
        noise = 0.1 / 2**0.5 * rng.normal(size=(2, 60))
        lengths = hard * np.exp(noise) * [[1.0], [0.95]]
        a, b = (
            [row("p", i, "VALID", solve_s=1.0, length=x) for i, x in enumerate(each)]
            for each in lengths
        )
        found = compared(recorded(a), recorded(b)).loc["length"]
        tested += found["p"] <= 0.05
        assert (found["p"] <= 0.05) == (found["high"] < 1 or found["low"] > 1), "one decision"
        assert (found["verdict"] == "better") == (found["p_holm"] <= 0.05)
        shown += found["verdict"] == "better"
    assert tested >= 50
    assert shown >= 45, "also corrected for the other tests of the table"


def test_margins_that_are_not_positive_have_a_difference() -> None:
    a = [changed(r, safety_margin=value(r, "safety_margin") - 0.02) for r in planner("fmm")]
    b = [changed(r, safety_margin=value(r, "safety_margin") + 1) for r in a]
    found = compared(recorded(a), recorded(b)).loc["safety_margin"]
    assert (found["effect"], found["verdict"]) == ("difference", "better")
    assert (found["estimate"], found["low"], found["high"]) == pytest.approx((1, 1, 1))


def test_different_settings_leave_times_alone() -> None:
    a = recorded(planner("fmm"))
    b = with_settings(recorded(planner("fmm", 0.5)), stop="limit", time_limit_s=9.0)
    table = compared(a, b)
    found = table.loc["time_s"]
    assert found["verdict"] == "not comparable"
    assert found["reason"] == "stop first against limit; time limit s 5.0 against 9.0"
    values = found["value_a"], found["value_b"]
    assert values == pytest.approx((0.65, 0.325)), "they are still told"
    assert math.isnan(found["p"])
    assert table.loc["length", "verdict"] == "better"


def test_a_memory_limit_does_not_change_times() -> None:
    a = with_settings(recorded(planner("fmm")), memory_limit_mb=1)
    b = with_settings(recorded(planner("fmm", 0.5)), memory_limit_mb=2)
    assert compared(a, b).loc["time_s", "verdict"] == "better"


def test_other_definitions_of_a_metric_do_not_compare() -> None:
    def with_mine(version: str) -> RunResults:
        return recorded(
            [changed(row, mine=1.0, versions={"mine": version}) for row in planner("a")]
        )

    mine = Metric("mine", "mine", "", 2, "lower", lambda *_: 1.0)
    same = pair_runs(with_mine("1"), with_mine("1")).pairs
    assert compare(same, [mine])["verdict"].tolist() == ["same", "same"]
    table = compare(pair_runs(with_mine("1"), with_mine("2")).pairs, [mine, *PRIMARY])
    table = table.set_index("measure")
    assert table.loc["mine", "verdict"] == "not comparable"
    assert table.loc["mine", "reason"].startswith("mine was computed by different versions of it")
    assert table.loc["length", "verdict"] == "same", "others go by themselves"


def test_different_machines_leave_times_alone() -> None:
    a, b = recorded(planner("fmm")), recorded(planner("fmm", 0.5))
    one, other = on_machine(a, processor="X", cores=2), on_machine(b, processor="Y", cores=2)
    found = compared(one, other).loc["time_s"]
    assert found["verdict"] == "not comparable"
    assert found["reason"] == "measured on different machines: processor X against Y"
    same = on_machine(b, processor="X", cores=2)
    assert compared(one, same).loc["time_s", "verdict"] == "better"


def test_machines_that_are_not_known_do_not_compare() -> None:
    a, b = recorded(planner("fmm")), recorded(planner("fmm", 0.5, run_id="q"))
    found = compared(a, b).loc["time_s"]
    assert found["verdict"] == "not comparable"
    assert found["reason"] == "measured on several machines, or on some that are not known"
    run = recorded([*planner("fmm"), *planner("other", 0.5)])
    assert compared(run, run, ("fmm", "other")).loc["time_s", "verdict"] == "better"


def test_a_run_from_several_machines_does_not_compare() -> None:
    rows = [{**r, "run_id": "r" if i < 6 else "q"} for i, r in enumerate(planner("fmm"))]
    a = recorded(rows)
    session = a.sessions[0]
    sessions = ({**session, "machine": {"m": 1}}, {**session, "run_id": "q", "machine": {"m": 2}})
    reason = compared(replace(a, sessions=sessions), on_machine(a, m=1)).loc["time_s", "reason"]
    assert reason == "measured on several machines, or on some that are not known"


def test_only_problems_that_both_were_measured_on_count() -> None:
    a = recorded(planner("fmm")[:8])
    b = recorded([*planner("fmm")[2:], row("fmm", 0, "SKIPPED")])
    pairing = pair_runs(a, b)
    [pair] = pairing.pairs
    assert pair.a.attempts["problem"].tolist() == pair.b.attempts["problem"].tolist()
    assert pair.a.attempts["problem"].tolist() == [2, 3, 4, 5, 6, 7]
    assert pairing.left_out == (
        "c3d: 2 problems of A (fmm) alone",
        "c3d: 4 problems of B (fmm) alone",
    )


def test_each_planner_meets_itself_and_the_others_are_named() -> None:
    a = recorded([*planner("fmm"), *planner("x"), *planner("u"), *planner("v")])
    b = recorded([*planner("y"), *planner("u"), *planner("fmm")])
    pairing = pair_runs(a, b)
    assert [(p.a.planner, p.b.planner) for p in pairing.pairs] == [("fmm", "fmm"), ("u", "u")]
    assert pairing.left_out == (
        f"c3d: measured in A alone: x, v{WHO}",
        f"c3d: measured in B alone: y{WHO}",
    )


def test_a_planner_that_was_not_attempted_meets_none() -> None:
    a = recorded([*planner("fmm"), row("x", 0, "UNSUPPORTED")])
    b = recorded([*planner("fmm"), *planner("x")])
    pairing = pair_runs(a, b)
    assert [p.a.planner for p in pairing.pairs] == ["fmm"]
    assert pairing.left_out == (f"c3d: measured in B alone: x{WHO}",)


def test_single_planners_meet_whatever_their_names() -> None:
    [pair] = pair_runs(recorded(planner("x")), recorded(planner("y"))).pairs
    assert (pair.a.planner, pair.b.planner) == ("x", "y")


def test_two_planners_of_one_run() -> None:
    run = recorded([*planner("x"), *planner("y", 0.5), *planner("z")])
    table = compared(run, run, ("x", "y"))
    assert len(table) == 4
    assert table.loc["time_s", "verdict"] == "better"


def test_environments_that_are_not_shared_are_left_out_with_a_reason() -> None:
    a = recorded(
        [
            *planner("p"),
            *planner("p", env="box", env_fingerprint="b1"),
            *planner("p", env="arm4", env_fingerprint="r"),
            *planner("p", env="bunny", env_fingerprint="u"),
        ]
    )
    b = recorded(
        [
            *planner("p"),
            *planner("p", env="box", env_fingerprint="b2"),
            *planner("p", env="arm4", env_fingerprint="r", problems_seed=7),
            *planner("p", env="gibson", env_fingerprint="g"),
        ]
    )
    pairing = pair_runs(a, b)
    assert [pair.env for pair in pairing.pairs] == ["c3d"]
    assert pairing.left_out == (
        "box: the name is the same, the environment is not: its fingerprint is b1 in A, b2 in B",
        "arm4: the environment is the same, the problems are not: their seed is 0 in A, 7 in B",
        "bunny (fingerprint u, seed 0): only in A",
        "gibson (fingerprint g, seed 0): only in B",
    )
    shown = text(a, b, compare(pairing.pairs, PRIMARY), pairing.left_out, PRIMARY)
    for reason in pairing.left_out:
        assert f"- Left out: {reason}." in shown


@pytest.mark.parametrize(
    ("others", "said"),
    [
        ({"env_fingerprint": "g"}, "its fingerprint is f in A, g in B"),
        ({"problems_seed": 3}, "their seed is 0 in A, 3 in B"),
        ({"env": "box", "env_fingerprint": "g"}, "c3d (fingerprint f, seed 0): only in A; box"),
        ({"status": "UNSUPPORTED"}, "c3d (fingerprint f, seed 0): only in A"),
    ],
)
def test_runs_that_share_nothing_are_refused(others: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match="nothing to compare between A, somewhere, and B") as error:
        pair_runs(recorded(planner("p")), recorded(planner("p", **others)))
    assert said in str(error.value)


def test_runs_whose_planners_do_not_match_are_refused() -> None:
    a = recorded([*planner("x"), *planner("y")])
    with pytest.raises(InputError, match=r"--planners P,Q must say who.*A has x, y; B has z\)"):
        pair_runs(a, recorded(planner("z")))


def test_runs_without_a_common_problem_are_refused() -> None:
    a, b = recorded(planner("p")[:5]), recorded(planner("p")[5:])
    with pytest.raises(InputError, match=r"5 problems of A \(p\) alone; c3d: 7 problems of B"):
        pair_runs(a, b)


def test_runs_in_which_nothing_was_measured_are_refused() -> None:
    run = recorded([row("p", 0, "SKIPPED")])
    with pytest.raises(InputError, match="nothing was measured"):
        pair_runs(run, run)


def test_the_same_environment_may_have_another_name() -> None:
    [pair] = pair_runs(recorded(planner("p")), recorded(planner("p", env="c3d:scene=x"))).pairs
    assert pair.env == "c3d"


def test_a_pair_does_not_depend_on_the_others() -> None:
    run = recorded([*planner("x"), *planner("y", 0.7)])
    other = recorded([*planner("x", 0.9), *planner("y")])
    together = compare(pair_runs(run, other).pairs, PRIMARY)
    alone = compare(pair_runs(run, other, ("y", "y")).pairs, PRIMARY)
    same = [c for c in alone.columns if c not in ("p_holm", "verdict")]
    pd.testing.assert_frame_equal(
        together[together["planner_a"] == "y"][same].reset_index(drop=True), alone[same]
    )


def test_the_text_says_every_number_and_reason() -> None:
    a, b = planner("fmm", failed=[0]), planner("fmm", 0.5, failed=[1, 2])
    first, second = recorded(a), with_settings(recorded(b), jobs=2)
    pairing = pair_runs(first, second)
    shown = text(first, second, compare(pairing.pairs, PRIMARY), pairing.left_out, PRIMARY)
    assert shown.startswith("A: `somewhere`. 12 problems an environment")
    assert "B: `somewhere`. 12 problems" in shown
    lines = {line.split("|")[4].strip(): line for line in shown.splitlines() if "| fmm" in line}
    assert list(lines) == ["success", "time s", "length units", "safety margin units"]
    for said in ("12 |", "91.7 %", "83.3 %", "only A 2, only B 1", "1.0000", "same"):
        assert said in lines["success"]
    for said in ("9 |", "0.8 ", "0.4 ", "| - ", "not comparable"):
        assert said in lines["time s"]
    for said in ("28 ", "14 ", "0.5 [0.5, 0.5]", "0.0039", "0.0117", "better"):
        assert said in lines["length units"]
    assert "- Not comparable, time s: jobs 1 against 2 (c3d fmm)." in shown
    assert "no difference was shown" in shown
    assert "nan" not in shown


def test_small_p_and_differences_are_told_as_such() -> None:
    a = [row("p", i, "VALID", solve_s=1.0, length=1.0 + i, safety_margin=-1.0) for i in range(40)]
    b = [{**changed(r, safety_margin=1.0), "planner": "q"} for r in a]
    run = recorded([*a, *b])
    shown = text(run, run, compare(pair_runs(run, run, ("p", "q")).pairs, PRIMARY), (), PRIMARY)
    assert shown.startswith("A and B: `somewhere`. 40 problems")
    assert "B - A: 2 [2, 2] | < 0.0001" in " ".join(shown.split())
