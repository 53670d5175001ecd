"""Several planners at a time: each on cores of its own, with a judge of its own."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import told_planners
from conftest import Cli, records_of

import planners
from bench.execution import machine
from bench.judging.judge import Judge, Judgement
from envs import processors

RUN = ("run", "--env", "c3d:boxes=1", "--stop", "first", "--jobs", 2)

can_confine = pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity") or len(processors.usable_cores()) < 2,
    reason="needs two cores, and a system that confines processes to them",
)


@pytest.fixture(autouse=True)
def told(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr("envs.processors.physical_cores", lambda: 2)
    for spec in told_planners.SPECS:
        planners.REGISTRY.register(spec)
    yield
    for spec in told_planners.SPECS:
        planners.REGISTRY.unregister(spec.id)


@pytest.mark.parametrize(
    ("cores", "jobs", "shares"),
    [
        ([(0,), (1,)], 1, [()]),
        ([(0,), (1,)], 2, [(0,), (1,)]),
        ([(0, 4), (1, 5), (2, 6), (3, 7)], 2, [(0, 4, 1, 5), (2, 6, 3, 7)]),
        ([(0, 4), (1, 5), (2, 6), (3, 7)], 3, [(0, 4), (1, 5), (2, 6)]),
        ([(0,)], 2, [(), ()]),
    ],
)
def test_cores_are_divided_equally(
    cores: list[tuple[int, ...]],
    jobs: int,
    shares: list[tuple[int, ...]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("envs.processors.usable_cores", lambda: cores)
    assert machine.shares(jobs) == shares


def test_the_cores_are_those_that_this_process_may_use() -> None:
    cores = processors.usable_cores()
    assert sorted(cpu for core in cores for cpu in core) == processors.usable_cpus()


@pytest.mark.slow
def test_judges_do_not_wait_for_each_other(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each verdict waits until the other planner's path is being judged too."""
    both = threading.Barrier(2)
    judge = Judge.__call__

    def together(self: Judge, *given: Any) -> Judgement:
        both.wait(timeout=60)
        return judge(self, *given)

    monkeypatch.setattr(Judge, "__call__", together)
    chosen = ("--planners", "tells-device,tells-device:device=other", "--problems", 12)
    code, _, err = bench(*RUN, *chosen, "--out", tmp_path)
    assert code == 0, err
    assert len(records_of(tmp_path)) == 24


@pytest.mark.slow
@can_confine
def test_planner_and_judge_of_a_slot_share_cores_that_no_other_uses(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = os.sched_getaffinity(0)
    judge = Judge.__call__
    judged_on: dict[float, list[int]] = {}

    def watched(self: Judge, problem: Any, path: Any) -> Judgement:
        judged_on[path[0, 0]] = sorted(os.sched_getaffinity(0))
        return judge(self, problem, path)

    monkeypatch.setattr(Judge, "__call__", watched)
    chosen = ("--planners", "tells-processors,rrtconnect,rrtconnect:range=2", "--problems", 25)
    code, _, err = bench(*RUN, *chosen, "--out", tmp_path)
    assert code == 0, err
    assert os.sched_getaffinity(0) == before
    shares = [list(share) for share in machine.shares(2)]
    records = records_of(tmp_path)
    own = records[records["planner"] == "tells-processors"]
    for stats in own["stats"]:
        threads = json.loads(stats)["mine"]
        assert len(threads) > 1
        assert all(thread == threads[0] for thread in threads)
        assert threads[0] in shares
    assert all(on in shares for on in judged_on.values())


@can_confine
def test_one_at_a_time_may_use_every_core(bench: Cli, tmp_path: Path) -> None:
    chosen = ("--planners", "tells-processors", "--problems", 1)
    assert bench(*RUN[:-1], 1, *chosen, "--out", tmp_path)[0] == 0
    threads = json.loads(records_of(tmp_path)["stats"][0])["mine"]
    assert all(thread == sorted(os.sched_getaffinity(0)) for thread in threads)
