"""The pages on tables and outcomes name every column and outcome that there is."""

from __future__ import annotations

import pytest
from documents import ROOT
from records import recorded, row

from bench.analysis import comparison, summary
from bench.judging.metrics import METRICS
from bench.report import formatting
from bench.storage.record import LATE, Fault, Verdict
from planners import Status

TABLES = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
OUTCOMES = (ROOT / "docs" / "outcomes.md").read_text(encoding="utf-8")


PRIMARY = [metric for metric in METRICS if metric.primary]


@pytest.mark.parametrize(
    "columns",
    [summary.columns(PRIMARY), [metric.name for metric in METRICS], comparison.COLUMNS],
    ids=["summary", "metrics", "comparison"],
)
def test_every_column_of_the_files_is_explained(columns: tuple[str, ...]) -> None:
    assert [name for name in columns if f"`{name}`" not in TABLES] == []


def test_every_column_that_is_printed_is_explained() -> None:
    values = {metric.name: 1.0 for metric in METRICS}
    rows = [row(name, 0, "VALID", solve_s=1.0, **values) for name in ("p", "q")]
    straight = {"id": "c3d", "fingerprint": "f", "straight_lines": "B"}
    run = recorded(rows, envs=[straight])
    [first, _] = formatting.success_rows(run)
    [further, _] = formatting.further_rows(run)
    [common, _] = formatting.common_rows(run)
    assert formatting.BLOCKED_SUCCESS in first
    assert len(further) == 2 + len(METRICS) - len(PRIMARY)
    titles = first | further | common
    assert [title for title in titles if f"`{title}`" not in TABLES] == []


def test_every_outcome_is_explained() -> None:
    claims = [status.value for status in Status if status is not Status.EXACT_SOLUTION]
    known = [LATE, *(fault.value for fault in Fault), *(verdict.value for verdict in Verdict)]
    assert [name for name in known + claims if f"`{name}`" not in OUTCOMES] == []
