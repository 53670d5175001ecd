"""Neural expansion, contraction and replanning on one problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.seeding import stream
from planners.base import Budget
from planners.mpnet.contraction import contracted
from planners.mpnet.expansion import Expander

_MOST_STEPS = 8
"""Of one expansion. Most motions that can be joined at all are after two or three."""

_REPLANS = 3
"""Of one path, before a new one is begun."""

_MORE_DROPOUT, _MOST_DROPOUT = 0.05, 0.5
"""Added for each attempt, up to the published share: else attempts would be too much alike."""


Between = Callable[[Array, Array], list[Array]]
"""Makes a path of waypoints (d,) between two configurations, both included."""


class Search:
    """The search for one problem's path; the same for equal problems, as long as time allows.

    A path is a list of waypoints (d,) from start to goal whose motions may be infeasible: open.

    Attributes:
        attempts: paths begun.
        replans: motions replanned by the network.
    """

    def __init__(
        self,
        env: Environment,
        model: CollisionModel,
        expander: Expander,
        problem: Problem,
        budget: Budget,
    ) -> None:
        self._lower, self._upper = env.lower, env.upper
        self._model = model
        self._expander = expander
        self._problem = problem
        self._budget = budget
        self._rng = stream("mpnet dropout", problem.seed)
        self._dropout = expander.dropout
        self._known: dict[tuple[bytes, bytes], bool] = {}
        self.attempts = 0
        self.replans = 0

    def stats(self) -> dict[str, Any]:
        """JSON data on how it went."""
        return {"attempts": self.attempts, "replans": self.replans}

    def is_free(self, a: Array, b: Array) -> bool:
        """Whether the straight motion from a to b (d,) is proved free; asks once."""
        motion = a.tobytes(), b.tobytes()
        if motion not in self._known:
            self._known[motion] = self._model.segment_is_free(a, b)
        return self._known[motion]

    def is_open(self, path: Sequence[Array]) -> bool:
        """Whether a motion of the path is not proved free."""
        return not all(self.is_free(a, b) for a, b in pairwise(path))

    def attempt(self) -> list[Array]:
        """A new path, contracted, its infeasible motions replanned up to `_REPLANS` times."""
        self.attempts += 1
        more = _MORE_DROPOUT * (self.attempts - 1)
        self._dropout = min(self._expander.dropout + more, _MOST_DROPOUT)
        path = contracted(self._expanded(self._problem.start, self._problem.goal), self.is_free)
        for _ in range(_REPLANS):
            if self._budget.remaining() <= 0 or not self.is_open(path):
                break
            path = self.mended(path, self._replanned)
        return path

    def mended(self, path: Sequence[Array], between: Between) -> list[Array]:
        """A path without its waypoints in collision, with `between` instead of motions that are
        infeasible, contracted."""
        # Nearer to an obstacle than the tolerance, no motion to or from it would be accepted.
        safe = [q for q in path[1:-1] if self._model.clearance(q) > self._model.tolerance]
        beacons = [path[0], *safe, path[-1]]
        whole = [beacons[0]]
        for a, b in pairwise(beacons):
            whole.extend([b] if self.is_free(a, b) else between(a, b)[1:])
        return contracted(whole, self.is_free)

    def _expanded(self, start: Array, goal: Array) -> list[Array]:
        """Steps from both ends in turn, each towards the other's last, until a free motion joins
        them or there were too many."""
        trees = [start], [goal]
        for step in range(_MOST_STEPS):
            if self.is_free(trees[0][-1], trees[1][-1]):
                break
            grown, other = trees[step % 2], trees[1 - step % 2]
            grown.append(self._next(grown[-1], other[-1]))
            if self._budget.remaining() <= 0:
                break
        return [*trees[0], *reversed(trees[1])]

    def _replanned(self, a: Array, b: Array) -> list[Array]:
        self.replans += 1
        return self._expanded(a, b)

    def _next(self, current: Array, goal: Array) -> Array:
        ahead = self._expander.next(current, goal, self._rng, self._dropout)
        return np.clip(ahead, self._lower, self._upper)
