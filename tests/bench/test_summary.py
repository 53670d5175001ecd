"""Tables from records, on records made by hand."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from records import frame_of, recorded, row

from bench.analysis import summary
from bench.analysis.statistics import wilson_interval
from bench.judging.metrics import METRICS
from bench.report import formatting, markdown

ROWS = [
    row("a", 0, "VALID", solve_s=1.0, length=10.0, safety_margin=0.5),
    row("a", 1, "VALID", solve_s=3.0, length=20.0, safety_margin=1.5),
    row("a", 2, "COLLISION", solve_s=100.0, length=5.0),
    row("b", 0, "KILLED", solve_s=6.0),
    row("b", 1, "VALID", solve_s=2.0, length=22.0, safety_margin=0.1, stats='{"fallbacks": 2}'),
    row("b", 2, "TIMEOUT", solve_s=5.0),
    row("c", 0, "UNSUPPORTED", error="it learns over many scenes\nand more"),
    row("c", 1, "UNSUPPORTED", error="it learns over many scenes\nand more"),
]
RECORDS = frame_of(ROWS)
ORDER = [("c3d", "b"), ("c3d", "a"), ("c3d", "c"), ("c3d", "absent")]


def test_summary_by_hand() -> None:
    table = summary.summarise(RECORDS, ORDER, METRICS).set_index("planner")
    assert table.index.tolist() == ["b", "a", "c"]
    a = table.loc["a"]
    assert (a["problems"], a["solved"]) == (3, 2)
    assert a["success_rate"] == pytest.approx(2 / 3)
    assert (a["success_low"], a["success_high"]) == wilson_interval(2, 3)
    assert a["time_s_mean"] == 2, "failures are in no mean"
    assert a["time_s_std"] == pytest.approx(2**0.5)
    assert a["time_s_median_censored"] == 3, "a failure takes for ever"
    assert np.isposinf(table.loc["b", "time_s_median_censored"]), "more than half failed"
    assert (a["time_s_var"], a["length_var"]) == (2, 50)
    assert a["length_median"] == 15
    assert a["safety_margin_mean"] == 1
    assert json.loads(a["status_counts"]) == {"VALID": 2, "COLLISION": 1}
    assert json.loads(table.loc["b", "status_counts"]) == {"KILLED": 1, "VALID": 1, "TIMEOUT": 1}
    assert table.loc["c", "solved"] == 0
    assert table.loc["b", "fallbacks"] == 1
    assert np.isnan(table.loc["a", "fallbacks"]), "none is not 0"
    empty = table.loc["c"].drop(["env", "problems", "attempted", "solved", "status_counts"])
    assert empty.pop("reason") == "it learns over many scenes"
    assert empty.pop("processors") == empty.pop("invalid_problems") == 0
    assert empty.isna().all(), "what was not attempted has no rate, time or cost"
    assert (table.loc["c", "problems"], table.loc["c", "attempted"]) == (2, 0)
    assert pd.isna(table.loc["a", "reason"])


def test_what_befell_a_planner_is_said_once_below_the_tables() -> None:
    raised = "Traceback (most recent call last):\n  ...\nValueError: no way | out"
    rows = [
        row("a", 0, "VALID", solve_s=1.0, length=10.0, error="a note"),
        row("a", 1, "ERROR", error=raised),
        row("a", 3, "ERROR", error="Traceback\nKeyError: 'x'"),
        row("a", 4, "KILLED", error=f"took {'long ' * 100}\nlast output"),
        row("b", 2, "CRASH", error="died of signal 11\nlast output\n"),
        row("c", 0, "ERROR"),
        row("d", 0, "UNSUPPORTED", error="it cannot"),
    ]
    remarks = recorded(rows).remarks
    assert remarks[0] == "`a` in `c3d`: 2 ERROR, first on problem 1: ValueError: no way | out"
    assert remarks[1].startswith("`a` in `c3d`: 1 KILLED on problem 4: took long long")
    assert remarks[1].endswith("…")
    assert len(remarks[1]) < 250
    assert remarks[2:] == ["`b` in `c3d`: 1 CRASH on problem 2: died of signal 11"]
    assert f"- {remarks[0]}." in markdown.text(recorded(rows))


def test_what_is_still_to_be_attempted_is_told() -> None:
    rows = [row("a", i, "VALID", solve_s=1.0, length=1.0) for i in range(3)]
    assert recorded(rows).incomplete == ""
    lists = [{"id": "c3d", "fingerprint": "f", "count": 3}]
    assert recorded(rows, problems=9, envs=lists).incomplete == "", "which may leave numbers out"
    run = recorded(rows, planners=["a", "b"], problems=4, repeats=2)
    assert run.incomplete == (
        "Incomplete: 3 of 16 attempts were made, none by b in c3d; the same `bench run` goes on "
        "from there."
    )
    assert run.incomplete in markdown.text(run)


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (12.3456, "12.346"),
        (0.0123, "0.012"),
        (0.0012, "0.0012"),
        (0.000029, "0.000029"),
        (0.00000294, "0.000003"),
        (0.0, "0.000"),
        (math.inf, "inf"),
        (math.nan, "-"),
    ],
)
def test_short_times_can_be_read(value: float, written: str) -> None:
    assert formatting.seconds(value, 3) == written


def test_rates_are_of_what_was_attempted() -> None:
    """Some were skipped before there were weights."""
    rows = [row("a", i, "VALID" if i else "TIMEOUT", solve_s=1.0) for i in range(4)]
    rows += [row("a", i, "SKIPPED", error="no weights") for i in range(4, 10)]
    [a] = summary.summarise(frame_of(rows), [("c3d", "a")], METRICS).to_dict("records")
    assert (a["problems"], a["attempted"], a["solved"], a["success_rate"]) == (10, 4, 3, 0.75)
    assert (a["success_low"], a["success_high"]) == wilson_interval(3, 4)
    assert a["reason"] == "no weights"


def test_one_that_solves_nothing_is_left_out_of_the_common_problems_by_name() -> None:
    rows = [*ROWS, *(row("hopeless", i, "TIMEOUT", solve_s=5.0) for i in range(3))]
    table = summary.common_problems(frame_of(rows), METRICS).set_index("planner")
    assert table.index.tolist() == ["a", "b"]
    assert table["problems"].tolist() == [1, 1]
    assert summary.left_out_of_common(frame_of(rows)) == {"c3d": {"hopeless": 0}}
    text = markdown.text(recorded(rows))
    assert "solved by all: `hopeless` in `c3d` (0 solved)" in text
    assert "Left out" not in markdown.text(recorded(ROWS)), "c did not take part"


def test_those_that_solve_fewest_are_left_out_until_something_is_common() -> None:
    solved = {"a": range(5), "b": range(1, 6), "few": [7, 8], "one": [9], "none": []}
    rows = [
        row(name, i, "VALID" if i in known else "TIMEOUT", solve_s=1.0, length=1.0)
        for name, known in solved.items()
        for i in range(10)
    ]
    table = summary.common_problems(frame_of(rows), METRICS).set_index("planner")
    assert table["problems"].to_dict() == {"a": 4, "b": 4}
    left_out = summary.left_out_of_common(frame_of(rows))
    assert left_out == {"c3d": {"none": 0, "one": 1, "few": 2}}


BLOCKED = [False, False, True, True, None]


@pytest.mark.parametrize(
    ("solved", "left_out", "common"),
    [
        ({"a": [0, 2, 3], "b": [1, 2, 3, 4], "straight": [0, 1]}, {"straight": 2}, 2),
        ({"a": [0, 2], "straight": [0, 1]}, {}, 1),
        ({"a": [0, 1], "b": [1], "c": [1, 4]}, {}, 1),
        ({"a": [2], "b": [2, 3], "unknown": [4], "none": []}, {"unknown": 1, "none": 0}, 1),
    ],
)
def test_one_that_solves_no_blocked_problem_is_left_out_if_two_do(
    solved: dict[str, list[int]], left_out: dict[str, int], common: int
) -> None:
    rows = [
        {**row(name, i, "VALID" if i in known else "TIMEOUT", length=1.0), "blocked": BLOCKED[i]}
        for name, known in solved.items()
        for i in range(len(BLOCKED))
    ]
    records = frame_of(rows)
    assert summary.left_out_of_common(records) == ({"c3d": left_out} if left_out else {})
    table = summary.common_problems(records, METRICS)
    assert set(table["planner"]) == solved.keys() - left_out.keys()
    assert set(table["problems"]) == {common}


def test_two_that_share_nothing_are_still_told() -> None:
    rows = [row(name, i, "VALID", length=1.0) for name, i in (("a", 0), ("b", 1))]
    rows += [row(name, i, "TIMEOUT") for name, i in (("a", 1), ("b", 0))]
    table = summary.common_problems(frame_of(rows), METRICS)
    assert table["problems"].tolist() == [0, 0]
    assert summary.left_out_of_common(frame_of(rows)) == {}


def test_common_problems_by_hand() -> None:
    """Only problem 1 was solved by both that took part; c did not."""
    table = summary.common_problems(RECORDS, METRICS).set_index("planner")
    assert table.index.tolist() == ["a", "b"]
    assert table["problems"].tolist() == [1, 1]
    assert table["length_mean"].tolist() == [20, 22]
    assert table["safety_margin_mean"].tolist() == [1.5, 0.1]


def test_nothing_attempted() -> None:
    assert summary.attempted(RECORDS)
    assert not summary.attempted(RECORDS[RECORDS["planner"] == "c"])


def test_problems_that_a_list_leaves_out_are_not_counted() -> None:
    env = {"id": "c3d", "fingerprint": "f", "problems": 3, "straight_lines": "B-F"}
    text = markdown.text(recorded(ROWS, envs=[env]))
    assert text.startswith("2 problems an environment")


def test_markdown_shows_every_number_and_status() -> None:
    text = markdown.text(recorded(ROWS))
    assert text.startswith("3 problems an environment, seed 0, time limit 5 s, stop rule `first`")
    line = next(line for line in text.splitlines() if line.startswith("| c3d   | a "))
    for shown in ("66.7 [20.8, 93.9]", "2.000 ± 1.414 (2.000)", "15.00 ± 7.07", "3.00", "VALID 2"):
        assert shown in line
    assert "COLLISION 1" in line
    assert "fallback" not in line
    assert "TIMEOUT 1, with fallback 1" in text
    assert "verified successes" in text
    [line] = [line for line in text.splitlines() if line.startswith("| c3d   | c ")]
    assert "UNSUPPORTED 2: it learns over many scenes" in line
    assert [cell.strip() for cell in line.split("|")].count("-") == 5, (
        "a dash for rate, time, length, margin and offline cost"
    )
    assert "nan" not in text


def improving(planner: str, problem: int, length: float, *history: tuple[float, float]) -> Any:
    stats = json.dumps({"cost_history": history}) if history else "{}"
    return row(planner, problem, "VALID", solve_s=2.0, length=length, stats=stats)


def test_times_to_common_lengths_by_hand() -> None:
    """The shortest are 10 and 20. `early` has 12 at once, 10.4 after half a second and 10 in the
    end; on the other problem it says 15, which the judge found to be 24. `late` has one path."""
    rows = [
        improving("early", 0, 10.0, (0.1, 12.0), (0.5, 10.4), (1.5, 10.0)),
        improving("early", 1, 24.0, (0.2, 30.0), (0.3, 15.0)),
        improving("late", 0, 10.4),
        improving("late", 1, 20.0),
    ]
    table = summary.common_problems(frame_of(rows), METRICS).set_index("planner")
    early, late = table.loc["early"], table.loc["late"]
    assert (early["share_to_best"], early["share_to_5_percent"], early["share_to_20_percent"]) == (
        *(0.5, 0.5),
        1.0,
    )
    assert np.isposinf(early["time_s_to_best"]), "half were never reached"
    assert early["time_s_to_20_percent"] == pytest.approx((0.1 + 0.3) / 2)
    assert (late["share_to_best"], late["share_to_5_percent"]) == (0.5, 1.0)
    assert late["time_s_to_5_percent"] == 2.0


@pytest.mark.parametrize(
    ("stop", "improves", "said"),
    [
        ("match:mpnet:0.05", True, "1.05 x mpnet's"),
        ("match:mpnet:device=cuda:0.1", True, "1.1 x mpnet:device=cuda's"),
        ("match:mpnet:0.05", False, "its first path"),
        ("match:mpnet:0.05", None, "1.05 x mpnet's, if it improves"),
        ("first", True, "its first path"),
        ("limit", True, "the time limit"),
        ("limit", False, "its first path"),
    ],
)
def test_tables_say_what_each_planner_was_held_to(
    stop: str, improves: bool | None, said: str
) -> None:
    settings = {"time_limit_s": 5.0, "stop": stop, "jobs": 1}
    known = {} if improves is None else {"improves": {"a": improves}}
    run = recorded([improving("a", 0, 10.0)], settings=settings, **known)
    assert run.common["held_to"].tolist() == [said]
    assert run.summary["held_to"].tolist() == [said]
    text = markdown.text(run)
    assert f"| {said} " in text
    assert "planning times compare only between planners held to the same" in text


def test_problems_whose_straight_line_is_blocked_have_columns_of_their_own() -> None:
    """Problems 1 and 3 are blocked; the last was not looked at."""
    rows = [
        row("a", i, "TIMEOUT" if i == 3 else "VALID", solve_s=1.0, length=10.0 + i)
        for i in range(5)
    ]
    env = {"id": "c3d", "fingerprint": "f", "straight_lines": "FBFB"}
    env["census"] = {"share_of_straight_lines_blocked": 0.5}
    run = recorded([*rows, row("c", 0, "UNSUPPORTED")], envs=[env])
    a, c = run.summary.to_dict("records")
    assert (a["blocked_attempted"], a["blocked_solved"], a["blocked_success_rate"]) == (2, 1, 0.5)
    assert a["blocked_length_mean"] == 11
    assert np.isnan(c["blocked_success_rate"])
    text = markdown.text(run)
    assert "blocked: success %" in text
    assert "Problems of c3d: share of straight lines blocked 0.5." in text
    assert "blocked: success" not in markdown.text(recorded(rows)), "older runs do not say"
