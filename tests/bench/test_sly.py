"""Work off the clock, things left running, what cannot be kept: told from a worker's answers."""

from __future__ import annotations

import json
import math
import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import pytest
import sly_planners
from conftest import Cli, records_of
from sly_planners import WORK_S

import envs
import planners
from bench.execution.planner_queries import World
from bench.execution.worker_process import Attempt, WorkerProcess
from bench.storage.record import COLUMNS, Fault, Record, encode_path
from bench.storage.store import Store
from envs import Environment, Problem, Spec
from envs.registry import Entry
from planners import Planner


@contextmanager
def worker(env: Environment, planner: type[Planner]) -> Iterator[WorkerProcess]:
    spec = Spec("sly", f"sly_planners:{planner.__name__}", "")
    asked = WorkerProcess(World(envs.REGISTRY.entry("c3d"), env), Entry(spec, {}), 4096)
    try:
        set_up = asked.set_up(1, 60)
        assert not set_up.fault, set_up.error
        yield asked
    finally:
        asked.close()


def problem(index: int) -> Problem:
    return Problem(np.zeros(3), np.ones(3), index, 1)


def solve(asked: WorkerProcess, index: int, limit_s: float = 30.0) -> Attempt:
    return asked.solve(problem(index), limit_s, math.inf)


@pytest.mark.slow
def test_the_clock_runs_until_the_path_is_numbers_in_memory(c3d: Environment) -> None:
    with worker(c3d, sly_planners.Lazy) as asked:
        for i in range(len(sly_planners.Lazy.HOW)):
            attempt = solve(asked, i)
            assert attempt.status == "EXACT_SOLUTION", (i, attempt.error)
            assert attempt.path is not None
            assert attempt.path.tolist() == [[0, 0, 0], [1, 1, 1]], i
            assert attempt.solve_s is not None
            assert attempt.solve_s >= WORK_S, f"way {i} of being lazy is off the clock"


def test_a_lazy_path_that_takes_too_long_is_killed_like_any_other(c3d: Environment) -> None:
    with worker(c3d, sly_planners.HangsWhenRead) as asked:
        attempt = solve(asked, 0, 0.1)
        assert attempt.status == Fault.KILLED.value
        assert "__array__" in attempt.error


@pytest.mark.slow
def test_what_is_left_running_is_named_and_the_planners_fault(
    c3d: Environment, new_children: Callable[[], list[psutil.Process]]
) -> None:
    left = list(range(len(sly_planners.LeavesRunning.HOW)))
    while left:  # a process in which something works on is not asked again
        with worker(c3d, sly_planners.LeavesRunning) as asked:
            while asked.alive and left:
                how = left.pop(0)
                attempt = solve(asked, how)
                assert attempt.status == Fault.LEFT_RUNNING.value, (how, attempt)
                assert sly_planners.LeavesRunning.NAMED[how] in attempt.error
                assert attempt.solve_s is not None
                assert attempt.solve_s < WORK_S
                assert attempt.path is None
                assert asked.alive == (how in sly_planners.LeavesRunning.AT_REST)
    assert not new_children()
    assert not sly_planners.helpers_left(), "also those in sessions of their own"


@pytest.mark.slow
def test_pools_libraries_and_what_is_waited_for_are_no_fault(c3d: Environment) -> None:
    with worker(c3d, sly_planners.KeepsPools) as asked:
        for again in range(2):
            for i in range(len(sly_planners.KeepsPools.HOW)):
                attempt = solve(asked, i, 120)
                assert attempt.status == "EXACT_SOLUTION", (again, i, attempt.error)


