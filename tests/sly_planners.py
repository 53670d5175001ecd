"""Planners that work off the clock or return what nobody can keep, with or without malice.

Each takes what it does from the problem's index, so that a test needs one process for many.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any

import numpy as np
import psutil

from envs import Environment, Problem
from planners import Budget, Planner, PlannerResult, Status

WORK_S = 0.4
"""How long they work."""


def work(seconds: float = WORK_S) -> None:
    """Keeps a core busy; the interpreter's lock is let go of now and then."""
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        sum(range(1000))


def helpers_left() -> list[psutil.Process]:
    """Those of `LeavesRunning` that still run."""
    running = psutil.process_iter(["cmdline", "status"])
    return [p for p in running if p.info["cmdline"] in _HELPERS and p.info["status"] != "zombie"]


_HELPERS = [
    ["sleep", "98763"],
    ["sleep", "98762"],
    [sys.executable, "-c", "while True: 'left running'"],
]


class _LazyArray:
    def __init__(self, waypoints: list[Any]) -> None:
        self._waypoints = waypoints

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        work()
        return np.array(self._waypoints, dtype=dtype)


class _LazyText:
    def __str__(self) -> str:
        work()
        return "computed when it is read"


class _LazyPath:
    def __init__(self, waypoints: list[Any]) -> None:
        self._waypoints = waypoints

    @property
    def waypoints(self) -> list[Any]:
        work()
        return self._waypoints


class _LazyResult(PlannerResult):
    def __getattribute__(self, name: str) -> Any:
        if name == "status":
            work()
        return super().__getattribute__(name)


def _one_by_one(waypoints: list[Any]) -> Iterator[Any]:
    for q in waypoints:
        work(WORK_S / 2)
        yield q


class Lazy(Planner):
    """Does its work when its result is read."""

    HOW: tuple[Callable[[list[Any]], PlannerResult], ...] = (
        lambda ends: PlannerResult(Status.EXACT_SOLUTION, _LazyArray(ends)),
        lambda ends: PlannerResult(Status.EXACT_SOLUTION, [_LazyArray(q) for q in ends]),
        lambda ends: PlannerResult(Status.EXACT_SOLUTION, _one_by_one(ends)),
        lambda ends: PlannerResult(Status.EXACT_SOLUTION, _LazyPath(ends)),
        lambda ends: PlannerResult(Status.EXACT_SOLUTION, ends, {"text": _LazyText()}),
        lambda ends: _LazyResult(Status.EXACT_SOLUTION, ends),
    )

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return self.HOW[problem.index]([problem.start, problem.goal])


class LeavesRunning(Planner):
    """Returns at once, and something goes on."""

    def setup(self, env: Environment, *, seed: int) -> None:
        self._wakes = threading.Event()
        threading.Thread(target=self._improve, name="improves", daemon=True).start()
        self._pool = ThreadPoolExecutor(1)
        self._pool.submit(int).result()

    def _improve(self) -> None:
        while True:
            self._wakes.wait()
            work(0.05)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        path = np.array([problem.start, problem.goal])
        self.HOW[problem.index](self, path)
        return PlannerResult(Status.EXACT_SOLUTION, path)

    def _begin(self, target: Callable[..., Any], *arguments: Any) -> None:
        threading.Thread(target=target, args=arguments, name="begun", daemon=True).start()

    HOW = (
        lambda self, path: self._begin(time.sleep, 2.0),
        lambda self, path: subprocess.Popen(_HELPERS[0]),
        lambda self, path: os.system("sleep 98762 &"),  # its parent is gone
        lambda self, path: self._begin(work, 2.0),
        lambda self, path: subprocess.Popen(_HELPERS[2], start_new_session=True),
        lambda self, path: self._pool.submit(work, 2.0),
        lambda self, path: self._wakes.set(),
    )
    NAMED = ("begun", "98763", "98762", "begun", "left running'", "Thread", "improves")
    AT_REST = range(3)


def _square(number: int) -> int:
    return number * number


