"""Neural expansion, contraction and replanning on one problem."""

from __future__ import annotations

from collections.abc import Sequence
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

_MOST_STEPS = 40
"""Of one expansion."""

_REPLANS = 8
"""Of one path, before a new one is begun."""


class Search:
    """The search for one problem's path; the same for equal problems, as long as time allows.

    A path is a list of waypoints (d,) from start to goal whose motions may be infeasible: open.

    Attributes:
        attempts: paths begun.
        replans: motions replanned by the network.
        fallbacks: motions that another planner was asked for.
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
        self._known: dict[tuple[bytes, bytes], bool] = {}
        self.attempts = 0
        self.replans = 0
        self.fallbacks = 0

    def stats(self) -> dict[str, Any]:
        """JSON data on how it went."""
        return {
            "attempts": self.attempts,
            "replans": self.replans,
            "fallbacks": self.fallbacks,
        }

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
        path = contracted(self._expanded(self._problem.start, self._problem.goal), self.is_free)
        for _ in range(_REPLANS):
            if self._budget.remaining() <= 0 or not self.is_open(path):
                break
            path = contracted(self._replanned(path), self.is_free)
        return path

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

    def _replanned(self, path: Sequence[Array]) -> list[Array]:
        """A path without its waypoints in collision, the network's waypoints between those whose
        motion is infeasible."""
        inner = [q for q in path[1:-1] if self._model.is_valid(q)]
        beacons = [path[0], *inner, path[-1]]
        whole = [beacons[0]]
        for a, b in pairwise(beacons):
            if self.is_free(a, b):
                whole.append(b)
                continue
            self.replans += 1
            whole.extend(self._expanded(a, b)[1:])
        return whole

    def _next(self, current: Array, goal: Array) -> Array:
        return np.clip(self._expander.next(current, goal, self._rng), self._lower, self._upper)
