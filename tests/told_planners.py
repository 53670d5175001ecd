"""Planners that tell what they were given: numbers that they were trained to, and a device."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any

import numpy as np

from envs import Environment, Problem, Spec
from planners import Budget, Planner, PlannerResult, Status
from planners.learning import weight_files
from planners.learning.learned_planner import LearnedPlanner, Trained, Training
from planners.learning.weight_files import Tensors


def straight(problem: Problem, **stats: object) -> PlannerResult:
    """A claim of the straight line."""
    return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal], stats)


class Told(LearnedPlanner):
    """Learns the number in `TOLD_NUMBER`, and tells it."""

    improves = False

    def __init__(self, weights: str = "") -> None:
        super().__init__(type(self).__name__.lower(), weights)

    def train(self, env: Environment, how: Training) -> Trained:
        return Trained({"number": np.array([float(os.environ["TOLD_NUMBER"])])}, {}, 0.0, 0.0)

    def expected_minutes(self, env: Environment) -> float:
        return 0.01

    def fitted(self, env: Environment, tensors: Tensors) -> Any:
        return float(tensors["number"][0])

    def load(self, env: Environment, tensors: Tensors) -> None:
        self._number = self.fitted(env, tensors)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return straight(problem, number=self._number)


class ToldOnce(Told):
    """The same for all scenes of a family."""

    def domain(self, env: Environment) -> str:
        return env.family_fingerprint


class Swaps(Told):
    """At the second problem others' weights take the place of its own, and it dies."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        if problem.index == 1:
            other = Path(os.environ["OTHER_WEIGHTS"])
            for of in (lambda file: file, weight_files.manifest_file):
                of(Path(self._weights)).write_bytes(of(other).read_bytes())
            os._exit(3)
        return super().solve(problem, budget)


class TellsDevice(Planner):
    improves = False

    def __init__(self, device: str = "cpu") -> None:
        self._device = device

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        return straight(problem, device=self._device)


class TellsProcessors(Planner):
    """Those that it may use, in all of its threads and processes."""

    improves = False

    def setup(self, env: Environment, *, seed: int) -> None:
        self._stay = threading.Event()
        threading.Thread(target=self._stay.wait, daemon=True).start()

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        threads = [int(task.name) for task in Path("/proc/self/task").iterdir()]
        mine = [sorted(os.sched_getaffinity(thread)) for thread in threads]
        return straight(problem, mine=mine)


class Unsuited(Planner):
    """It would improve, if it could plan anywhere."""

    def unsupported(self, env: Environment) -> str | None:
        return "it can plan nowhere"

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        raise AssertionError


SPECS = [
    Spec(id, f"told_planners:{cls.__name__}", "tells", in_all=False)
    for id, cls in {
        "told": Told,
        "told-once": ToldOnce,
        "swaps": Swaps,
        "tells-device": TellsDevice,
        "tells-processors": TellsProcessors,
        "unsuited": Unsuited,
    }.items()
]
