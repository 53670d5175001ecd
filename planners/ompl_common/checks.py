"""What OMPL asks of us, and how long the answers took."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING, Any

from envs.problem import Array
from planners.ompl_common.progress import Progress

if TYPE_CHECKING:
    from envs.collision.fcl_model import CollisionModel


class Checks:
    """States by an environment's FCL model, motions by its certified segment check.

    Args:
        values: the configuration (d,) of a state of OMPL's.
        model: that proves.
        progress: is told of every question.

    Attributes:
        seconds: that all answers took, in Python.
        margin: from what is near, for states; 0 for none.
        ends_iterations: whether no motion is proved any more when time is over, so that an
            iteration that asks about many ends.
    """

    def __init__(
        self, values: Callable[[Any], Array], model: CollisionModel, progress: Progress
    ) -> None:
        self._values, self._model, self._progress = values, model, progress
        self._deadline = math.inf
        self.margin = 0.0
        self.ends_iterations = False
        self.seconds = 0.0

    def stop_at(self, deadline: float) -> None:
        """When the planner's time is over, on `time.perf_counter`."""
        self._deadline = deadline

    def of_state(self, state: Any) -> bool:
        """Whether a state of OMPL's touches nothing, by the margin where there is one."""
        begin = perf_counter()
        self._progress.tick(begin)
        q = self._values(state)
        free = self._model.keeps(q, self.margin) if self.margin else self._model.may_plan_at(q)
        self.seconds += perf_counter() - begin
        return free

    def of_motion(self, a: Any, b: Any) -> bool:
        """Whether the shortest motion between two states of OMPL's, one of which it has found to be
        valid, is proved free."""
        begin = perf_counter()
        self._progress.tick(begin)
        if self.ends_iterations and begin > self._deadline:
            return False
        free = self._model.stays_free(self._values(a), self._values(b))
        self.seconds += perf_counter() - begin
        return free

    def of_edge(self, a: Array, b: Array) -> bool:
        """As `of_motion`, of configurations (d,) neither of which need be valid."""
        return self._model.segment_is_free(a, b)
