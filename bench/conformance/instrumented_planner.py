"""A planner with measuring instruments about it, in the worker's process."""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np
import psutil

from bench.execution.worker import Claim, in_memory
from envs import Environment, Path, Problem
from envs.errors import reason
from envs.plain_scene import PlainScene
from envs.problem import Array
from envs.registry import Entry
from planners import Budget, Planner, PlannerResult, Status

PROBED = "probe"
"""The key in `PlannerResult.stats` under which what was seen is kept."""

_PROBES = 64  # configurations at which clearances are compared


class Probe(Planner):
    """Passes everything on to a planner, and notes what it does.

    Args:
        described: the planner; see `Entry.description`.
    """

    def __init__(self, described: Mapping[str, Any]) -> None:
        self._threads = _threads()
        self._variables = _thread_variables()
        self._planner: Planner = Entry.described(described).make()
        self.plans_from_data = self._planner.plans_from_data
        self.interpreter = self._planner.interpreter
        self._support = ""
        of_data = self.plans_from_data
        self._surroundings_of: Callable[[Any], _Surroundings] = (
            _Surroundings.of_data if of_data else _Surroundings.of
        )

    def unsupported(self, env: Environment) -> str | None:
        try:
            answer = self._planner.unsupported(env)
        except Exception as error:  # noqa: BLE001  a planner may fail in any way
            self._support = f"`unsupported` raised {reason(error)}"
            return None
        if answer is not None and (not isinstance(answer, str) or not answer.strip()):
            self._support = f"`unsupported` gave {answer!r}, which is neither None nor a reason"
            return None
        return answer

    def setup(self, env: Environment, *, seed: int) -> None:
        self._look = partial(self._surroundings_of, env)
        self._before = self._look()
        self._planner.setup(env, seed=seed)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ends = problem.start.copy(), problem.goal.copy()
        begin, used = perf_counter(), process_time()
        result = self._planner.solve(problem, budget)
        claim = _claim(result)
        spent, used = perf_counter() - begin, process_time() - used
        changes = self._before.changes(self._look())
        same = (
            np.array_equal(e, q) for e, q in zip(ends, (problem.start, problem.goal), strict=True)
        )
        if not all(same):
            changes.append("the problem's start or goal")
        seen = {
            "solve_s": spent,
            "cpu_s": used,
            "support": self._support,
            "result": complaints(result, claim),
            "changed": changes,
            "threads": self._pinned(),
        }
        return PlannerResult(_status(result), claim and claim.path, {PROBED: seen})

    def _pinned(self) -> dict[str, Any]:
        """How many threads there are more than before the planner was made, and what libraries
        may start."""
        changed = _thread_variables().items() ^ self._variables.items()
        torch: Any = sys.modules.get("torch")
        return {
            "more": _threads() - self._threads,
            "variables": sorted({name for name, _ in changed}),
            "torch": torch.get_num_threads() if torch else 1,
        }


def _claim(result: Any) -> Claim | None:
    """The result in memory, on the planner's clock; None if it is too far from being one."""
    try:
        return in_memory(result)
    except (AttributeError, TypeError, ValueError):
        return None


def complaints(result: Any, claim: Claim | None) -> list[str]:
    """What is wrong with the form of what a planner returned; nothing if it keeps to
    `PlannerResult`.

    Args:
        claim: the same in memory, if that can be.
    """
    if not isinstance(result, PlannerResult):
        return [f"`solve` returned a {type(result).__name__}, not a PlannerResult"]
    found = []
    if not isinstance(result.status, Status):
        found.append(f"the status {result.status!r} is no planners.Status")
    if result.path is not None:
        found += _of_path(claim)
    elif result.status == Status.EXACT_SOLUTION:
        found.append("it claims EXACT_SOLUTION without a path")
    try:
        json.dumps(result.stats)
    except (TypeError, ValueError, RecursionError) as error:
        found.append(f"`stats` is not JSON data: {error}")
    if not isinstance(result.stats, dict):
        found.append(f"`stats` is a {type(result.stats).__name__}, not a dict")
    return found


def _of_path(claim: Claim | None) -> list[str]:
    if claim is None or claim.path is None:
        return list(claim.notes[:1]) if claim else []
    try:
        Path(claim.path)
    except (TypeError, ValueError) as error:
        return [f"its path is none: {error}"]
    return []


def _status(result: Any) -> Status:
    try:
        return Status(result.status)
    except (AttributeError, ValueError):
        return Status.TIMEOUT


@dataclass(frozen=True)
class _Surroundings:
    """What a planner could change of its environment: its clearances, or plain data."""

    fingerprint: str
    numbers: Array

    @staticmethod
    def of(env: Environment) -> _Surroundings:
        # No generator of numpy's global state, which the planner may use.
        q = env.space.sample(np.random.default_rng(0), _PROBES)
        return _Surroundings(env.fingerprint, env.clearance(q))

    @staticmethod
    def of_data(scene: PlainScene) -> _Surroundings:
        _, numbers = scene.packed()
        return _Surroundings(scene.fingerprint, numbers)

    def changes(self, now: _Surroundings) -> list[str]:
        found = []
        if now.fingerprint != self.fingerprint:
            found.append("the environment's definition")
        if not np.array_equal(now.numbers, self.numbers):
            found.append("the environment's clearances")
        return found


def _threads() -> int:
    return max(psutil.Process().num_threads(), threading.active_count())


def _thread_variables() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name.endswith("_THREADS")}
