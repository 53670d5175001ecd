"""Worker processes, asked directly."""

from __future__ import annotations

import math
from collections.abc import Callable

import planners_that_fail
import psutil
import pytest

import envs
import planners
from bench.execution import process_group
from bench.execution.planner_queries import World
from bench.execution.worker_process import WorkerProcess
from bench.storage.record import Fault
from envs import Environment


def worker(env: Environment, planner: str, memory_limit_mb: int = 4096) -> WorkerProcess:
    world = World(envs.REGISTRY.entry("c3d"), env)
    return WorkerProcess(world, planners.REGISTRY.entry(planner), memory_limit_mb)


@pytest.mark.parametrize("planner", ["fmm:resolution=30", "rrtstar", "prmstar", "eitstar"])
def test_a_worker_ends_of_itself_with_exit_code_0(planner: str, c3d: Environment) -> None:
    asked = worker(c3d, planner)
    assert not asked.set_up(1, 60).fault
    for problem in c3d.sample_problems(2, 0):
        assert asked.solve(problem, 5, math.inf).status == "EXACT_SOLUTION"
    asked.close()
    assert asked.exit_code == 0
    assert not asked.alive
    asked.close()  # again is no error


def test_one_that_hangs_is_gone_at_once(
    c3d: Environment, faulty: list[str], new_children: Callable[[], list[psutil.Process]]
) -> None:
    asked = worker(c3d, "hangs-in-c")
    assert not asked.set_up(1, 60).fault
    [problem] = c3d.sample_problems(1, 0)
    attempt = asked.solve(problem, 0.1, math.inf)
    assert attempt.status == Fault.KILLED.value
    assert attempt.solve_s is not None
    assert 1.0 < attempt.solve_s < 4.0
    assert not asked.alive
    assert not new_children()


@pytest.mark.slow
def test_what_it_leaves_behind_is_killed_off_the_clock(c3d: Environment, faulty: list[str]) -> None:
    asked = worker(c3d, "leaves-stubborn-child")
    assert not asked.set_up(1, 60).fault
    attempt = asked.solve(c3d.sample_problems(1, 0)[0], 5, math.inf)
    assert attempt.status == Fault.CRASH.value
    assert attempt.solve_s is not None
    assert attempt.solve_s < 1.5, "its child was given 2 s to end"
    assert not planners_that_fail.children_left()


@pytest.mark.slow
def test_one_that_leaves_no_memory_at_all_is_told_apart_from_a_crash(
    c3d: Environment, faulty: list[str]
) -> None:
    asked = worker(c3d, "eats-all-memory", 700)
    assert not asked.set_up(1, 60).fault
    attempt = asked.solve(c3d.sample_problems(1, 0)[0], 30, math.inf)
    assert attempt.status == Fault.OUT_OF_MEMORY.value, attempt.error
    assert not asked.alive


@pytest.mark.slow
def test_a_group_is_ended_before_its_number_is_free(
    c3d: Environment, faulty: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []
    true = process_group.end

    def end(group: int) -> None:
        seen.append(psutil.Process(group).status())
        true(group)

    monkeypatch.setattr(process_group, "end", end)
    [problem] = c3d.sample_problems(1, 0)
    for name in ("exits", "hangs-in-c", "straight"):
        asked = worker(c3d, name)
        assert not asked.set_up(1, 60).fault
        asked.solve(problem, 0.1, math.inf)
        asked.close()
        assert asked.exit_code is not None
    assert seen == [psutil.STATUS_ZOMBIE] * 3, "another process may get the number of one reaped"


def test_one_that_never_solved_anything_ends_too(
    c3d: Environment, new_children: Callable[[], list[psutil.Process]]
) -> None:
    idle = worker(c3d, "rrtconnect")
    idle.close()
    assert not new_children()


@pytest.mark.slow
def test_threads_are_pinned_to_one(c3d: Environment, faulty: list[str]) -> None:
    asked = worker(c3d, "tells-threads")
    assert not asked.set_up(1, 60).fault
    attempt = asked.solve(c3d.sample_problems(1, 0)[0], 60, math.inf)
    asked.close()
    assert set(attempt.stats["threads"].values()) == {"1"}
    assert len(attempt.stats["threads"]) >= 5
    assert attempt.stats["torch"] == 1
