"""A planner that fails in many ways in one run; for `--planner-file`."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from multiprocessing.shared_memory import SharedMemory

import numpy as np

from envs import Problem
from planners import Budget, Planner, PlannerResult, Status


class Nasty(Planner):
    """Crashes on every `crash`-th problem and hangs on every `hang`-th other one; on the rest it
    leaks `leak_mb` and claims the straight line. Each time it starts a helper and makes shared
    memory, named by the pids of harness and worker, and sees to neither's end."""

    improves = False

    def __init__(self, crash: int = 3, hang: int = 5, leak_mb: int = 100) -> None:
        self._crash, self._hang, self._leak_mb = crash, hang, leak_mb
        self._kept: list[object] = []

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        name = f"nasty-{os.getppid()}-{os.getpid()}-{len(self._kept)}"
        self._kept += [subprocess.Popen(["sleep", "98764"]), SharedMemory(name, True, 4096)]
        if problem.index % self._crash == 0:
            os.kill(os.getpid(), signal.SIGSEGV)
        if problem.index % self._hang == 0:
            time.sleep(10_000)
        self._kept.append(np.ones(self._leak_mb * 2**17))
        return PlannerResult(Status.EXACT_SOLUTION, np.array([problem.start, problem.goal]))
