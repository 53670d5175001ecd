"""Runs that are killed, and two in one folder: nothing is lost, nothing measured twice."""

from __future__ import annotations

import random
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import forked_bench
import psutil
import pytest
from conftest import Cli, Refused, records_of

from bench.storage.store import locked

KILLS = 50
PROBLEMS = 3000
"""More than are measured between the kills."""


def run(folder: Path, problems: int) -> list[str]:
    return [
        *("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", str(problems)),
        *("--stop", "first", "--seed", "3", "--out", str(folder)),
    ]


def rows(folder: Path) -> list[tuple[int, str, str, bytes]]:
    """What the store holds, after its pages were checked; nothing where there is none yet."""
    if not (folder / "run.sqlite").exists():
        return []
    with closing(sqlite3.connect(folder / "run.sqlite")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        if not connection.execute("SELECT 1 FROM sqlite_master").fetchall():
            return []
        return connection.execute(
            "SELECT problem, measured_at, outcome, path FROM records ORDER BY problem"
        ).fetchall()


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose run was killed at many moments, the first ones while it began."""
    folder = tmp_path_factory.mktemp("killed")
    moments = random.Random(1)
    known: dict[int, tuple[int, str, str, bytes]] = {}
    for kill in range(KILLS):
        process = (_begin if kill < 10 else _go_on)(run(folder, PROBLEMS))
        try:
            if kill >= 10:
                _wait_for_rows(folder, len(known))
            time.sleep(moments.uniform(0, 3.0 if kill < 10 else 0.2))
        finally:
            children = process.children(recursive=True)
            process.kill()
            process.wait()
        _wait_for_end(children)
        found = {row[0]: row for row in rows(folder)}
        assert known.items() <= found.items(), "what was committed is lost or measured again"
        known = found
    assert len(known) > KILLS, "it was killed while it measured"
    return folder


def _begin(arguments: list[str]) -> psutil.Process:
    """A run that is killed while it begins, imports included."""
    nowhere = subprocess.DEVNULL
    return psutil.Popen([sys.executable, "-m", "bench", *arguments], stdout=nowhere, stderr=nowhere)


def _go_on(arguments: list[str]) -> psutil.Process:
    """A run that soon measures: importing takes longer than all else until then."""
    return psutil.Process(forked_bench.start(arguments).pid)


def _wait_for_end(workers: list[psutil.Process]) -> None:
    """Until they have ended, although the system's first process may still list them: it can take
    seconds to collect those whose parent is gone."""
    deadline = time.monotonic() + 5
    while any(_runs(worker) for worker in workers):
        assert time.monotonic() < deadline, "workers end with the harness"
        time.sleep(0.005)


def _runs(process: psutil.Process) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _wait_for_rows(folder: Path, began: int) -> None:
    """Until the run measures something."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if len(rows(folder)) > began:
            return
        time.sleep(0.02)
    raise AssertionError("the run does not go on")


@pytest.mark.slow(minutes=4)
def test_a_run_killed_50_times_ends_as_one_that_was_not(
    killed: Path, bench: Cli, tmp_path: Path
) -> None:
    before = rows(killed)
    problems = before[-1][0] + 5
    assert bench(*run(killed, problems))[0] == 0
    assert bench(*run(tmp_path, problems))[0] == 0
    after, whole = records_of(killed), records_of(tmp_path)
    same = ["problem", "status", "verdict", "outcome", "length", "path"]
    assert after[same].equals(whole[same])
    kept = dict(zip(after["problem"], after["measured_at"], strict=True))
    assert all(kept[problem] == measured_at for problem, measured_at, *_ in before)


def test_only_one_run_at_a_time_writes_to_a_folder(refused: Refused, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with locked(folder):
        said = refused(*run(folder, 2))
    assert "another run is writing to" in said
    assert not list(folder.iterdir())
    with locked(folder):
        pass  # it is free again


def test_a_file_is_no_folder_for_runs(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    assert "cannot use" in refused(*run(tmp_path / "file", 2))
    assert (tmp_path / "file").read_text() == "mine"
