"""The same simplifier for every planner's paths, so that their lengths compare: what shortcuts make
of a path is no merit of the planner's."""

from __future__ import annotations

import threading
from time import perf_counter

from bench.judging.metric import Simplified
from envs import Environment, Problem
from envs.problem import Array
from planners.compiled.shortcuts import Shortener, Waypoints

_ENOUGH = 8
"""Rounds of shortcuts in a row that gain nothing, after which a path is taken to be as short as it
becomes."""


_ONE_AT_A_TIME = threading.Lock()
"""Of a run's judges, each in a thread of its own. Environments may share a robot, whose tables of
what was proved (`envs.robots.pair_tables`) proofs write to, and compiled code does not wait for
Python's lock."""


class Simplifier:
    """Simplifies valid paths by random shortcuts, proved like all motions (Geraerts and Overmars
    2007).

    Args:
        seconds: for each path at most.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._last: tuple[Environment, Shortener | None] | None = None

    def __call__(self, env: Environment, problem: Problem, path: Array) -> Simplified | None:
        """A valid path (k, d) of a problem, simplified; None where an environment has no compiled
        proofs of motions.

        Args:
            env: the scene of the problem.
        """
        shortener = self._shortener(env)
        if shortener is None:
            return None
        waypoints, without = Waypoints.of(path, problem.seed), 0
        with _ONE_AT_A_TIME:
            begin = perf_counter()
            while without < _ENOUGH and perf_counter() - begin < self._seconds:
                without = 0 if shortener.improve(waypoints) else without + 1
            return Simplified(waypoints.path, perf_counter() - begin)

    def _shortener(self, env: Environment) -> Shortener | None:
        if self._last is None or self._last[0] is not env:
            has_proofs = env.motion_check(env.planning_tolerance) is not None
            self._last = env, Shortener(env) if has_proofs else None
        return self._last[1]
