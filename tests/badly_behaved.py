"""Planners that keep to the contract but for one thing, as `bench test-planner` must find.

Given to it by file too, so everything it needs is in here.
"""

from __future__ import annotations

import ctypes
import os
import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np

from envs import Environment, Problem
from planners import Budget, Planner, PlannerResult, Status
from planners.ompl.planner import OmplPlanner


class Faultless(OmplPlanner):
    """Keeps to everything."""

    def __init__(self) -> None:
        super().__init__("RRTConnect")

    def setup(self, env: Environment, *, seed: int) -> None:
        self._world = env
        super().setup(env, seed=seed)


class BadSupport(Faultless):
    def unsupported(self, env: Environment) -> str | None:
        raise KeyError("which world?")


class EmptyReason(Faultless):
    def unsupported(self, env: Environment) -> str | None:
        return False  # type: ignore[return-value]


class BadSetup(Faultless):
    def setup(self, env: Environment, *, seed: int) -> None:
        raise ValueError("no weights here")


class Raises(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        raise ValueError("I do not feel like planning")


class Dies(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ctypes.string_at(0)
        raise AssertionError("not reached")


class Tuple(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> Any:
        result = super().solve(problem, budget)
        return result.status, result.path


class OddStats(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return replace(super().solve(problem, budget), stats={"object": object()})


class NearlyThere(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.path is None:
            return result
        return replace(result, path=np.vstack([result.path[:-1], problem.goal + 1e-4]))


class Tunnels(Faultless):
    """Leaves all waypoints out."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.status is not Status.EXACT_SOLUTION:
            return result
        return replace(result, path=np.array([problem.start, problem.goal]))


class Dawdles(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        time.sleep(budget.remaining() + 0.3)
        return super().solve(problem, Budget(time.perf_counter() + 0.2))


class Hangs(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        while True:
            time.sleep(0.1)


class AlwaysClaims(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.status is Status.EXACT_SOLUTION:
            return result
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])


class NeverGivesUp(Faultless):
    """Does not return without a solution."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        while (result := super().solve(problem, budget)).status is not Status.EXACT_SOLUTION:
            time.sleep(0.05)
        return result


class WritesToProblem(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        problem.start[0] += 0.0
        return super().solve(problem, budget)


class MovesObstacles(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        obstacles: Any = self._world.obstacles
        obstacles.pop()
        return result


class Chance(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        seed = int.from_bytes(os.urandom(3), "little") + 1
        return super().solve(replace(problem, seed=seed), budget)


class Remembers(Faultless):
    """What it finds depends on how much it has solved before."""

    _solved = 0

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self._solved += 1
        return super().solve(replace(problem, seed=self._solved), budget)


class DeclaredChance(Chance):
    not_repeatable = "it asks the system for random numbers"


class LeavesThreads(Faultless):
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        for _ in range(3):
            threading.Thread(target=time.sleep, args=(2,), daemon=True).start()
        return super().solve(problem, budget)


class KeepsThreads(Faultless):
    """Has them from the beginning, and they wait."""

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        for _ in range(3):
            threading.Thread(target=threading.Event().wait, args=(20,), daemon=True).start()


class WorksOn(Faultless):
    """Its thread is there from the beginning, and works when it has returned."""

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        self._until = 0.0
        threading.Thread(target=self._improve, daemon=True).start()

    def _improve(self) -> None:
        while True:
            if time.perf_counter() > self._until:
                time.sleep(0.001)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        self._until = time.perf_counter() + 1
        return result


class LazyPath(Faultless):
    """Does half of its work when its path is looked at."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        result = super().solve(problem, budget)
        if result.path is None:
            return result
        return replace(result, path=_Late(result.path, budget))


class _Late:
    def __init__(self, path: Any, budget: Budget) -> None:
        self._path, self._budget = path, budget

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        time.sleep(self._budget.remaining() + 0.3)
        return np.array(self._path, dtype=dtype)


class UnpinsTorch(Faultless):
    def setup(self, env: Environment, *, seed: int) -> None:
        import torch

        torch.set_num_threads(4)
        super().setup(env, seed=seed)


class Sundays(Faultless):
    def unsupported(self, env: Environment) -> str | None:
        return "it only plans on Sundays"


class _Hidden(Planner):
    """Not listed: its name begins with an underscore."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return PlannerResult(Status.TIMEOUT)