class KeepsPools(Planner):
    """Has pools that wait, and waits for what it begins."""

    def setup(self, env: Environment, *, seed: int) -> None:
        self._threads = ThreadPoolExecutor(4)
        self._processes = ProcessPoolExecutor(2, multiprocessing.get_context("fork"))
        self._old_pool = multiprocessing.get_context("fork").Pool(1)
        self._service = subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        path = [problem.start, problem.goal]
        self.HOW[problem.index](self)
        return PlannerResult(Status.EXACT_SOLUTION, path)

    def _use_torch(self) -> None:
        import torch

        torch.set_num_threads(4)
        (torch.ones(600, 600) @ torch.ones(600, 600)).sum().item()

    def _use_numba(self) -> None:
        import numba

        @numba.njit(parallel=True)
        def total(n: int) -> float:
            s = 0.0
            for i in numba.prange(n):
                s += i
            return s

        total(10_000_000)

    def _share(self) -> None:
        from multiprocessing.shared_memory import SharedMemory

        self._shared = SharedMemory(create=True, size=4096)
        self._shared.unlink()

    def _join(self) -> None:
        begun = threading.Thread(target=work, args=(0.05,))
        begun.start()
        begun.join()
        subprocess.run(["true"], check=True)

    def _ends_soon(self) -> None:
        threading.Thread(target=time.sleep, args=(0.05,)).start()

    HOW = (
        lambda self: list(self._processes.map(_square, range(4))),
        lambda self: list(self._threads.map(_square, range(4))),
        lambda self: self._old_pool.map(_square, range(4)),
        lambda self: self._share(),
        lambda self: self._join(),
        lambda self: self._ends_soon(),
        lambda self: self._use_torch(),
        lambda self: self._use_numba(),
    )


class TakesLong(Planner):
    """Uses what the clock shall count: threads and children."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self.HOW[problem.index]()
        return PlannerResult(Status.TIMEOUT)

    HOW = (
        lambda: work(0.2),
        lambda: subprocess.run([sys.executable, "-c", "sum(range(10_000_000))"], check=True),
        lambda: time.sleep(0.2),
        lambda: np.ones(2**24).sum(),  # 128 MB
        lambda: None,
    )


class Unkept(Planner):
    """Returns what cannot be stored."""

    def setup(self, env: Environment, *, seed: int) -> None:
        self._dimension = env.dimension

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ends = [problem.start, problem.goal]
        what = self.HOW[problem.index](problem)
        if isinstance(what, dict):
            return PlannerResult(Status.EXACT_SOLUTION, ends, what)
        return PlannerResult(Status.EXACT_SOLUTION, what)

    @staticmethod
    def _raise(text: str) -> Any:
        raise ValueError(text)

    HOW: tuple[Callable[[Problem], Any], ...] = (
        lambda problem: {"collision_checks": 2**70},
        lambda problem: {"collision_checks": 2**64 - 1},
        lambda problem: {"collision_checks": -1},
        lambda problem: {"cost_history": [[0.1, 3.0], [0.2]]},
        lambda problem: {"cost_history": "none"},
        lambda problem: {"cost_history": [["a", "b"]]},
        lambda problem: {(1, 2): 3},
        lambda problem: {"deep": _nested(100_000)},
        lambda problem: {"digits": 10**5000},
        lambda problem: {"fallbacks": 2**80, "text": "\ud800 \0"},
        lambda problem: {"long": "x" * 2**23},
        lambda problem: Unkept._raise("a lone surrogate \ud800, and \0"),
        lambda problem: open("/nowhere/\udcff"),  # noqa: PTH123, SIM115
        lambda problem: Unkept._raise("x" * 10**8),
        lambda problem: np.zeros((20_000_000, 3)),
        lambda problem: np.full((2, 3), 1e308),
        lambda problem: np.zeros((0, 3)),
        lambda problem: np.zeros(()),
        lambda problem: np.zeros((2, 10**6)),
        lambda problem: "a path",
        lambda problem: {},
    )

    MALFORMED = range(14, 20)
    ERROR = range(11, 14)


def _nested(depth: int) -> list[Any]:
    found: list[Any] = []
    for _ in range(depth):
        found = [found]
    return found


class SpeaksWrongly(Planner):
    """Has the worker say other times than passed, by the problem's index."""

    SAYS: tuple[Any, ...] = (-5.0, 1e9, 0.0, "soon", math.nan, 10**400)

    def setup(self, env: Environment, *, seed: int) -> None:
        import bench.execution.worker as worker

        true = worker._Timed.__exit__

        def end(timed: Any, *error: object) -> None:
            true(timed, *error)
            timed.seconds = self._says

        self._says: Any = -1.0
        worker._Timed.__exit__ = end

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self._says = self.SAYS[problem.index]
        work()
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])


class DiesOfAnUnnamedSignal(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        os.kill(os.getpid(), 40)
        raise AssertionError("not reached")


class _EndlessArray:
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        while True:
            time.sleep(0.1)


class HangsWhenRead(Planner):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return PlannerResult(Status.EXACT_SOLUTION, _EndlessArray())
