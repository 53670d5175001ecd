"""The progress of a planner's best path."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import Any

_INTERVAL_S = 0.01
"""Seconds from one look at the best path to the next."""


class Progress:
    """Best path length over time, read from the planner whenever it checks a state or a motion.

    Read in the planner's own thread: PRM* evaluates its termination condition in a second one,
    from which no Python may be called.
    """

    def __init__(self) -> None:
        self.history: list[list[float]] = []
        self._cost: Callable[[], Any] | None = None
        self._next = math.inf
        self._action: Callable[[], None] | None = None
        self._action_at = math.inf

    def begin(self, cost: Callable[[], Any] | None, keen: bool = False) -> None:
        """Starts a new history of [seconds, path length].

        Args:
            cost: gives the best so far, as a number or the text of one; None if nobody knows.
            keen: whether it is read at every question until there is a path.
        """
        self._cost, self._keen = cost, keen
        self._enough = -math.inf
        self.history = []
        self._begin = perf_counter()
        self._next = math.inf if cost is None else self._begin

    def at(self, time: float, action: Callable[[], None]) -> None:
        """Has the planner's own thread do something once, when it first checks a state or a motion
        after `time`, on `time.perf_counter`."""
        self._action, self._action_at = action, time

    def when_below(self, cost: float, action: Callable[[], None]) -> None:
        """Has the planner's own thread do something whenever the best path is seen to be no longer
        than `cost`."""
        self._enough, self._when_enough = cost, action

    def tick(self, now: float) -> None:
        """Notes an improvement, at most every so often; `now` is of `time.perf_counter`."""
        if now >= self._next:
            self._note()
        if self._action is not None and now >= self._action_at:
            action, self._action = self._action, None
            action()

    def end(self) -> None:
        """Notes the last improvement and lets go of the planner."""
        self._action, self._enough = None, -math.inf
        if self._cost is not None:
            self._note()
        self._cost, self._next = None, math.inf

    def _note(self) -> None:
        assert self._cost is not None
        now = perf_counter()
        cost = float(self._cost())
        waits = math.isfinite(cost) or not self._keen
        self._next = now + _INTERVAL_S if waits else now
        if math.isfinite(cost) and (not self.history or cost < self.history[-1][1]):
            self.history.append([now - self._begin, cost])
        if math.isfinite(cost) and cost <= self._enough:
            self._when_enough()
