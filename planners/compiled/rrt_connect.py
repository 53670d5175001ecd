"""RRT-Connect without Python in its loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from envs import Environment, InputError, Problem
from envs.compiled import compiled_for
from envs.compiled_space import space_arrays
from envs.problem import Array
from planners.base import Budget, Planner, PlannerResult, Status
from planners.compiled.search import search
from planners.compiled.trees import FULL, JOINED, Trees

_SHARE_OF_EXTENT = 0.1
"""The longest motion by default: half of OMPL's, with which arms of seven joints and more come out
of narrow places sooner, and others about as soon."""

_ROOM = 1024
"""Nodes of each tree, at first."""

SAMPLES = 64
"""Between two looks at the clock."""


class CompiledRrtConnect(Planner):
    """RRT-Connect (Kuffner and LaValle 2000), all of it compiled: samples, nearest neighbours, and
    the proofs that motions are free. The same seed gives the same path.

    Args:
        range: the longest motion, in the environment's unit; by default a tenth of its extent.

    Raises:
        InputError: the range is not above 0.
    """

    improves = False

    def __init__(self, range: float | None = None) -> None:
        if range is not None and not 0 < range < math.inf:
            raise InputError(f"range must be above 0 and finite, not {range}")
        self._range = range

    def unsupported(self, env: Environment) -> str | None:
        if env.motion_check(env.planning_tolerance) is None:
            return "its motions are checked in Python, which a compiled planner cannot ask"
        return None

    def setup(self, env: Environment, *, seed: int) -> None:
        check = env.motion_check(env.planning_tolerance)
        assert check is not None, "see `unsupported`"
        self._kept, self._check = check, check.compiled
        space = env.sampling_space
        self._space = space_arrays(space)
        self._step = float(self._range or _SHARE_OF_EXTENT * space.extent)
        self._trees = Trees.with_room(_ROOM, space.size)
        self._search = compiled_for(
            search, self._check, self._space, self._trees, self._step, SAMPLES
        )

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        trees, path = self._first_solution(problem, budget)
        if path is None:
            return PlannerResult(Status.TIMEOUT, None, stats_of(trees))
        return PlannerResult(Status.EXACT_SOLUTION, path, stats_of(trees))

    def _first_solution(self, problem: Problem, budget: Budget) -> tuple[Trees, Array | None]:
        """The trees in which it was found, and the path (k, d), or None if time was up."""
        trees, goals = self._trees, problem.all_goals
        while trees.room <= len(goals):
            trees = trees.enlarged()
        trees.begin(problem.start, goals, problem.seed)

        def more(trees: Trees) -> int:
            return self._search(self._check, self._space, trees, self._step, SAMPLES)

        return grown(trees, more, lambda: budget.remaining() > 0)


def grown(
    trees: Trees, more: Callable[[Trees], int], may_go_on: Callable[[], bool]
) -> tuple[Trees, Array | None]:
    """Grows trees, and makes larger ones where they are full, until they are joined.

    Args:
        trees: with roots.
        more: grows them by some samples, and says where the search is.
        may_go_on: whether there is time.

    Returns:
        The trees, and the path (k, d) by which they are joined; None if they are not.
    """
    while True:
        found = more(trees)
        if found == JOINED:
            return trees, trees.path[: trees.waypoints[0]].copy()
        if found == FULL:
            trees = trees.enlarged()
        if not may_go_on():
            return trees, None


def stats_of(trees: Trees) -> dict[str, Any]:
    """What attempts keep of a search."""
    return {"samples": int(trees.samples[0]), "nodes": int(trees.counts.sum())}
