"""The contract of a planner."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import Enum
from time import perf_counter
from typing import Any

from envs import Environment, Problem


class Status(str, Enum):
    """What a planner says of its attempt, in OMPL's words."""

    EXACT_SOLUTION = "EXACT_SOLUTION"  # the path joins start and goal
    APPROXIMATE_SOLUTION = "APPROXIMATE_SOLUTION"  # the best it has, known not to do
    TIMEOUT = "TIMEOUT"  # nothing found in time
    INFEASIBLE = "INFEASIBLE"  # it says that there is no path
    INVALID_START = "INVALID_START"
    INVALID_GOAL = "INVALID_GOAL"


@dataclass(frozen=True)
class PlannerResult:
    """`path` is (k, d) from start to goal; `stats` is JSON data, see ARCHITECTURE.md."""

    status: Status
    path: Any = None
    stats: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Budget:
    """Until when to plan (`time.perf_counter`), and the path length at which to stop improving."""

    deadline: float
    stop_cost: float = float("inf")  # inf: the first solution will do; 0: use all the time

    def remaining(self) -> float:
        """Seconds left, at least 0."""
        return max(0.0, self.deadline - perf_counter())


class Planner(ABC):
    train_s: float = 0.0  # seconds that data and training of the weights in use once took
    improves: bool = True  # whether it may go on after its first solution, to `stop_cost`

    def unsupported(self, env: Environment) -> str | None:
        """Why it cannot plan in `env`, or None if it can."""
        return None

    def setup(self, env: Environment, *, seed: int) -> None:  # noqa: B027  (nothing is a fine default)
        """Offline work: load weights, build a roadmap. Timed apart."""

    def weights_digest(self, env: Environment) -> str:
        """A digest of the trained numbers, read from files, with which it plans in `env`; empty for
        a planner without any. Results of other numbers are not its results.

        Raises:
            InputError: they cannot be read.
        """
        return ""

    @abstractmethod
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        """Online work: what is timed."""