@pytest.mark.slow
def test_what_cannot_be_kept_is_left_out_with_a_note(c3d: Environment) -> None:
    unkept = sly_planners.Unkept
    with worker(c3d, unkept) as asked:
        for i in range(len(unkept.HOW)):
            attempt = solve(asked, i, 60)
            wanted = "ERROR" if i in unkept.ERROR else "EXACT_SOLUTION"
            assert attempt.status == wanted, (i, attempt.error[-300:])
            _check_storable(attempt)
            assert bool(attempt.error) == (i not in (15, 16, 17, 18, 20)), (i, attempt.error)
            if i in range(14):
                assert (attempt.path is None) == (i in unkept.ERROR)
    with worker(c3d, sly_planners.DiesOfAnUnnamedSignal) as asked:
        assert "died of signal 40" in solve(asked, 0).error


@pytest.mark.slow
def test_every_such_answer_is_a_row_and_reports_survive_it(bench: Cli, tmp_path: Path) -> None:
    unkept = sly_planners.Unkept
    spec = Spec("unkept", "sly_planners:Unkept", "returns what cannot be kept")
    planners.REGISTRY.register(spec)
    try:
        code, _, err = bench(
            *("run", "--env", "c3d", "--planners", "unkept,rrtconnect", "--stop", "first"),
            *("--problems", len(unkept.HOW), "--time-limit", 30, "--out", tmp_path),
        )
        assert code == 0, err
        with Store(tmp_path) as store:  # as one was stored before such were refused
            [row] = store._rows(f"SELECT {', '.join(COLUMNS)} FROM records WHERE solved LIMIT 1")
            old = dict(zip(COLUMNS, row, strict=True)) | {"stats": '{"cost_history": [[1], "x"]}'}
            store.put(Record(**old))
        formats = "md,csv,latex,html,planner-arena"
        code, _, err = bench("report", tmp_path, "--format", formats, "--out", tmp_path / "report")
        assert code == 0, err
    finally:
        planners.REGISTRY.unregister("unkept")
    records = records_of(tmp_path)
    of_unkept = records[records["planner"] == "unkept"].set_index("problem")["status"]
    assert of_unkept.index.tolist() == list(range(len(unkept.HOW)))
    assert of_unkept[list(unkept.ERROR)].eq("ERROR").all()
    assert (records["outcome"][records["planner"] == "rrtconnect"] == "VALID").all()


def _check_storable(attempt: Attempt) -> None:
    checks = attempt.stats.get("collision_checks")
    row = (attempt.error, json.dumps(attempt.stats), checks, encode_path(attempt.path))
    with sqlite3.connect(":memory:") as store:
        [told] = store.execute("SELECT ?1, ?2, ?3, ?4", row)
    assert told == row
    assert len(attempt.error) < 30_000


@pytest.mark.slow
def test_a_worker_may_say_no_time_but_the_harnesss(c3d: Environment) -> None:
    with worker(c3d, sly_planners.SpeaksWrongly) as asked:
        for i, said in enumerate(sly_planners.SpeaksWrongly.SAYS):
            attempt = solve(asked, i)
            assert attempt.status == "EXACT_SOLUTION", attempt
            assert attempt.solve_s is not None
            assert 0.7 * WORK_S <= attempt.solve_s < 5, said
            assert "it said that it took" in attempt.error


@pytest.mark.slow
def test_costs_are_the_attempts_own(c3d: Environment) -> None:
    with worker(c3d, sly_planners.TakesLong) as asked:
        solve(asked, 4)
        in_process, in_child, asleep, large, small = (solve(asked, i) for i in range(5))
    for attempt in (in_process, in_child, asleep, large, small):
        assert attempt.cpu_s is not None
        assert attempt.solve_s is not None
    assert 0.05 < in_process.cpu_s <= 1.1 * in_process.solve_s
    assert in_child.cpu_s > 0.05
    assert asleep.cpu_s < 0.05
    if Path("/proc/self/clear_refs").exists():
        assert large.attempt_memory_mb == pytest.approx(128, abs=10)
        assert small.attempt_memory_mb < 10
        assert small.peak_memory_mb < large.peak_memory_mb - 100
        assert asleep.load is not None
        assert 0 <= asleep.load <= (os.cpu_count() or 1) + 0.2
        assert small.load is None, "too short to tell"
