"""Tables from records, on records made by hand."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from records import recorded, row

from bench.report import markdown, summary
from bench.stats import wilson_interval

ROWS = [
    row("a", 0, "VALID", solve_s=1.0, length=10.0, safety_margin=0.5),
    row("a", 1, "VALID", solve_s=3.0, length=20.0, safety_margin=1.5),
    row("a", 2, "COLLISION", solve_s=100.0, length=5.0),
    row("b", 0, "KILLED", solve_s=6.0),
    row("b", 1, "VALID", solve_s=2.0, length=22.0, safety_margin=0.1, stats='{"fallbacks": 2}'),
    row("b", 2, "TIMEOUT", solve_s=5.0),
    row("c", 0, "UNSUPPORTED"),
    row("c", 1, "UNSUPPORTED"),
]
RECORDS = pd.DataFrame(ROWS)
ORDER = [("c3d", "b"), ("c3d", "a"), ("c3d", "c"), ("c3d", "absent")]


def test_summary_by_hand() -> None:
    table = summary.summarise(RECORDS, ORDER).set_index("planner")
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
    assert np.isnan(table.loc["c", "time_s_mean"])


def test_common_problems_by_hand() -> None:
    """Only problem 1 was solved by both that took part; c did not."""
    table = summary.common_problems(RECORDS).set_index("planner")
    assert table.index.tolist() == ["a", "b"]
    assert table["problems"].tolist() == [1, 1]
    assert table["length_mean"].tolist() == [20, 22]
    assert table["safety_margin_mean"].tolist() == [1.5, 0.1]


def test_nothing_attempted() -> None:
    assert summary.attempted(RECORDS)
    assert not summary.attempted(RECORDS[RECORDS["planner"] == "c"])


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
    assert "UNSUPPORTED 2" in text
    assert "nan" not in text
