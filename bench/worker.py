"""One isolated process that sets up one planner in one environment and solves problems.

Started by `bench.process`, which talks to it over a socket. What the planner prints goes to the
log that the parent gave as standard output and error.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import sys
import traceback
from multiprocessing.connection import Connection
from time import perf_counter
from typing import Any

import numpy as np

from bench import wire
from bench.record import Fault
from envs import Environment, Problem
from envs.registry import Entry
from planners import Budget, Planner, Status


def main(descriptor: int) -> None:
    """Answers the parent's requests until it hangs up."""
    connection = Connection(descriptor)
    os.set_inheritable(descriptor, False)  # else what the planner starts would keep it open
    faulthandler.enable()
    try:
        request, _ = wire.receive(connection)
        _limit_memory(request["memory_limit_mb"])
        planner, answer = _set_up(request)
        wire.send(connection, answer)
        while planner is not None:
            request, _ = wire.receive(connection)
            answer, path = _attempt(planner, request)
            wire.send(connection, answer, path)
            if answer["status"] == Fault.OUT_OF_MEMORY.value:
                return  # what was left allocated is unknown: the parent starts a fresh process
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the parent has gone or has hung up


def _limit_memory(megabytes: int) -> None:
    """Caps the memory this process may allocate, where the system enforces that (Linux)."""
    limit = megabytes * 2**20
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


def _set_up(request: wire.Message) -> tuple[Planner | None, wire.Message]:
    """The planner, ready to solve, or None with the fault in the answer."""
    try:
        env: Environment = Entry.described(request["env"]).make()
        if env.fingerprint != request["fingerprint"]:
            raise RuntimeError("the environment is not the same in every process")
        planner: Planner = Entry.described(request["planner"]).make()
        reason = planner.unsupported(env)
        if reason is not None:
            return None, {"status": Fault.UNSUPPORTED.value, "error": reason, "setup_s": 0.0}
        begin = perf_counter()
        planner.setup(env, seed=request["seed"])
        setup_s = perf_counter() - begin
        gc.collect()
        gc.freeze()  # what stays need not be looked through again before each attempt
    except MemoryError:
        return None, _fault(Fault.OUT_OF_MEMORY)
    except (Exception, SystemExit):  # noqa: BLE001  a planner may fail in any way
        return None, _fault(Fault.ERROR)
    return planner, {
        "status": None,
        "setup_s": setup_s,
        "train_s": float(planner.train_s),
    }


def _attempt(planner: Planner, request: wire.Message) -> tuple[wire.Message, np.ndarray | None]:
    """Solves one problem; the clock runs around `solve` and nothing else."""
    problem = Problem(request["start"], request["goal"], request["index"], request["seed"])
    gc.collect()
    # Ends the process and logs where it hung, even if no Python code runs any more.
    faulthandler.dump_traceback_later(request["hard_limit_s"], exit=True)
    begin = perf_counter()
    try:
        budget = Budget(begin + request["time_limit_s"], request["stop_cost"])
        result = planner.solve(problem, budget)
        solve_s = perf_counter() - begin
        status = Status(result.status).value
        path = _numbers(result.path)
        answer = {"status": status, "stats": dict(result.stats), "error": ""}
    except MemoryError:
        solve_s, path = perf_counter() - begin, None
        answer = _fault(Fault.OUT_OF_MEMORY)
    except (Exception, SystemExit):  # noqa: BLE001  a planner may fail in any way
        solve_s, path = perf_counter() - begin, None
        answer = _fault(Fault.ERROR)
    finally:
        faulthandler.cancel_dump_traceback_later()
    return answer | {"solve_s": solve_s, "peak_memory_mb": _peak_memory_mb()}, path


def _numbers(path: Any) -> np.ndarray | None:
    """The claimed path as numbers of whatever shape, None if it is none; the judge says what is
    wrong with it."""
    if path is None:
        return None
    try:
        return np.asarray(getattr(path, "waypoints", path), dtype=np.float64)
    except (TypeError, ValueError):
        return None


def _fault(fault: Fault) -> wire.Message:
    return {
        "status": fault.value,
        "stats": {},
        "error": traceback.format_exc(limit=-4).strip(),
        "setup_s": 0.0,
    }


def _peak_memory_mb() -> float:
    """The most memory this process has held so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak / 2**20 if sys.platform == "darwin" else peak / 2**10)
