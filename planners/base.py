"""The contract of a planner, and of one that knows arrival times from anywhere to anywhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import Enum
from time import perf_counter
from typing import Any, Protocol, runtime_checkable

from envs import Environment, Problem
from envs.problem import Array


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
    """What `Planner.solve` returns.

    Attributes:
        path: waypoints (k, d) from start to goal, in the environment's unit, as any array-like,
            iterator or tensor, or an `envs.Path`; None without one.
        stats: JSON data, see ARCHITECTURE.md.

    All of it is read and copied before the clock stops: a result that computes itself when it is
    looked at, or on a device, takes that time as if `solve` had.
    """

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
        """Offline work: load weights, build a roadmap, start pools. Timed apart, with the making
        of the planner; what it leaves at work is the fault of the first `solve` after it."""

    def weights_digest(self, env: Environment) -> str:
        """A digest of the trained numbers, read from files, with which it plans in `env`; empty for
        a planner without any. Results of other numbers are not its results.

        Raises:
            InputError: they cannot be read.
        """
        return ""

    @abstractmethod
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        """Online work: what is timed.

        Threads and processes that it begins must have ended when it returns, and those of pools
        and libraries be at rest; what works on is a fault (`LEFT_RUNNING`).
        """


@runtime_checkable
class TimeFieldPlanner(Protocol):
    """A planner, once set up, whose field of arrival times can be looked at."""

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """Arrival times (n,) from `source` (d,) at configurations (n, d), and the speeds (n,)
        that the field implies there, 1 / |grad T|."""
