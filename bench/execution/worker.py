"""One isolated process that sets up one planner in one environment and solves problems.

Started by `bench.execution.worker_process`, which talks to it over a socket. What the planner
prints goes to the log that the parent gave as standard output and error.

A planner's result may be lazy: an array that computes itself when it is read, an iterator, a tensor
on a device that is still computing. It is made plain data on the planner's own clock.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import json
import os
import resource
import signal
import socket
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.execution import protocol
from bench.execution.left_running import Before
from bench.execution.machine import MemoryPeak
from bench.execution.process_group import below_cpu_s, own_cpu_s, tie_to_parent
from bench.storage.record import Fault
from envs.errors import reason
from envs.plain_scene import PlainScene
from envs.problem import Array, Problem
from envs.registry import Entry
from planners import Budget, Planner, Status

if TYPE_CHECKING:  # what makes environments is not in every interpreter
    from envs import Environment

_MOST_SAID = 10_000  # characters at either end of what is said of an error


def main(descriptor: int) -> None:
    """Answers the parent's requests until it hangs up."""
    connection = socket.socket(fileno=descriptor)
    os.set_inheritable(descriptor, False)  # else what the planner starts would keep it open
    faulthandler.enable()
    tie_to_parent()
    try:
        request, numbers = protocol.receive(connection)
        _limit_memory(request["memory_limit_mb"])
        ready, answer = _set_up(connection, request, numbers)
        protocol.send(connection, answer)
        while ready is not None:
            request, numbers = protocol.receive(connection)
            path = None
            if request["asked"] == protocol.SCENE:
                answer = ready.set_scene(connection, request, numbers)
            else:
                answer, path = _attempt(connection, ready.planner, request)
            protocol.send(connection, answer, path)
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
        protocol.send(self._connection, {"mark": protocol.READY})
        protocol.receive(self._connection)
        if self._hard_limit_s is not None:
            faulthandler.dump_traceback_later(self._hard_limit_s, exit=True)
        self._used = own_cpu_s() + below
        self.begin = perf_counter()
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.seconds = perf_counter() - self.begin
        used = own_cpu_s()
        faulthandler.cancel_dump_traceback_later()
        protocol.send(self._connection, {"mark": protocol.ENDED})
        # There may be no memory to look below with.
        below = 0.0 if kind is not None and issubclass(kind, MemoryError) else below_cpu_s()
        self.cpu_s = max(0.0, used + below - self._used)


class _Made:
    """The environment, made here."""

    def __init__(self, request: protocol.Message, numbers: Array | None) -> None:
        self.first: Environment = Entry.described(request["env"]).make()

    def scene(self, request: protocol.Message, numbers: Array | None) -> Environment:
        """That of a problem."""
        return self.first.scene_of(_problem(request))


class _Told:
    """Scenes as plain data, which the parent sends."""

    def __init__(self, request: protocol.Message, numbers: Array | None) -> None:
        self._last: PlainScene | None = None
        self.first = self.scene(request, numbers)

    def scene(self, request: protocol.Message, numbers: Array | None) -> PlainScene:
        """What is sent; the same again, if it is."""
        assert numbers is not None
        sent = PlainScene.of(request["scene"], numbers)
        if self._last is None or self._last.fingerprint != sent.fingerprint:
            self._last = sent
        return self._last


@dataclass
class _Ready:
    """A planner that is set up.

    Attributes:
        scenes: where those of problems come from.
        scene: that it is ready for; None once it failed to get ready for one.
    """

    planner: Planner
    scenes: _Made | _Told
    scene: Environment | PlainScene | None

    def set_scene(
        self, connection: socket.socket, request: protocol.Message, numbers: Array | None
    ) -> protocol.Message:
        """Has the planner get ready for a problem's scene, if it is not."""
        scene: Any = self.scenes.scene(request, numbers)
        timed, another = _Timed(connection), scene is not self.scene
        self.scene = None
        status, error = None, ""
        try:
            with timed:
                if another:
                    self.planner.set_scene(scene)
                wait_for_devices()
            self.scene = scene
        except MemoryError:
            status, error = Fault.OUT_OF_MEMORY.value, _told()
        except (Exception, SystemExit):  # noqa: BLE001  a planner may fail in any way
            status, error = Fault.ERROR.value, _told()
        ends = status == Fault.OUT_OF_MEMORY.value
        return {**_said_of_setup(timed, status, error), "ends": ends}


