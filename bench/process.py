"""The harness's side of a worker process: starting, asking, watching and ending it."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import tempfile
import threading
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import connection
from time import monotonic
from typing import Any, TypeVar

import psutil

from bench import launch, process_group, wire
from bench.answer import Attempt, Clock, SetUp, attempt_of, set_up_of, storable
from bench.exchange import Exchange
from bench.launch import ONE_THREAD
from bench.record import Fault
from envs import Problem
from envs.problem import Array
from envs.registry import Entry

__all__ = ["GRACE_S", "GRACE_SHARE", "ONE_THREAD", "Attempt", "SetUp", "WorkerProcess"]

GRACE_SHARE, GRACE_S = 0.2, 1.0
"""A planner is killed when it overruns its time limit by both of these."""

_POLL_S = 0.05  # how often a working process is looked at
_GOODBYE_S = 2.0  # for an idle process to end when its parent hangs up
_DIES_S = 5.0  # for one that closed its connection to be gone
_LAST_OUTPUT = 2**15  # bytes of it that are looked at for what to quote
_MOST_QUOTED = 2000  # characters
_LOG_LIMIT = 16 * 2**20  # bytes of output kept of a planner that prints without end

T = TypeVar("T")
_Reader = Callable[[wire.Message, Array | None, Clock], T]
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
        env, planner: what the process makes for itself.
        fingerprint: of the environment; a process that makes another is a fault.
        memory_limit_mb: it may hold.
    """

    def __init__(
        self, env: Entry[Any], planner: Entry[Any], fingerprint: str, memory_limit_mb: int
    ) -> None:
        self._memory_limit_mb = memory_limit_mb
        self._closed = False
        self._working = False
        self._largest_mb = 0.0  # as seen from here while it worked
        self._closing = threading.Lock()
        self._log = tempfile.TemporaryFile("a+b")  # noqa: SIM115  closed by close()
        self._connection, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                launch.arguments(theirs.fileno()),
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=[theirs.fileno()],
                env=launch.variables(),
                cwd=launch.COMMAND.start.folder,
                start_new_session=True,  # a Ctrl-C is the harness's to handle
            )
        self._described = {
            "env": env.description,
            "planner": planner.description,
            "fingerprint": fingerprint,
        }

    def set_up(self, seed: int, limit_s: float) -> SetUp:
        """Makes environment and planner in the process and calls the planner's `setup`."""
        request = {**self._described, "seed": seed, "memory_limit_mb": self._memory_limit_mb}
        try:
            return self._ask(request, limit_s, set_up_of)
        except _LostError as lost:
            return SetUp(lost.fault, lost.why, lost.spent_s)

    def solve(self, problem: Problem, time_limit_s: float, stop_cost: float) -> Attempt:
        """One attempt. After `CRASH`, `KILLED` or `OUT_OF_MEMORY`, and where what it left running
        goes on working, the process is gone."""
        hard_limit_s = time_limit_s + max(GRACE_S, GRACE_SHARE * time_limit_s)
        request = {
            "start": problem.start.tolist(),
            "goal": problem.goal.tolist(),
            "index": problem.index,
            "seed": problem.seed,
            "time_limit_s": time_limit_s,
            "hard_limit_s": hard_limit_s,
            "stop_cost": stop_cost,
        }
        os.ftruncate(self._log.fileno(), 0)
        try:
            attempt = self._ask(request, hard_limit_s, attempt_of)
        except _LostError as lost:
            return Attempt(lost.fault, lost.spent_s, error=lost.why)
        if attempt.peak_memory_mb is None and self._largest_mb:
            return replace(attempt, peak_memory_mb=self._largest_mb)
        return attempt

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return not self._closed

    @property
    def pid(self) -> int:
        """Of the process, by the system's numbers."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """As of a finished process: 0 if it ended of itself after its last answer."""
        return self._process.returncode

    def close(self) -> None:
        """Ends the process, its group and whatever else it has started.

        One that waits for a problem sees that its parent hung up and ends of itself; one that is
        working is killed. Of one that died before, helpers in sessions of their own are out of
        reach.
        """
        with self._closing:
            if self._closed:
                return
            self._closed = True
        self._connection.close()
        pid = self._process.pid
        helpers = process_group.helpers(pid)
        process_group.resume(pid)
        if self._working or not process_group.has_ended(pid, _GOODBYE_S):
            os.kill(pid, signal.SIGKILL)  # Popen's own way would reap it first
        process_group.has_ended(pid, _DIES_S)
        process_group.end(pid)  # while the number is still its own
        process_group.end_helpers(helpers)
        self._process.wait()
        self._log.close()

    def _ask(self, request: wire.Message, limit_s: float, read: _Reader[T]) -> T:
        """The answer, as `read` has it.

        Raises:
            _LostError: the process died, hung, grew too large or made no sense. It is gone.
        """
        exchange = Exchange(limit_s)
        self._working, self._largest_mb = True, 0.0
        process_group.resume(self._process.pid)
        try:
            wire.send(self._connection, request)
            message, path = self._next(exchange)
            while "mark" in message:
                exchange.note(message["mark"], self._connection)
                message, path = self._next(exchange)
            answer = read(message, path, exchange.clock)
        except _LostError:
            self.close()
            raise
        except (EOFError, OSError):  # it died, or an interrupted run closed it
            spent_s = exchange.spent_s
            lost = self._overdue(spent_s) if exchange.overdue else self._cause_of_death(spent_s)
            self.close()
            raise lost from None
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            nonsense = f"sent what is no message: {error!r}"
            lost = self._lost(Fault.CRASH, nonsense, exchange.spent_s)
            self.close()
            raise lost from None
        self._working = False
        if message.get("ends"):
            self.close()
        self._pause()
        return answer

    def _pause(self) -> None:
        with self._closing:
            if not self._closed:
                process_group.pause(self._process.pid)

    def _next(self, exchange: Exchange) -> tuple[wire.Message, Array | None]:
        """The next message; the process is watched until it comes."""
        while not connection.wait([self._connection], _POLL_S):
            if monotonic() > exchange.until:
                raise self._overdue(exchange.spent_s)
            self._largest_mb = max(self._largest_mb, self._resident_mb())
            if self._largest_mb > self._memory_limit_mb:
                why = "outgrew the memory limit"
                raise self._lost(Fault.OUT_OF_MEMORY, why, exchange.spent_s)
            if os.fstat(self._log.fileno()).st_size > _LOG_LIMIT:
                os.ftruncate(self._log.fileno(), 0)
        return wire.receive(self._connection, exchange.until)

    def _resident_mb(self) -> float:
        try:
            return float(psutil.Process(self._process.pid).memory_info().rss / 2**20)
        except psutil.Error:
            return 0.0

    def _overdue(self, spent_s: float) -> _LostError:
        return self._lost(Fault.KILLED, "ignored its deadline", spent_s)

    def _cause_of_death(self, spent_s: float) -> _LostError:
        if not process_group.has_ended(self._process.pid, _DIES_S):
            return self._lost(Fault.CRASH, "closed its connection", spent_s)
        code = process_group.exit_code(self._process.pid)
        if code is None:
            return self._lost(Fault.CRASH, "died", spent_s)
        if code < 0:
            return self._lost(Fault.CRASH, f"died of {_signal_name(-code)}", spent_s)
        return self._lost(Fault.CRASH, f"exited with code {code}", spent_s)

    def _lost(self, fault: Fault, reason: str, spent_s: float) -> _LostError:
        return _LostError(fault, storable(f"{reason}\n{self._last_output()}".strip()), spent_s)

    def _last_output(self) -> str:
        """The end of what the process printed; for a crash, where it happened."""
        if self._log.closed:
            return ""
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - _LAST_OUTPUT))
        said = self._log.read().decode(errors="replace")
        # What faulthandler says last: names of a hundred libraries in one line.
        return re.sub(r"\nExtension modules: .*", "", said)[-_MOST_QUOTED:]


def _signal_name(number: int) -> str:
    named = {known.value: known.name for known in signal.Signals}
    return named.get(number, f"signal {number}")
