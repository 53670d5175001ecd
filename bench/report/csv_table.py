"""`summary.csv`: every column, unrounded, for other programs."""

from __future__ import annotations

from pathlib import Path

from bench.analysis.run_results import RunResults


def write(run: RunResults, file: Path) -> None:
    """Writes a row per environment and planner; see `bench.analysis.summary.COLUMNS`."""
    run.summary.to_csv(file, index=False)
