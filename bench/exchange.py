"""One question to a worker and its answer, on the harness's clock."""

from __future__ import annotations

import socket
from time import monotonic

import psutil

from bench import load, wire
from bench.answer import Clock

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
        if self._marks == [wire.READY]:
            self._busy_before = load.busy_s()
            self._begun = monotonic()
            self.until = self._begun + self._limit_s + LAST_WORDS_S
            wire.send(connection, {"mark": wire.GO})
        elif self._marks == [wire.READY, wire.ENDED]:
            self._took_s = now - self._begun
            self._busy_s = load.since(self._busy_before, self._took_s)
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
        return self._marks == [wire.READY] and self.spent_s >= self._limit_s

    @property
    def clock(self) -> Clock:
        """What the harness saw of the time that it took."""
        if not self._took_s:  # it says what kept it from beginning
            return Clock(0.0, self.spent_s)
        return Clock.around(self._took_s, psutil.cpu_count() or 1, self._busy_s)
