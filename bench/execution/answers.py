"""One question to a worker, on the harness's clock, and its answer: only what can be stored, and no
more than that clock allows.

A worker is a stranger's process. What it says is checked here once, so that whatever is behind may
rely on it. What cannot be kept is left out, and a note in the row's `error` says so.
"""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Iterator
from dataclasses import dataclass, field
from time import monotonic
from typing import Any

import psutil

from bench.execution import machine, protocol
from bench.execution.protocol import Message
from bench.storage.record import Fault, readable_history
from envs.errors import brief
from envs.problem import Array
from planners import Status

_MOST_INTEGER = 2**63 - 1  # SQLite's
_MOST_TEXT = 20_000  # characters of an error
_OF_ATTEMPTS = (Fault.ERROR.value, Fault.OUT_OF_MEMORY.value, Fault.LEFT_RUNNING.value)
_OF_SETUPS = (Fault.ERROR.value, Fault.OUT_OF_MEMORY.value, Fault.UNSUPPORTED.value)
"""Faults that a worker may tell of; what else may befall it the harness sees for itself."""

_COUNTS = ("collision_checks", "fallbacks")

_SLACK_S, _SLACK_SHARE = 0.1, 0.1
"""How much less a worker may say that it took than passed by the harness's clock, which runs on
while either waits for a core: by the larger of the two."""


@dataclass(frozen=True)
class SetUp:
    """How setting up went: `fault` is empty if the planner is ready."""

    fault: str
    error: str
    setup_s: float
    train_s: float = 0.0


@dataclass(frozen=True)
class Attempt:
    """What came of asking for a path: the claim or the fault, and what it cost.

    For the costs see `bench.storage.record.Record`; None is what was not measured.
    """

    status: str
    solve_s: float | None
    path: Array | None = None
    error: str = ""
    stats: dict[str, Any] = field(default_factory=dict)
    peak_memory_mb: float | None = None
    cpu_s: float | None = None
    load: float | None = None
    attempt_memory_mb: float | None = None
    scene_s: float | None = None

    @property
    def claims(self) -> bool:
        """Whether there is something to judge: a claimed solution or any path."""
        return self.status == Status.EXACT_SOLUTION.value or self.path is not None


@dataclass(frozen=True)
class Clock:
    """What the harness saw of the time that a worker was at work.

    Attributes:
        least_s, most_s: between what the work took, in seconds.
        cores: of the machine.
        busy_s: how long all cores together worked meanwhile, None where that is unknown.
    """

    least_s: float
    most_s: float
    cores: int = 1
    busy_s: float | None = None

    @staticmethod
    def around(wall_s: float, cores: int, busy_s: float | None) -> Clock:
        """From the word to begin until the worker said that it had ended."""
        least = wall_s - max(_SLACK_S, _SLACK_SHARE * wall_s)
        return Clock(max(0.0, least), wall_s, cores, busy_s)

    def bounded(self, said: object) -> tuple[float, str]:
        """The seconds that a worker says it took, within what this clock allows, and a note if
        they were not."""
        took = _amount(said)
        if took is not None and self.least_s <= took <= self.most_s:
            return took, ""
        note = f"it said that it took {brief(said)} s, and {self.most_s:.3g} s passed"
        return min(max(took or 0.0, self.least_s), self.most_s), note

    def load(self, cpu_s: float | None) -> float | None:
        """How many cores were busy with something else, None where that cannot be told."""
        if self.busy_s is None or cpu_s is None:
            return None
        return max(0.0, self.busy_s - cpu_s) / self.most_s


def set_up_of(message: Message, path: Array | None, clock: Clock) -> SetUp:
    """What a worker says of setting up, or of getting ready for a problem's scene.

    Raises:
        ValueError, KeyError, TypeError: it makes no sense.
    """
    fault = message["status"] or ""
    if fault not in ("", *_OF_SETUPS):
        raise ValueError(f"{brief(fault)} is no outcome of setting up")
    seconds, _note = clock.bounded(message["setup_s"])
    train_s = _amount(message.get("train_s")) or 0.0
    return SetUp(fault, storable(message["error"]), seconds, train_s)


