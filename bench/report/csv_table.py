"""`summary.csv`: every column, unrounded, for other programs."""

from __future__ import annotations

from pathlib import Path

from bench.report.recorded import RecordedRun


def write(run: RecordedRun, file: Path) -> None:
    """Writes a row per environment and planner; see `bench.report.summary.COLUMNS`."""
    run.summary.to_csv(file, index=False)
