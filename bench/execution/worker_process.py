"""The harness's side of a worker process: starting, asking, watching and ending it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from multiprocessing import connection
from time import monotonic
from typing import Any, TypeVar

from bench.execution import planner_queries as queries
from bench.execution import protocol
from bench.execution.answers import Attempt, Clock, Exchange, SetUp, attempt_of, set_up_of, storable
from bench.execution.child_process import ChildProcess
from bench.execution.launch import ONE_THREAD
from bench.execution.planner_queries import World
from bench.storage.record import Fault
from envs import Environment, Problem
from envs.problem import Array
from envs.registry import Entry
from planners.base import NOT_PLAIN

__all__ = [
    "GRACE_S",
    "GRACE_SHARE",
    "ONE_THREAD",
    "Attempt",
    "SetUp",
    "WorkerProcess",
    "hard_limit_s",
]

GRACE_SHARE, GRACE_S = 0.2, 1.0
"""A planner is killed when it overruns its time limit by both of these."""


def hard_limit_s(time_limit_s: float, grace_s: float = GRACE_S) -> float:
    """Seconds after which an attempt is killed."""
    return time_limit_s + max(grace_s, GRACE_SHARE * time_limit_s)


_POLL_S = 0.05  # how often a working process is looked at

T = TypeVar("T")
_Reader = Callable[[protocol.Message, Array | None, Clock], T]
"""What makes something of an answer."""


class _LostError(Exception):
    """A process gave no answer.

    Attributes:
        fault: in its place; why: in words; spent_s: seconds that it had.
    """

    def __init__(self, fault: Fault, why: str, spent_s: float) -> None:
        super().__init__(why)
        self.fault, self.why, self.spent_s = fault.value, why, spent_s


class WorkerProcess:
    """One planner in one environment, in a process of its own with one thread per library.

    While it is asked nothing it is stopped, with all that it started in its group, so that it takes
    nothing from whoever plans meanwhile.

    Args:
        world: what the process makes for itself, or is told of; one that makes another is a fault.
        planner: what it makes there.
        memory_limit_mb: it may hold.
    """

    def __init__(self, world: World, planner: Entry[Any], memory_limit_mb: int) -> None:
        self._memory_limit_mb = memory_limit_mb
        self._largest_mb = 0.0  # as seen from here while it worked
        self._told = world.env if queries.plans_from_data(planner) else None
        self._child = ChildProcess("bench.execution.worker", queries.interpreter(planner))
        self._described = {
            "env": world.entry.description,
            "planner": planner.description,
            "fingerprint": world.env.fingerprint,
        }

    def set_up(self, seed: int, limit_s: float) -> SetUp:
        """Makes environment and planner in the process and calls the planner's `setup`."""
        request = {**self._described, "seed": seed, "memory_limit_mb": self._memory_limit_mb}
        return self._ask_ready(request, self._told, limit_s)

    def _ask_ready(
        self, request: protocol.Message, told: Environment | None, limit_s: float
    ) -> SetUp:
        """How getting ready goes, for an environment of which the process is told here if it is."""
        numbers = None
        if told is not None:
            scene = told.plain_scene
            if scene is None:
                return SetUp(Fault.UNSUPPORTED.value, NOT_PLAIN, 0.0)
            request["scene"], numbers = scene.packed()
        try:
            return self._ask(request, limit_s, set_up_of, numbers)
        except _LostError as lost:
            return SetUp(lost.fault, lost.why, lost.spent_s)

    def set_scene(self, problem: Problem, limit_s: float) -> SetUp:
        """Has the planner get ready for the scene of a problem. After `CRASH`, `KILLED` or
        `OUT_OF_MEMORY` the process is gone."""
        request = {"asked": protocol.SCENE, **_said(problem)}
        told = self._told and self._told.scene_of(problem)
        return self._ask_ready(request, told, limit_s)

    def solve(
        self, problem: Problem, time_limit_s: float, stop_cost: float, grace_s: float = GRACE_S
    ) -> Attempt:
        """One attempt, which is killed after `hard_limit_s(time_limit_s, grace_s)`. After `CRASH`,
        `KILLED` or `OUT_OF_MEMORY`, and where what it left running goes on working, the process is
        gone."""
        until_killed_s = hard_limit_s(time_limit_s, grace_s)
        request = {
            "asked": protocol.PATH,
            **_said(problem),
            "time_limit_s": time_limit_s,
            "hard_limit_s": until_killed_s,
            "stop_cost": stop_cost,
        }
        self._child.forget_output()
        try:
            attempt = self._ask(request, until_killed_s, attempt_of)
        except _LostError as lost:
            return Attempt(lost.fault, lost.spent_s, error=lost.why)
        if attempt.peak_memory_mb is None and self._largest_mb:
            return replace(attempt, peak_memory_mb=self._largest_mb)
        return attempt

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return self._child.alive

    @property
    def pid(self) -> int:
        """Of the process, by the system's numbers."""
        return self._child.pid

    @property
    def exit_code(self) -> int | None:
        """As of a finished process: 0 if it ended of itself after its last answer."""
        return self._child.exit_code

    def close(self) -> None:
        """Ends the process and what it has started; see `ChildProcess.close`."""
        self._child.close()

    def _ask(
        self,
        request: protocol.Message,
        limit_s: float,
        read: _Reader[T],
        numbers: Array | None = None,
    ) -> T:
        """The answer, as `read` has it.

        Args:
            numbers: that go with the request.

        Raises:
            _LostError: the process died, hung, grew too large or made no sense. It is gone.
        """
        exchange = Exchange(limit_s)
        self._largest_mb = 0.0
        self._child.resume()
        try:
            protocol.send(self._child.connection, request, numbers)
            message, path = self._next(exchange)
            while "mark" in message:
                exchange.note(message["mark"], self._child.connection)
                message, path = self._next(exchange)
            answer = read(message, path, exchange.clock)
        except _LostError:
            self.close()
            raise
        except (EOFError, OSError):  # it died, or an interrupted run closed it
            spent_s = exchange.spent_s
            lost = self._overdue(spent_s) if exchange.overdue else self._died(spent_s)
            self.close()
            raise lost from None
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            nonsense = f"sent what is no message: {error!r}"
            lost = self._lost(Fault.CRASH, nonsense, exchange.spent_s)
            self.close()
            raise lost from None
        self._child.working = False
        if message.get("ends"):
            self.close()
        self._child.pause()
        return answer

    def _next(self, exchange: Exchange) -> tuple[protocol.Message, Array | None]:
        """The next message; the process is watched until it comes."""
        while not connection.wait([self._child.connection], _POLL_S):
            if monotonic() > exchange.until:
                raise self._overdue(exchange.spent_s)
            self._largest_mb = max(self._largest_mb, self._child.resident_mb)
            if self._largest_mb > self._memory_limit_mb:
                why = "outgrew the memory limit"
                raise self._lost(Fault.OUT_OF_MEMORY, why, exchange.spent_s)
            self._child.limit_output()
        return protocol.receive(self._child.connection, exchange.until)

    def _overdue(self, spent_s: float) -> _LostError:
        return self._lost(Fault.KILLED, "ignored its deadline", spent_s)

    def _died(self, spent_s: float) -> _LostError:
        return self._lost(Fault.CRASH, self._child.cause_of_death(), spent_s)

    def _lost(self, fault: Fault, reason: str, spent_s: float) -> _LostError:
        said = f"{reason}\n{self._child.last_output()}".strip()
        return _LostError(fault, storable(said), spent_s)


def _said(problem: Problem) -> protocol.Message:
    return {
        "start": problem.start.tolist(),
        "goal": problem.goal.tolist(),
        "goals": None if problem.goals is None else problem.goals.tolist(),
        "index": problem.index,
        "seed": problem.seed,
    }