def attempt_of(message: Message, path: Array | None, clock: Clock) -> Attempt:
    """What a worker says of an attempt.

    Raises:
        ValueError, KeyError, TypeError: it makes no sense.
    """
    status = message["status"]
    if status not in _OF_ATTEMPTS:
        status = Status(status).value
    stats = json.loads(message["stats"])
    if not isinstance(stats, dict):
        raise TypeError(f"stats are a dict, not a {type(stats).__name__}")
    seconds, of_time = clock.bounded(message["solve_s"])
    notes = [str(message["error"]), of_time, *_left_out(stats)]
    most_cpu_s = clock.cores * (clock.most_s + _SLACK_S)
    cpu_s = _amount(message["cpu_s"], most_cpu_s)
    return Attempt(
        status,
        seconds,
        path,
        storable("\n".join(filter(None, notes))),
        stats,
        _amount(message["peak_memory_mb"]),
        cpu_s,
        clock.load(cpu_s),
        _amount(message["attempt_memory_mb"]),
    )


def _left_out(stats: dict[str, Any]) -> Iterator[str]:
    """Takes what cannot be read out of `stats`; a note for each."""
    for name in _COUNTS:
        count = stats.get(name)
        if count is not None and not _is_count(count):
            del stats[name]
            yield f"{name} {brief(count)} is left out: it is no count that can be stored"
    history = stats.get("cost_history")
    if history is not None and readable_history(history) is None:
        del stats["cost_history"]
        yield f"cost_history {brief(history)} is left out: it is no list of [seconds, cost]"


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= _MOST_INTEGER


def _amount(value: object, most: float = math.inf) -> float | None:
    """A finite number from 0 to `most`, or None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if not 0 <= value <= min(most, 1e300):
        return None
    return float(value)


def storable(text: object) -> str:
    """A text that databases and terminals take: what is no character is written as in Python's
    literals, and the middle of a very long one is left out."""
    said = str(text)
    if len(said) > _MOST_TEXT:
        said = f"{said[: _MOST_TEXT // 2]} [...] {said[-_MOST_TEXT // 2 :]}"
    return said.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


LAST_WORDS_S = 2.0
"""For a process that ends itself at the hard limit to say where it hung."""

_PREPARES_S = 60.0  # for a process to be ready for what is timed
_FOLLOWS_S = 60.0  # for the answer to come once what is timed has ended


class Exchange:
    """Where it has got to.

    Before a worker begins with what is timed it says that it is ready and waits for a word, and it
    says so when that has ended. What it does before and after is on nobody's clock, and the
    harness sleeps in between.

    Args:
        limit_s: for what is timed.

    Attributes:
        until: when the next message must have come, on `time.monotonic`.
    """

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._marks: list[str] = []
        self._begun = monotonic()
        self._took_s = 0.0
        self._busy_before: float | None = None
        self._busy_s: float | None = None
        self.until = self._begun + max(limit_s, _PREPARES_S) + LAST_WORDS_S

    def note(self, mark: str, connection: socket.socket) -> None:
        """What a worker says on the way, each word once.

        Raises:
            ValueError: it says anything else.
            OSError: it has gone.
        """
        now = monotonic()
        self._marks.append(mark)
        if self._marks == [protocol.READY]:
            self._busy_before = machine.busy_s()
            self._begun = monotonic()
            self.until = self._begun + self._limit_s + LAST_WORDS_S
            protocol.send(connection, {"mark": protocol.GO})
        elif self._marks == [protocol.READY, protocol.ENDED]:
            self._took_s = now - self._begun
            self._busy_s = machine.since(self._busy_before, self._took_s)
            self.until = now + _FOLLOWS_S
        else:
            raise ValueError(f"{mark!r} at the wrong time")

    @property
    def spent_s(self) -> float:
        """So far; of what is timed, if it has come to that."""
        return self._took_s or monotonic() - self._begun

    @property
    def overdue(self) -> bool:
        """Whether what is timed goes on for too long."""
        return self._marks == [protocol.READY] and self.spent_s >= self._limit_s

    @property
    def clock(self) -> Clock:
        """What the harness saw of the time that it took."""
        if not self._took_s:  # it says what kept it from beginning
            return Clock(0.0, self.spent_s)
        return Clock.around(self._took_s, psutil.cpu_count() or 1, self._busy_s)
