"""What was asked for: who runs as a reference, on what device, in which worlds."""

from __future__ import annotations

import functools
import json
import logging
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import told_planners
from conftest import Cli, records_of

import planners
from bench.execution.config import RunConfig, make_run_config, on_device
from bench.execution.session import Costs, Session
from bench.judging.judge import Judge
from envs import Environment
from envs.scenes.cluttered import Cluttered3D


@pytest.fixture(autouse=True)
def told() -> Iterator[None]:
    for spec in told_planners.SPECS:
        planners.REGISTRY.register(spec)
    yield
    for spec in told_planners.SPECS:
        planners.REGISTRY.unregister(spec.id)


def config(**asked: Any) -> RunConfig:
    return make_run_config(
        **{
            "env": "c3d:boxes=3",
            "problems": 1,
            "seed": 0,
            "time_limit_s": 1.0,
            "stop": "paper",
            "jobs": 1,
            "memory_limit_mb": 1000,
            **asked,
        }
    )


@pytest.mark.parametrize("stop", ["paper", "match:fmm", "match:mpnet"])
@pytest.mark.parametrize("chosen", ["rrtconnect", "fmt", "rrtconnect,fmt", "rrtconnect,unsuited"])
def test_no_reference_runs_where_nobody_would_improve(
    chosen: str, stop: str, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        assert [p.id for p in config(planner=chosen, stop=stop).planners] == chosen.split(",")
    assert not caplog.records


@pytest.mark.parametrize("chosen", ["rrtstar", "bitstar", "prmstar", "rrtconnect,aitstar"])
def test_a_reference_runs_where_somebody_may_improve(chosen: str) -> None:
    assert [p.id for p in config(planner=chosen).planners] == ["fmm", *chosen.split(",")]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_the_device_is_a_setting(
    bench: Cli, faulty: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bench.execution.config.checked_device", lambda name: name)
    counted = tmp_path / "count"
    monkeypatch.setenv("COUNT_FILE", str(counted))
    run = ("run", "--env", "c3d:boxes=1", "--problems", 3, "--out", tmp_path / "run")
    run = (*run, "--stop", "match:tells-device", "--planners", "counts")
    assert bench(*run, "--device", "cuda:1")[0] == 0
    records = records_of(tmp_path / "run")
    assert records["planner"].tolist() == 3 * ["tells-device"] + 3 * ["counts"]
    assert [json.loads(stats) for stats in records["stats"][:3]] == 3 * [{"device": "cuda:1"}]
    solved = records["solved"][:3].astype(bool).tolist()
    assert any(solved)
    costs = [float(line.split()[1]) for line in counted.read_text().split("\n")[1:-1]]
    assert [cost > 0 for cost in costs] == solved, "the reference sets the length to match"
    counted.write_text("")
    assert bench(*run, "--device", "cuda:1")[0] == 0
    assert counted.read_text() == "", "nothing is measured twice"
    assert bench(*run)[0] == 0
    assert json.loads(records_of(tmp_path / "run")["stats"][0]) == {"device": "cpu"}


def test_settings_say_of_a_device_only_where_it_is_not_the_cpu(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So that what was measured by the same rules before there was a choice still counts."""
    monkeypatch.setattr("bench.execution.config.RULES", 1)
    assert "device" not in config(planner="fmm").settings
    assert config(planner="fmm", stop="first").settings_digest == "e0039692aae4"


def test_a_planner_keeps_the_device_that_it_was_given() -> None:
    def made(text: str, device: str) -> Any:
        return on_device(planners.REGISTRY.entry(text), device).arguments

    assert made("tells-device", "cuda") == {"device": "cuda"}
    assert made("tells-device:device=cuda:1", "cuda") == {"device": "cuda:1"}
    assert made("tells-device", "cpu") == {}
    assert made("fmm", "cuda") == {}
    assert made("mpnet", "cuda") == {"device": "cuda"}


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "most"), [(1, 2), (2, 3)])
def test_a_world_is_made_once_for_each_use_and_the_judges_is_shown_to_no_planner(
    jobs: int, most: int, bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("envs.processors.physical_cores", lambda: 2)
    made: list[Environment] = []
    shown: list[Environment] = []
    judged: list[Environment] = []
    make, judge = Cluttered3D.__init__, Judge.__init__

    @functools.wraps(make)
    def counting(self: Cluttered3D, *given: Any, **named: Any) -> None:
        make(self, *given, **named)
        made.append(self)

    def watching(self: Judge, env: Environment, *given: Any) -> None:
        judged.append(env)
        judge(self, env, *given)

    def asked(self: object, env: Environment) -> None:
        shown.append(env)

    monkeypatch.setattr(Cluttered3D, "__init__", counting)
    monkeypatch.setattr(Judge, "__init__", watching)
    monkeypatch.setattr(told_planners.TellsDevice, "unsupported", asked)
    chosen = "tells-device,rrtconnect,rrtconnect:range=2,rrtstar"
    run = ("run", "--env", "c3d:boxes=1", "--planners", chosen, "--problems", 1, "--jobs", jobs)
    assert bench(*run, "--stop", "first", "--out", tmp_path)[0] == 0
    assert len(made) == most
    assert len({id(env) for env in judged}) == jobs
    assert len({id(env) for env in shown}) == 1
    assert not {id(env) for env in judged} & {id(env) for env in shown}


def test_no_cost_is_lost_among_threads() -> None:
    session = Session()

    def spend() -> None:
        for _ in range(500):
            session.add(Costs(1, setup_s=0.5))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        many = [
            threading.Thread(
                target=lambda: [session.add(Costs(1, setup_s=0.5)) for _ in range(500)]
            )
            for _ in range(8)
        ]
        for thread in many:
            thread.start()
        for thread in many:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert session.costs == Costs(attempts=4000, setup_s=2000.0)
