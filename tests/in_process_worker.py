"""A worker without a process, for tests of what a run does with its answers.

Starting a process and importing a planner takes seconds, planning milliseconds. Nothing here is
killed, limited, watched or confined to processors: tests of that have real workers.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter, process_time

import pytest

from bench.execution import supervised_planner
from bench.execution.answers import Attempt, SetUp
from bench.execution.planner_queries import World
from bench.execution.worker import in_memory
from bench.storage.record import Fault
from envs import Environment, Problem
from envs.registry import Entry
from planners import Budget, Planner


class InProcessWorker:
    """Takes the place of `WorkerProcess`.

    Args:
        world: whose environment is made again here, as in a process.
        planner: is made again here.
        memory_limit_mb: is not enforced.
    """

    def __init__(self, world: World, planner: Entry[Planner], memory_limit_mb: int) -> None:
        self._env, self._entry = world.entry, planner
        self._fingerprint = world.env.fingerprint
        self._planner: Planner | None = None
        self._world: Environment | None = None
        self._scene: Environment | None = None

    def set_up(self, seed: int, limit_s: float) -> SetUp:
        env = self._env.make()
        assert env.fingerprint == self._fingerprint
        begin = perf_counter()
        planner = self._entry.make()
        reason = planner.unsupported(env)
        if reason is not None:
            return SetUp(Fault.UNSUPPORTED.value, reason, perf_counter() - begin)
        planner.setup(env, seed=seed)
        self._planner, self._world, self._scene = planner, env, env
        return SetUp("", "", perf_counter() - begin, float(planner.train_s))

    def set_scene(self, problem: Problem, limit_s: float) -> SetUp:
        assert self._planner is not None
        assert self._world is not None
        scene, begin = self._world.scene_of(problem), perf_counter()
        if scene is not self._scene:
            self._planner.set_scene(scene)
        self._scene = scene
        return SetUp("", "", perf_counter() - begin)

    def solve(
        self, problem: Problem, time_limit_s: float, stop_cost: float, grace_s: float = 0.0
    ) -> Attempt:
        assert self._planner is not None
        begin, cpu = perf_counter(), process_time()
        budget = Budget(begin + time_limit_s, stop_cost)
        try:
            claim = in_memory(self._planner.solve(problem, budget))
        except Exception as error:  # noqa: BLE001  a planner may fail in any way
            return Attempt(Fault.ERROR.value, perf_counter() - begin, error=repr(error))
        return Attempt(
            claim.status,
            perf_counter() - begin,
            claim.path,
            "\n".join(claim.notes),
            json.loads(claim.stats),
            peak_memory_mb=0.0,
            cpu_s=process_time() - cpu,
            load=0.0,
            attempt_memory_mb=0.0,
        )

    @property
    def pid(self) -> int:
        return os.getpid()

    @property
    def alive(self) -> bool:
        return self._planner is not None

    def close(self) -> None:
        self._planner = None


@contextmanager
def in_process() -> Iterator[None]:
    """As long as the context lasts, planners plan in this process."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(supervised_planner, "WorkerProcess", InProcessWorker)
        yield
