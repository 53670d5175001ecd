"""`bench test-planner`: each bad planner fails the check that it should, and no other."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import planners_that_fail
import pytest
import torch
from conftest import Cli, Refused

import envs
import planners
from bench import conformance
from bench.conformance import Outcome, trials
from bench.execution import protocol, worker
from bench.execution.planner_queries import World
from bench.execution.worker_process import Attempt, SetUp
from bench.storage.record import Fault
from envs import Problem
from envs.free_space import GridComponents
from envs.registry import Entry
from envs.scenes.point_world import PointWorld
from planners import Planner

FILE = Path(planners_that_fail.__file__)
LIMIT_S = 0.5


class Here:
    """What a worker does, in this process: starting one for every bad planner would take long."""

    def __init__(self, world: World, planner: Entry[Planner]) -> None:
        self._request = {
            "env": world.entry.description,
            "planner": planner.description,
            "fingerprint": world.env.fingerprint,
        }
        self.alive = True

    def set_up(self, seed: int, limit_s: float) -> SetUp:
        request = {**self._request, "seed": seed}
        ready, answer = self._told_to_go(partial(worker._set_up, numbers=None), request=request)
        self._planner = None if ready is None else ready.planner
        return SetUp(answer["status"] or "", answer["error"], answer["setup_s"])

    def solve(self, problem: Problem, time_limit_s: float, stop_cost: float) -> Attempt:
        assert self._planner is not None
        asked = {**vars(problem), "time_limit_s": time_limit_s, "stop_cost": stop_cost}
        attempt = partial(worker._attempt, planner=self._planner)
        said, path = self._told_to_go(attempt, request={**asked, "hard_limit_s": 60})
        stats = json.loads(said["stats"])
        return Attempt(said["status"], said["solve_s"], path, said["error"], stats)

    def _told_to_go(self, work: Callable[..., Any], request: dict[str, Any]) -> Any:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            protocol.send(ours, {"mark": protocol.GO})
            return work(theirs, request=request)

    def close(self) -> None:
        self.alive = False


@cache
def grid(scene: str) -> GridComponents:
    world = envs.make(scene)
    return GridComponents(world.clearance, world.lower, world.upper)


@pytest.fixture(autouse=True)
def quick_and_pinned(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The grid that proves c3d's problems solvable is made once; one thread, as in workers."""
    monkeypatch.setattr(PointWorld, "_components", property(lambda world: grid("c3d")))
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def failed(name: str) -> dict[str, str]:
    """The checks that a planner of `planners_that_fail` fails, and what is said of it."""
    with conformance.resolve_planner(f"{FILE}:{name}") as planner:
        evidence = conformance.gathered(envs.REGISTRY.entry("c3d"), planner, LIMIT_S, start=Here)
    found = conformance.findings(evidence)
    assert len(found) == len(conformance.CHECKS)
    return {f.check.name: f.what for f in found if f.outcome is Outcome.FAILED}


@pytest.mark.parametrize(
    ("name", "check", "said"),
    [
        ("BadSupport", "support", "raised KeyError"),
        ("EmptyReason", "support", "neither None nor a reason"),
        ("RaisesInSetup", "setup", "no weights here"),
        ("Raises", "result", "I do not feel like planning"),
        ("Tuple", "result", "returned a tuple"),
        ("OddStats", "result", "not JSON"),
        ("NearlyThere", "endpoints", "off the goal"),
        ("Tunnels", "valid", "COLLISION"),
        pytest.param("Dawdles", "budget", "after its 0.5 s", marks=pytest.mark.slow),
        pytest.param("LazyPath", "budget", "after its 0.5 s", marks=pytest.mark.slow),
        ("AlwaysClaims", "unsolvable", "a goal within an obstacle: it claims"),
        ("WritesToProblem", "inputs", "read-only"),
        ("MovesObstacles", "inputs", "changed the environment's definition"),
        ("Chance", "repeatable", "another path"),
        ("Remembers", "repeatable", "another path"),
        pytest.param(
            *("LeavesThreads", "rest", "left running after `solve`: thread"), marks=pytest.mark.slow
        ),
        pytest.param(
            *("WorksOn", "rest", "left running after `solve`: thread"), marks=pytest.mark.slow
        ),
        ("KeepsThreads", "threads", "more threads"),
        ("UnpinsTorch", "threads", "lets PyTorch use 4 threads"),
    ],
)
def test_a_planner_with_one_fault_fails_one_check(name: str, check: str, said: str) -> None:
    found = failed(name)
    assert list(found) == [check]
    assert said in found[check]


