"""Workers that are killed from outside: each costs at most the problem at hand."""

from __future__ import annotations

import contextlib
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from conftest import Cli, records_of

from bench.execution.worker_process import SetUp, WorkerProcess
from bench.storage.record import Fault
from envs import InputError

KILLS, PROBLEMS = 8, 800
SAME = ["problem", "status", "verdict", "outcome", "length", "path"]


def run(folder: Path) -> list[str]:
    return [
        *("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", str(PROBLEMS)),
        *("--stop", "first", "--seed", "3", "--out", str(folder)),
    ]


@pytest.mark.slow
def test_a_killed_worker_costs_the_problem_at_hand(bench: Cli, tmp_path: Path) -> None:
    moments = random.Random(1)
    harness = subprocess.Popen(
        [sys.executable, "-m", "bench", *run(tmp_path / "killed")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _wait_until_it_measures(tmp_path / "killed")
    for _ in range(KILLS):  # some while the process is being set up again
        time.sleep(moments.uniform(0, 1))
        for worker in psutil.Process(harness.pid).children():
            worker.kill()
    assert harness.wait(timeout=120) == 0
    killed = records_of(tmp_path / "killed")
    lost = killed["outcome"] == Fault.CRASH.value
    assert 0 < lost.sum() <= KILLS
    assert killed.loc[lost, "error"].str.contains(signal.SIGKILL.name).all()
    assert bench(*run(tmp_path / "whole"))[0] == 0
    whole = records_of(tmp_path / "whole")
    assert killed["problem"].tolist() == list(range(PROBLEMS))
    assert killed.loc[~lost, SAME].equals(whole.loc[~lost, SAME])


def _wait_until_it_measures(folder: Path) -> None:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with contextlib.suppress(InputError):
            if len(records_of(folder)):
                return
        time.sleep(0.05)
    raise AssertionError("the run does not begin")


@pytest.fixture
def dies_when_set_up(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """Which set-ups, counted from 1, end in the process's death."""
    dying: set[int] = set()
    made = 0
    true = WorkerProcess.set_up

    def set_up(self: WorkerProcess, seed: int, limit_s: float) -> SetUp:
        nonlocal made
        made += 1
        if made in dying:
            self._child._process.kill()
        return true(self, seed, limit_s)

    monkeypatch.setattr(WorkerProcess, "set_up", set_up)
    return dying


@pytest.mark.slow
def test_a_first_process_that_is_killed_is_followed_by_another(
    bench: Cli, dies_when_set_up: set[int], tmp_path: Path
) -> None:
    dies_when_set_up |= {1}
    bench(*few(tmp_path))
    assert records_of(tmp_path)["outcome"].tolist() == ["VALID"] * 3


def test_a_planner_that_dies_whenever_it_is_set_up_is_given_up(
    bench: Cli, dies_when_set_up: set[int], tmp_path: Path
) -> None:
    dies_when_set_up |= {1, 2}
    bench(*few(tmp_path))
    records = records_of(tmp_path)
    assert records["outcome"].tolist() == ["CRASH"] * 3
    assert records["error"].str.startswith("setup: died of SIGKILL").all()


def few(folder: Path) -> list[str]:
    return [
        *("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", "3"),
        *("--stop", "first", "--seed", "3", "--out", str(folder)),
    ]
