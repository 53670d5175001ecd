"""Beside a planner that crashes, hangs and leaks, the others lose nothing, and nothing stays."""

from __future__ import annotations

import gc
import os
import sys
import tempfile
import threading
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import planners_that_fail
import psutil
import pytest
from conftest import Cli, records_of

from bench.execution.session import Progress
from bench.storage.record import Record

pytestmark = pytest.mark.slow(minutes=1)

NASTY = Path(planners_that_fail.__file__)
GOOD = ["rrtconnect", "rrtconnect:range=2"]
SAME = ["planner", "problem", "status", "verdict", "outcome", "length", "path"]

MEANING = {"C": "CRASH", "K": "KILLED", "M": "OUT_OF_MEMORY", ".": "LEFT_RUNNING"}
OUTCOMES = [MEANING[letter] for letter in "C.MC.KC.MCK.C.M"]
"""Of the nasty planner's problems, where one leak fits into the memory limit and two do not: each
fault gives the next problem a new process. They begin again after these fifteen."""

RUN = [
    *("run", "--env", "c3d", "--problems", len(OUTCOMES), "--jobs", 2, "--stop", "first"),
    *("--planner-file", NASTY, "--time-limit", 0.5, "--memory-limit", 280),
]


def test_beside_a_nasty_planner_the_others_lose_nothing_and_nothing_stays(
    bench: Cli,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    new_children: Callable[[], list[psutil.Process]],
) -> None:
    # Two at a time, also where there is one core: how fast planners are does not matter here.
    monkeypatch.setattr("envs.processors.physical_cores", lambda: 2)
    current, temporary = tmp_path / "current", tmp_path / "temporary"
    current.mkdir()
    temporary.mkdir()
    monkeypatch.chdir(current)
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", None)
    alone, together = tmp_path / "alone", tmp_path / "together"
    assert bench(*RUN, "--planners", ",".join(GOOD), "--out", alone)[0] == 0
    held = held_by_this_process()
    code, _, err = bench(*RUN, "--planners", ",".join([*GOOD, "nasty"]), "--out", together)
    assert code == 0, err
    assert held_by_this_process() == held
    assert not new_children()
    assert not processes_in(current), "helpers of the planner that its process left behind"
    assert not list(Path("/dev/shm").glob(f"nasty-{os.getpid()}-*"))
    assert not list(temporary.iterdir())
    records = records_of(together)
    nasty = records["planner"] == "nasty"
    assert records["outcome"][nasty].tolist() == OUTCOMES
    pd.testing.assert_frame_equal(
        records.loc[~nasty, SAME].reset_index(drop=True), records_of(alone)[SAME]
    )


def held_by_this_process() -> tuple[int, int]:
    """How many file descriptors and threads."""
    return psutil.Process().num_fds(), threading.active_count()


def processes_in(folder: Path) -> list[psutil.Process]:
    """Those that run in a folder, but for this one."""
    running = psutil.process_iter(["cwd"])
    return [p for p in running if p.info["cwd"] == str(folder) and p.pid != os.getpid()]


def test_what_the_harness_holds_does_not_grow_with_attempts_and_restarts(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problems, early = 100, 20
    held = {}

    class Watching(Progress):
        def add(self, record: Record) -> None:
            if not tracemalloc.is_tracing():  # not before: it slows all that begins a run
                tracemalloc.start()
            super().add(record)
            if record.problem + 1 in (early, problems):
                gc.collect()
                sys._clear_type_cache()  # holds names, some thousands at most
                held[record.problem + 1], _ = tracemalloc.get_traced_memory()

    monkeypatch.setattr("bench.execution.runner.Progress", Watching)
    try:
        code, _, err = bench(
            *("run", "--env", "c3d", "--planners", "nasty:crash=20,hang=1000,leak_mb=1"),
            *("--planner-file", NASTY, "--problems", problems, "--stop", "first"),
            *("--out", tmp_path),
        )
    finally:
        tracemalloc.stop()
    assert code == 0, err
    assert (records_of(tmp_path)["outcome"] == "CRASH").sum() == problems // 20
    assert held[problems] - held[early] < 200 * (problems - early), "bytes; a row takes about 900"
