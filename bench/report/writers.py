"""The files of a report, one for each format, and a run's manifest."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.analysis.run_results import RunResults
from envs import InputError
from envs.errors import suggestion
from envs.files.paths import atomic_write


@dataclass(frozen=True)
class Format:
    """A kind of report: its file's name, and the module whose `write(run, file)` makes it, which
    is imported only then (plotting libraries take a second)."""

    file: str
    module: str

    def write(self, run: RunResults, folder: Path) -> None:
        """Writes the file into an existing folder."""
        writer: Callable[[RunResults, Path], None] = importlib.import_module(self.module).write
        with atomic_write(folder / self.file) as part:
            writer(run, part)


FORMATS = {
    "md": Format("summary.md", "bench.report.markdown"),
    "csv": Format("summary.csv", "bench.report.csv_table"),
    "latex": Format("summary.tex", "bench.report.latex"),
    "html": Format("report.html", "bench.report.html"),
    "planner-arena": Format("planner_arena.db", "bench.report.planner_arena"),
}

OF_RUNS = ("md", "csv")
"""What `bench run` writes by itself."""


def chosen_formats(text: str) -> list[str]:
    """Names of formats from the command line, as in "md,csv".

    Raises:
        InputError: one is unknown.
    """
    names = [name for name in text.split(",") if name]
    for name in names:
        if name not in FORMATS:
            raise InputError(f"--format: unknown {name!r}; {suggestion(name, FORMATS)}")
    if not names:
        raise InputError(f"--format: name at least one of {', '.join(FORMATS)}")
    return names


def write(run: RunResults, folder: Path, formats: Sequence[str]) -> None:
    """Writes a report in some formats into a folder, which is made if missing.

    Raises:
        InputError: the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in formats:
            FORMATS[name].write(run, folder)
    except OSError as error:
        raise InputError(f"cannot write the report to {folder}: {error}") from error


def write_manifest(run: RunResults, folder: Path) -> None:
    """Writes `manifest.json`: what was asked for, and each session that measured some of it."""
    capacity = sum(s["wall_s"] * s["jobs"] for s in run.sessions)
    planning = sum(s["setup_s"] + s["solve_s"] for s in run.sessions)
    [selection] = run.selections
    manifest = {
        **selection,
        "overhead_share": round(1 - planning / capacity, 4) if capacity else None,
        "sessions": run.sessions,
    }
    file = folder / "manifest.json"
    try:
        with atomic_write(file) as part:
            part.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {file}: {error}") from error
