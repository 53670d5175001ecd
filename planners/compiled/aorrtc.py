"""AORRTC: RRT-Connect again and again, each time for a shorter path, without Python in its loop."""

from __future__ import annotations

import math
from functools import partial
from time import perf_counter

from envs import Environment, Problem
from envs.compiled import compiled_for
from envs.problem import Array
from planners.base import Budget, PlannerResult, Status
from planners.compiled.bounded_search import search_below
from planners.compiled.rrt_connect import SAMPLES, CompiledRrtConnect, grown, stats_of
from planners.compiled.shortcuts import Shortener, Waypoints
from planners.compiled.trees import Trees

_LEAD_S = 0.005
"""Before the deadline, for handing over the path."""

_OPTIMAL = 1 + 1e-9
"""A path is taken to be straight that is no longer than this times the distance of its ends."""


class Aorrtc(CompiledRrtConnect):
    """AORRTC (Wilson, Thomason, Kingston and Gammell 2025), all of it compiled, with proofs of all
    motions: RRT-Connect's first path is made shorter by shortcuts, then searches follow in which
    nodes have costs, each for a path shorter than the best. It converges to the optimum.

    As far as time is not looked at, the same seed gives the same paths.

    Args:
        range: the longest motion, in the environment's unit; by default a tenth of its extent.

    Raises:
        InputError: the range is not above 0.
    """

    improves = True

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        self._env_space = env.sampling_space
        known = self._check, self._space, self._trees
        self._search_below = compiled_for(search_below, *known, self._step, SAMPLES, 1.0)
        self._shortener = Shortener(env)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        begin = perf_counter()
        trees, path = self._first_solution(problem, budget)
        if path is None:
            return PlannerResult(Status.TIMEOUT, None, stats_of(trees))
        least = self._env_space.distance(problem.start[None], problem.all_goals).min()
        progress, searches = _Progress(budget, begin), 1
        while path is not None:
            self._improve(Waypoints.of(path, problem.seed + searches), progress)
            if progress.ends(least):
                break
            trees.cut()
            searches += 1
            more = partial(self._grow, bound=progress.length)
            trees, path = grown(trees, more, progress.may_go_on)
        stats = stats_of(trees) | {"searches": searches, "cost_history": progress.history}
        return PlannerResult(Status.EXACT_SOLUTION, progress.path, stats)

    def _grow(self, trees: Trees, bound: float) -> int:
        return self._search_below(self._check, self._space, trees, self._step, SAMPLES, bound)

    def _improve(self, path: Waypoints, progress: _Progress) -> None:
        """Notes a path that is free, and what shortcuts make of it, until some in a row gain
        nothing."""
        progress.note(self._shortener.length(path), path)
        while progress.may_improve() and self._shortener.improve(path):
            progress.note(self._shortener.length(path), path)


class _Progress:
    """The best path so far, and whether there is time for a better one.

    Args:
        budget: of the attempt.
        begin: when that began, on `time.perf_counter`.
    """

    def __init__(self, budget: Budget, begin: float) -> None:
        self._budget, self._begin = budget, begin
        self._last, self._longest = perf_counter(), 0.0
        self.length = math.inf
        self.path: Array | None = None
        self.history: list[list[float]] = []

    def note(self, length: float, path: Waypoints) -> None:
        """Keeps a path, if it is the best."""
        if length < self.length:
            self.length, self.path = length, path.path
            self.history.append([perf_counter() - self._begin, length])

    def may_improve(self) -> bool:
        """Whether the path is longer than it has to be, and there is time."""
        return self.length > self._budget.stop_cost and self.may_go_on()

    def may_go_on(self) -> bool:
        """Whether work that takes twice as long as the longest so far, from one call to the next,
        would end before the deadline: later its path would not count."""
        now = perf_counter()
        self._longest, self._last = max(self._longest, now - self._last), now
        return now + 2 * self._longest + _LEAD_S < self._budget.deadline

    def ends(self, least: float) -> bool:
        """Whether there is nothing to improve, as no path is shorter than `least`, or no time."""
        return self.length <= _OPTIMAL * least or not self.may_improve()