def _problem(request: protocol.Message) -> Problem:
    names = ("start", "goal", "index", "seed", "goals")
    return Problem(**{name: request[name] for name in names})


def _set_up(
    connection: socket.socket, request: protocol.Message, numbers: Array | None
) -> tuple[_Ready | None, protocol.Message]:
    """The planner, ready to solve, or None with the fault in the answer. Making it counts as
    setting up, importing it does not."""
    timed = _Timed(connection)
    try:
        scenes = (_Told if "scene" in request else _Made)(request, numbers)
        env: Any = scenes.first
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
    return _Ready(planner, scenes, env), {**_said_of_setup(timed, None, ""), "train_s": train_s}


def _said_of_setup(timed: _Timed, status: str | None, error: str) -> protocol.Message:
    return {"status": status, "error": error, "setup_s": timed.seconds}


def _attempt(
    connection: socket.socket, planner: Planner, request: protocol.Message
) -> tuple[protocol.Message, np.ndarray | None]:
    """Solves one problem; the clock runs until the result is plain data in memory."""
    problem = _problem(request)
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


def _fault(fault: Fault, error: str) -> protocol.Message:
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


_MOST_STATS = 2**22  # bytes of JSON


@dataclass(frozen=True)
class Claim:
    """A result that nobody can change any more.

    Attributes:
        path: as numbers of whatever shape, None if it is none; the judge says what is wrong.
        stats: JSON.
        notes: what was left out, a line each.
    """

    status: str
    path: Array | None
    stats: str
    notes: tuple[str, ...] = ()


def in_memory(result: Any) -> Claim:
    """What `Planner.solve` returned as plain data. Raises whatever the planner's objects raise."""
    status = Status(result.status).value
    path, of_path = _numbers(result.path)
    stats, of_stats = _json(result.stats)
    wait_for_devices()
    return Claim(status, path, stats, tuple(filter(None, (of_path, of_stats))))


def wait_for_devices() -> None:
    """Returns when no device that PyTorch has in use computes any more."""
    torch: Any = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_initialized():
        torch.cuda.synchronize()


def _numbers(path: Any) -> tuple[Array | None, str]:
    """A copy, which what the planner may have left running cannot write to."""
    if path is None:
        return None, ""
    waypoints = getattr(path, "waypoints", path)
    if isinstance(waypoints, Iterator):
        waypoints = list(waypoints)
    try:
        numbers: Array = np.array(_on_host(waypoints), dtype=np.float64)
    except (TypeError, ValueError) as error:
        return None, f"its path is no array of numbers: {reason(error)}"
    if numbers.nbytes > protocol.MOST_NUMBERS:
        size, most = numbers.nbytes // 2**20, protocol.MOST_NUMBERS // 2**20
        return None, f"its path of shape {numbers.shape} takes {size} MB; {most} are the most"
    return numbers, ""


def _on_host(waypoints: Any) -> Any:
    """Tensors without their gradients and in the processor's memory, where NumPy can read them;
    anything else as it is."""
    if hasattr(waypoints, "detach"):
        return waypoints.detach().cpu()
    if isinstance(waypoints, list | tuple) and any(hasattr(q, "detach") for q in waypoints):
        return [_on_host(q) for q in waypoints]
    return waypoints


def _json(stats: Any) -> tuple[str, str]:
    """JSON, or that of nothing and why."""
    try:
        text = json.dumps(dict(stats), default=protocol.plain)
    except (TypeError, ValueError, RecursionError) as error:
        return "{}", f"its stats are left out, as they are no JSON data: {reason(error)}"
    if len(text) > _MOST_STATS:
        size, most = len(text) // 2**20, _MOST_STATS // 2**20
        return "{}", f"its stats are left out, as they take {size} MB; {most} are the most"
    return text, ""
