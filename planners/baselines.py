"""Baselines: what any planner should beat."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from envs import Environment, Problem
from envs.collision.fcl_model import PLANNING_TOLERANCE
from envs.problem import Array
from envs.seeding import stream
from planners.base import Budget, Planner, PlannerResult, Status

_LEAD_S = 0.01  # before the deadline, for a check that has begun
_MOST_DETOURS = 3


class StraightLine(Planner):
    """The straight motion from start to goal, if it is free: says how many problems are none."""

    improves = False

    def setup(self, env: Environment, *, seed: int) -> None:
        self._env = env
        self._model = env.collision_model(PLANNING_TOLERANCE)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        checks = self._model.checks
        status, path = self._solved(problem, budget)
        return PlannerResult(status, path, {"collision_checks": self._model.checks - checks})

    def _solved(self, problem: Problem, budget: Budget) -> tuple[Status, Array | None]:
        path = [problem.start, problem.goal]
        if self._is_free(path):
            return Status.EXACT_SOLUTION, np.array(path)
        return Status.APPROXIMATE_SOLUTION, np.array(path)

    def _is_free(self, path: Sequence[Array]) -> bool:
        return all(self._model.segment_is_free(a, b) for a, b in pairwise(path))


class RandomDetours(StraightLine):
    """The straight motion, or else by way of one to three random configurations, until that is
    free or the time is over."""

    def _solved(self, problem: Problem, budget: Budget) -> tuple[Status, Array | None]:
        rng = stream("random detours", problem.seed)
        lower, upper = self._env.free_bounds
        path = [problem.start, problem.goal]
        while budget.remaining() > _LEAD_S:
            if self._is_free(path):
                return Status.EXACT_SOLUTION, np.array(path)
            size = (rng.integers(1, _MOST_DETOURS + 1), self._env.dimension)
            path = [problem.start, *rng.uniform(lower, upper, size), problem.goal]
        return Status.TIMEOUT, None
