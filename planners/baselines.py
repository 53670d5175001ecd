"""Planners that hardly plan: what any other must beat for its problems to be worth the name."""

from __future__ import annotations

import numpy as np

from envs import Environment, Problem
from envs.problem import Array
from planners.base import Budget, Planner, PlannerResult, Status

_MOST_PLACES = 3  # on the way
_LEAD_S = 0.01  # before the deadline, for the check that is under way


class _Proposer(Planner):
    """Proposes paths, and returns the first that the certified check proves."""

    improves = False

    def setup(self, env: Environment, *, seed: int) -> None:
        self._space = env.sampling_space
        self._model = env.collision_model(env.planning_tolerance)
        self._checks_before = 0

    def _begin(self) -> None:
        self._checks_before = self._model.checks

    def _is_free(self, path: Array) -> bool:
        return all(map(self._model.segment_is_free, path, path[1:]))

    def _result(self, status: Status, path: Array | None = None) -> PlannerResult:
        return PlannerResult(
            status, path, {"collision_checks": self._model.checks - self._checks_before}
        )


class StraightLine(_Proposer):
    """The straight line from start to goal, claimed if it is free."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self._begin()
        line = np.array([problem.start, problem.goal])
        if self._is_free(line):
            return self._result(Status.EXACT_SOLUTION, line)
        return self._result(Status.APPROXIMATE_SOLUTION, line)


class RandomDetours(_Proposer):
    """The straight line, or a way by one to three uniformly random places, whichever is free
    first."""

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        self._begin()
        rng = np.random.default_rng(problem.seed)
        path = np.array([problem.start, problem.goal])
        while budget.remaining() > _LEAD_S:
            if self._is_free(path):
                return self._result(Status.EXACT_SOLUTION, path)
            detour = self._space.sample(rng, int(rng.integers(1, _MOST_PLACES + 1)))
            path = np.array([problem.start, *detour, problem.goal])
        return self._result(Status.TIMEOUT)
