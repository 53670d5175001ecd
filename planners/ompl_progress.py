"""How an OMPL planner's best path gets shorter."""

from __future__ import annotations

import math
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
        self._cost: Any = None
        self._next = math.inf

    def begin(self, planner: Any) -> None:
        """Starts a new history of [seconds, path length] for `planner`."""
        properties = planner.getPlannerProgressProperties()
        # Not a mapping to Python: iterating it gives entries, not names.
        names = list(properties.keys())
        best = next((name for name in names if name.startswith("best cost")), None)
        self._cost = properties[best] if best else None
        self.history = []
        self._begin = perf_counter()
        self._next = self._begin if best else math.inf

    def tick(self) -> None:
        """Notes an improvement, at most every hundredth of a second."""
        if perf_counter() >= self._next:
            self._note()

    def end(self) -> None:
        """Notes the last improvement and lets go of the planner."""
        if self._cost is not None:
            self._note()
        self._cost, self._next = None, math.inf

    def _note(self) -> None:
        now = perf_counter()
        self._next = now + self._INTERVAL_S
        cost = float(self._cost())
        if math.isfinite(cost) and (not self.history or cost < self.history[-1][1]):
            self.history.append([now - self._begin, cost])
