"""The harness's side of a worker process: starting, asking, watching and ending it."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing import Pipe
from time import monotonic
from typing import Any

import psutil

from bench import process_group, wire
from bench.record import Fault
from envs import Problem
from envs.problem import Array
from envs.registry import Entry
from planners import Status

GRACE_SHARE, GRACE_S = 0.2, 1.0
"""A planner is killed when it overruns its time limit by both of these."""

_POLL_S = 0.05  # how often a working process is looked at
_LAST_WORDS_S = 2.0  # for a process that ends itself at the hard limit to say where it hung
_GOODBYE_S = 2.0  # for an idle process to end when its parent hangs up
_LOG_LIMIT = 16 * 2**20  # bytes of output kept of a planner that prints without end
_BOOT = (  # not `-m`: that would look for our packages in the current folder first
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]);"
    "from bench.worker import main; main(int(sys.argv[1]))"
)
ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)
"""Environment variables of every worker: one thread for each numerical library."""


@dataclass(frozen=True)
class SetUp:
    """How setting up went: `fault` is empty if the planner is ready."""

    fault: str
    error: str
    setup_s: float
    train_s: float = 0.0


@dataclass(frozen=True)
class Attempt:
    """What came of asking for a path: the claim or the fault, and what it cost."""

    status: str
    solve_s: float | None
    path: Array | None = None
    error: str = ""
    stats: dict[str, Any] = field(default_factory=dict)
    peak_memory_mb: float | None = None

    @property
    def claims(self) -> bool:
        """Whether there is something to judge: a claimed solution or any path."""
        return self.status == Status.EXACT_SOLUTION.value or self.path is not None


class WorkerProcess:
    """One planner in one environment, in a process of its own with one thread per library.

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
        self._log = tempfile.TemporaryFile("a+b")  # noqa: SIM115  closed by close()
        self._connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _BOOT, str(theirs.fileno()), json.dumps(sys.path)],
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=[theirs.fileno()],
                env={**os.environ, **ONE_THREAD},
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
        answer, _ = self._ask(request, limit_s)
        if answer["status"]:
            return SetUp(answer["status"], answer["error"], answer["setup_s"])
        return SetUp("", "", answer["setup_s"], answer["train_s"])

    def solve(self, problem: Problem, time_limit_s: float, stop_cost: float) -> Attempt:
        """One attempt. After `CRASH`, `KILLED` or `OUT_OF_MEMORY` the process is gone."""
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
        answer, path = self._ask(request, hard_limit_s)
        return Attempt(
            answer["status"],
            answer["solve_s"],
            path,
            answer["error"],
            answer.get("stats", {}),
            answer.get("peak_memory_mb"),
        )

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return not self._closed

    @property
    def exit_code(self) -> int | None:
        """As of a finished process: 0 if it ended of itself after its last answer."""
        return self._process.returncode

    def close(self) -> None:
        """Ends the process and whatever of its group it leaves behind.

        One that waits for a problem sees that its parent hung up and ends of itself; one that is
        working is killed. A helper that made a session of its own is out of reach.
        """
        if self._closed:
            return
        self._closed = True
        self._connection.close()
        if not self._working:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(_GOODBYE_S)
        self._process.kill()
        self._process.wait()
        process_group.end(self._process.pid)
        self._log.close()

    def _ask(self, request: wire.Message, limit_s: float) -> tuple[wire.Message, Array | None]:
        """The answer, or a fault in its place if the process dies, hangs or grows too large."""
        begin = monotonic()
        self._working = True
        try:
            wire.send(self._connection, request)
            fault = self._watch(limit_s)
            if fault is None:
                answer, path = wire.receive(self._connection)
                self._working = False
                if answer["status"] == Fault.OUT_OF_MEMORY.value:
                    self.close()
                return answer, path
        except (EOFError, OSError):  # it died, or an interrupted run closed it
            fault = self._overdue if monotonic() - begin >= limit_s else self._cause_of_death
        except (ValueError, KeyError, TypeError) as error:
            nonsense = f"sent what is no message: {error!r}"
            fault = functools.partial(self._fault, Fault.CRASH, nonsense)
        spent = dict.fromkeys(("setup_s", "solve_s"), monotonic() - begin)
        described = {**fault(), **spent}
        self.close()
        return described, None

    def _watch(self, limit_s: float) -> Callable[[], wire.Message] | None:
        """Waits for an answer; what describes the fault if the process must be ended instead."""
        end = monotonic() + limit_s + _LAST_WORDS_S
        while not self._connection.poll(_POLL_S):
            if monotonic() > end:
                return self._overdue
            if self._resident_mb() > self._memory_limit_mb:
                return self._too_large
            if os.fstat(self._log.fileno()).st_size > _LOG_LIMIT:
                os.ftruncate(self._log.fileno(), 0)
        return None

    def _resident_mb(self) -> float:
        try:
            return float(psutil.Process(self._process.pid).memory_info().rss / 2**20)
        except psutil.Error:
            return 0.0

    def _overdue(self) -> wire.Message:
        return self._fault(Fault.KILLED, "ignored its deadline")

    def _too_large(self) -> wire.Message:
        return self._fault(Fault.OUT_OF_MEMORY, "outgrew the memory limit")

    def _cause_of_death(self) -> wire.Message:
        try:
            code = self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            return self._fault(Fault.CRASH, "closed its connection")
        if code < 0:
            return self._fault(Fault.CRASH, f"died of {signal.Signals(-code).name}")
        return self._fault(Fault.CRASH, f"exited with code {code}")

    def _fault(self, fault: Fault, reason: str) -> wire.Message:
        said = self._last_output()
        return {"status": fault.value, "error": f"{reason}\n{said}".strip()}

    def _last_output(self) -> str:
        """The end of what the process printed; for a crash, where it happened."""
        if self._log.closed:
            return ""
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - 2000))
        return self._log.read().decode(errors="replace")