@pytest.mark.parametrize("name", ["Faultless", "DeclaredChance"])
def test_one_without_a_fault_and_one_that_declares_its_chance_fail_none(name: str) -> None:
    assert failed(name) == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "check", "said"),
    [
        ("Hangs", "budget", "ignored its 0.5 s and was killed"),
        ("Segfault", "result", "problem 0: CRASH"),
        ("NeverGivesUp", "unsolvable", "ignored its 0.5 s"),
    ],
)
def test_it_survives_planners_that_hang_or_die(
    bench: Cli, name: str, check: str, said: str
) -> None:
    code, out, err = bench("test-planner", f"{FILE}:{name}", "--time-limit", LIMIT_S)
    assert code == 1, err
    lines = out.splitlines()
    [number] = [i for i, line in enumerate(lines) if line.startswith("failed")]
    assert lines[number].split()[1] == check
    assert said in lines[number]
    assert "why it matters" in lines[number + 1]


@pytest.mark.slow
def test_a_good_planner_passes_in_real_processes(bench: Cli) -> None:
    code, out, err = bench("test-planner", "rrtconnect:range=3", "--time-limit", LIMIT_S)
    assert code == 0, out + err
    assert [line.split()[0] for line in out.splitlines()] == ["passed"] * len(conformance.CHECKS)


def test_a_learned_planner_is_not_put_into_a_world_it_has_no_weights_for() -> None:
    entries = envs.REGISTRY.entry("c3d"), planners.REGISTRY.entry("mpnet")
    evidence = conformance.gathered(*entries, 1.0, start=Here)
    assert evidence.walled_in is None
    assert [trial.what for trial in evidence.unsolvable] == ["a goal within an obstacle"]
    assert Outcome.FAILED not in {finding.outcome for finding in conformance.findings(evidence)}


@pytest.mark.slow
def test_one_that_does_not_plan_there_is_told_apart_from_one_that_passes(bench: Cli) -> None:
    code, out, err = bench("test-planner", f"{FILE}:Unsupporting", "--time-limit", LIMIT_S)
    assert code == 2
    assert out.count("not applicable") == len(conformance.CHECKS) - 1
    assert "only plans on Sundays" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("rrtconect",), "did you mean 'rrtconnect'"),
        (("no/such.py:Mine",), "cannot read"),
        ((f"{FILE}:Chanse",), "did you mean 'Chance'"),
        ((f"{FILE}",), "has no planner ''"),
        ((f"{FILE}:_Hidden",), "has no planner '_Hidden'"),
        ((f"{FILE}:Faultless:stp=1",), "has no argument 'stp'"),
        (("no/such.py:Mine:step=1",), "cannot read"),
        (("rrtconnect", "--env", "c4d"), "did you mean 'c3d'"),
        (("rrtconnect", "--time-limit", "nan"), "--time-limit must be between"),
        (("ntfields-nosym",), "has no weights for c3d"),
    ],
)
def test_mistakes_are_one_clear_line(refused: Refused, arguments: Any, said: str) -> None:
    assert said in refused("test-planner", *arguments)


def test_the_walls_have_no_way_out() -> None:
    world, problem = trials.WalledIn(), trials.unsolvable_problem()
    model = world.collision_model()
    assert model.is_valid(problem.start)
    assert model.is_valid(problem.goal)
    parts = GridComponents(world.clearance, world.lower, world.upper)
    inside, outside = parts.label([problem.start]), parts.label([problem.goal])
    assert inside > 0
    assert outside > 0
    assert inside != outside


def test_a_fault_of_every_kind_is_judged() -> None:
    problem = Problem([0.0], [1.0])
    for fault in Fault:
        attempt = Attempt(fault.value, 0.1, error="so it is")
        trial = conformance.trials.Trial("problem 0", problem, 1.0, attempt)
        evidence = conformance.Evidence(SetUp("", "", 0.0), (trial,))
        found = conformance.findings(evidence)
        assert any(f.outcome is Outcome.FAILED for f in found), fault
