"""The progress of a planner's best path."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import Any


class Progress:
    """Best path length over time, read from the planner whenever it checks a state or a motion.

    Read in the planner's own thread: PRM* evaluates its termination condition in a second one,
    from which no Python may be called.
    """

    _INTERVAL_S = 0.01

    def __init__(self) -> None:
        self.history: list[list[float]] = []
        self._cost: Callable[[], Any] | None = None
        self._next = math.inf
        self._action: Callable[[], None] | None = None
        self._action_at = math.inf

    def begin(self, cost: Callable[[], Any] | None) -> None:
        """Starts a new history of [seconds, path length].

        Args:
            cost: gives the best so far, as a number or the text of one; None if nobody knows.
        """
        self._cost = cost
        self.history = []
        self._begin = perf_counter()
        self._next = math.inf if cost is None else self._begin

    def at(self, time: float, action: Callable[[], None]) -> None:
        """Has the planner's own thread do something once, when it first checks a state or a motion
        after `time`, on `time.perf_counter`."""
        self._action, self._action_at = action, time

    def tick(self, now: float) -> None:
        """Notes an improvement, at most every hundredth of a second; `now` is of
        `time.perf_counter`."""
        if now >= self._next:
            self._note()
        if self._action is not None and now >= self._action_at:
            action, self._action = self._action, None
            action()

    def end(self) -> None:
        """Notes the last improvement and lets go of the planner."""
        self._action = None
        if self._cost is not None:
            self._note()
        self._cost, self._next = None, math.inf

    def _note(self) -> None:
        assert self._cost is not None
        now = perf_counter()
        self._next = now + self._INTERVAL_S
        cost = float(self._cost())
        if math.isfinite(cost) and (not self.history or cost < self.history[-1][1]):
            self.history.append([now - self._begin, cost])
