"""One isolated process that sets up one planner in one environment and solves problems.

Started by `bench.process`, which talks to it over a socket. What the planner prints goes to the
log that the parent gave as standard output and error.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import os
import resource
import signal
import socket
import traceback
from time import perf_counter

import numpy as np

from bench import wire
from bench.claim import in_memory, wait_for_devices
from bench.left_running import Before
from bench.memory import MemoryPeak
from bench.process_group import tie_to_parent
from bench.process_tree import below_cpu_s, own_cpu_s
from bench.record import Fault
from envs import Environment, Problem
from envs.registry import Entry
from planners import Budget, Planner

_MOST_SAID = 10_000  # characters at either end of what is said of an error


def main(descriptor: int) -> None:
    """Answers the parent's requests until it hangs up."""
    connection = socket.socket(fileno=descriptor)
    os.set_inheritable(descriptor, False)  # else what the planner starts would keep it open
    faulthandler.enable()
    tie_to_parent()
    try:
        request, _ = wire.receive(connection)
        _limit_memory(request["memory_limit_mb"])
        planner, answer = _set_up(connection, request)
        wire.send(connection, answer)
        while planner is not None:
            request, _ = wire.receive(connection)
            answer, path = _attempt(connection, planner, request)
            wire.send(connection, answer, path)
            if answer["ends"]:
                return
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the parent has gone or has hung up
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(0, signal.SIGCONT)  # what this one started must hear that it ends


def _limit_memory(megabytes: int) -> None:
    """Caps the memory this process may allocate, where the system enforces that (Linux)."""
    limit = megabytes * 2**20
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


class _Timed:
    """The planner's clock, which runs within the context; the parent's runs about it.

    Args:
        hard_limit_s: after which the process ends and logs where it hung, even if no Python code
            runs any more.

    Attributes:
        begin: on `time.perf_counter`.
        seconds, cpu_s: once the context has ended: how long it took, and the processor's time of
            all threads and children.
    """

    seconds = 0.0
    cpu_s = 0.0

    def __init__(self, connection: socket.socket, hard_limit_s: float | None = None) -> None:
        self._connection, self._hard_limit_s = connection, hard_limit_s

    def __enter__(self) -> _Timed:
        below = below_cpu_s()
        wire.send(self._connection, {"mark": wire.READY})
        wire.receive(self._connection)
        if self._hard_limit_s is not None:
            faulthandler.dump_traceback_later(self._hard_limit_s, exit=True)
        self._used = own_cpu_s() + below
        self.begin = perf_counter()
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.seconds = perf_counter() - self.begin
        used = own_cpu_s()
        faulthandler.cancel_dump_traceback_later()
        wire.send(self._connection, {"mark": wire.ENDED})
        # There may be no memory to look below with.
        below = 0.0 if kind is not None and issubclass(kind, MemoryError) else below_cpu_s()
        self.cpu_s = max(0.0, used + below - self._used)


def _set_up(
    connection: socket.socket, request: wire.Message
) -> tuple[Planner | None, wire.Message]:
    """The planner, ready to solve, or None with the fault in the answer. Making it counts as
    setting up, importing it does not."""
    timed = _Timed(connection)
    try:
        env: Environment = Entry.described(request["env"]).make()
        if env.fingerprint != request["fingerprint"]:
            raise RuntimeError("the environment is not the same in every process")
        entry: Entry[Planner] = Entry.described(request["planner"])
        with timed:
            planner = entry.make()
            reason = planner.unsupported(env)
            if reason is None:
                planner.setup(env, seed=request["seed"])
            wait_for_devices()
        if reason is not None:
            return None, _said_of_setup(timed, Fault.UNSUPPORTED.value, _brief(reason))
        train_s = float(planner.train_s)
        gc.collect()
        gc.freeze()  # what stays need not be looked through again before each attempt
    except MemoryError:
        return None, _said_of_setup(timed, Fault.OUT_OF_MEMORY.value, _told())
    except (Exception, SystemExit):  # noqa: BLE001  a planner may fail in any way
        return None, _said_of_setup(timed, Fault.ERROR.value, _told())
    return planner, {**_said_of_setup(timed, None, ""), "train_s": train_s}


def _said_of_setup(timed: _Timed, status: str | None, error: str) -> wire.Message:
    return {"status": status, "error": error, "setup_s": timed.seconds}


def _attempt(
    connection: socket.socket, planner: Planner, request: wire.Message
) -> tuple[wire.Message, np.ndarray | None]:
    """Solves one problem; the clock runs until the result is plain data in memory."""
    problem = Problem(request["start"], request["goal"], request["index"], request["seed"])
    gc.collect()
    before, memory = Before.now(), MemoryPeak()
    timed = _Timed(connection, request["hard_limit_s"])
    path = None
    try:
        with timed:
            budget = Budget(timed.begin + request["time_limit_s"], request["stop_cost"])
            claim = in_memory(planner.solve(problem, budget))
        path = claim.path
        answer = {
            "status": claim.status,
            "stats": claim.stats,
            "error": "\n".join(claim.notes),
            "ends": False,
        }
    except MemoryError:
        # What was left allocated is unknown: the parent starts a fresh process.
        answer = {**_fault(Fault.OUT_OF_MEMORY, _told()), "ends": True}
    except (Exception, SystemExit):  # noqa: BLE001  a planner may fail in any way
        answer = _fault(Fault.ERROR, _told())
    if not answer["ends"]:
        left = before.left()
        if left.what and answer["status"] != Fault.ERROR.value:
            found = ", ".join(left.what)
            said = f"left running after `solve`: {found}"
            answer |= {"status": Fault.LEFT_RUNNING.value, "error": said}
            path = None
        answer["ends"] = left.works
    peak_mb, added_mb = memory.read()
    return {
        **answer,
        "solve_s": timed.seconds,
        "cpu_s": timed.cpu_s,
        "peak_memory_mb": peak_mb,
        "attempt_memory_mb": added_mb,
    }, path


def _fault(fault: Fault, error: str) -> wire.Message:
    return {"status": fault.value, "stats": "{}", "error": error, "ends": False}


def _told() -> str:
    """The exception at hand with the end of its traceback, if there is memory for that."""
    try:
        return _brief(traceback.format_exc(limit=-4).strip())
    except MemoryError:
        return "out of memory"


def _brief(said: object) -> str:
    text = str(said)
    return (
        text if len(text) <= 2 * _MOST_SAID else f"{text[:_MOST_SAID]} [...] {text[-_MOST_SAID:]}"
    )
