"""The metrics: one entry each, in the order of the tables.

What is added here, or by `registered`, is computed for every verified solution, kept in records,
and shown by every table, chart, comparison and report.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from bench.judging.metric import (
    CONFIGURATION_UNIT,
    DIFFERENCE,
    HIGHER,
    LOWER,
    WORKSPACE_UNIT,
    Metric,
    SolvedAttempt,
    defined,
)
from bench.judging.path_numbers import greatest_turn, pieces, smoothness
from bench.judging.traversal import traversal_time
from envs import Environment, InputError, Problem
from envs.problem import Array

_PIECES_OF_EXTENT = 1000
"""Integrals along a path are summed in pieces no longer than this part of the space's extent, which
in R^n is the diagonal of the bounds."""


class _Clearances(threading.local):
    """Of the path that was last looked at in a thread: two metrics need them, and they cost most of
    judging."""

    def __init__(self) -> None:
        self._of: tuple[Environment, Array] | None = None
        self._found: tuple[Array, Array] = np.zeros(0), np.zeros(0)

    def along(self, env: Environment, path: Array) -> tuple[Array, Array]:
        """Clearances (n,) in workspace units at the middles of pieces, and the pieces' lengths."""
        if self._of is None or self._of[0] is not env or self._of[1] is not path:
            space = env.space
            middles, lengths = pieces(space, path, space.extent / _PIECES_OF_EXTENT)
            # A path that is measured is on the right side of everything.
            self._found = env.surface_clearance(middles), lengths
            self._of = env, path
        return self._found


_CLEARANCES = _Clearances()


def _time(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float | None:
    return attempt.solve_s


def _length(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float:
    return env.space.length(path)


def _margin(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float:
    return attempt.safety_margin


def _first_time(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    history = attempt.cost_history
    return float(history[0, 0]) if len(history) else None


def _travel_time(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float:
    """The integral of ds / S*(q), S* being the speed of equation 3."""
    clearances, lengths = _CLEARANCES.along(env, path)
    return float((lengths / env.speed_model(clearances)).sum())


def _mean_clearance(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float:
    """The integral of the clearance along the path, by its length; of a path of no length, the
    clearance where it stands."""
    clearances, lengths = _CLEARANCES.along(env, path)
    whole = lengths.sum()
    return float(clearances @ lengths / whole) if whole > 0 else float(clearances.mean())


def _smoothness(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float:
    return smoothness(env.space, path)


def _waypoints(env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt) -> float:
    return len(path)


def _greatest_turn(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float:
    return greatest_turn(env.space, path)


def _duration(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    limits = env.velocity_limits
    return None if limits is None else traversal_time(env.space.unwrapped(path), limits)


def _length_over_known(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    known = env.known_length(problem)
    return env.space.length(path) / known if known else None


def _callback_share(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    """What a planner says of it; another one's time is all its own, as far as anybody knows."""
    spent = attempt.stats.get("callback_s")
    if isinstance(spent, bool) or not isinstance(spent, int | float) or not attempt.solve_s:
        return None
    share = 100 * spent / attempt.solve_s
    return share if 0 <= share <= 100 else None


def _simplified_length(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    return None if attempt.simplified is None else env.space.length(attempt.simplified.path)


def _simplify_time(
    env: Environment, problem: Problem, path: Array, attempt: SolvedAttempt
) -> float | None:
    return None if attempt.simplified is None else attempt.simplified.seconds


SHORT = {"safety_margin": "margin", "time_s": "time"}
"""Names of metrics on the command line and in baselines that are shorter than the metrics' own."""

METRICS = (
    Metric("time_s", "time", "s", 3, LOWER, _time, timed=True, primary=True),
    Metric("length", "length", CONFIGURATION_UNIT, 2, LOWER, _length, primary=True),
    Metric(
        *("safety_margin", "safety margin", WORKSPACE_UNIT, 2, HIGHER, _margin),
        effect=DIFFERENCE,
        primary=True,
    ),
    Metric("first_solution_s", "first solution", "s", 3, LOWER, _first_time, timed=True),
    Metric("travel_time", "travel time", "at speed S*", 2, LOWER, _travel_time),
    Metric("mean_clearance", "mean clearance", WORKSPACE_UNIT, 2, HIGHER, _mean_clearance),
    Metric("smoothness", "smoothness", "", 3, LOWER, _smoothness),
    Metric("greatest_turn", "greatest turn", "deg", 1, LOWER, _greatest_turn),
    Metric("waypoints", "waypoints", "", 1, LOWER, _waypoints),
    Metric("duration_s", "duration", "s", 2, LOWER, _duration),
    Metric(
        *("length_over_known", "length / known", "", 3, LOWER, _length_over_known),
    ),
    Metric(
        *("callback_share", "callback", "%", 0, LOWER, _callback_share),
        effect=DIFFERENCE,
        timed=True,
    ),
    Metric(
        *("simplified_length", "simplified length", CONFIGURATION_UNIT, 2, LOWER),
        _simplified_length,
    ),
    Metric("simplify_s", "simplify", "s", 3, LOWER, _simplify_time, timed=True),
)
"""This program's own."""

RESERVED = (
    *("success", "blocked_length", "cpu_share", "versions"),
    *("claimed_time_s", "claimed_solve_s", "planned_elsewhere"),
)
"""Names of what is compared beside metrics, of other means and medians in summaries, and of what
stands beside metrics in records."""

TITLES = (
    *("env", "planner", "problems", "invalid", "n"),
    *("success", "setup", "training", "offline", "outcomes"),
)
"""Of what tables have beside metrics, without units."""


class _Registered:
    """All metrics by name: this program's, and those that users add."""

    def __init__(self) -> None:
        self._metrics = {metric.name: metric for metric in METRICS}

    def __iter__(self) -> Iterator[Metric]:
        return iter(tuple(self._metrics.values()))

    def add(self, metric: Metric, taken: Sequence[str]) -> None:
        """Raises InputError if there is another of its name, or something else in tables."""
        if metric.name in self._metrics or metric.name in (*RESERVED, *taken):
            raise InputError(
                f"metric {metric.name!r} of {metric.origin}: the name is taken; choose another"
            )
        if metric.title in (*TITLES, *(other.title for other in self)):
            raise InputError(
                f"metric {metric.name!r} of {metric.origin}: the title {metric.title!r} is taken; "
                "choose another"
            )
        self._metrics[metric.name] = metric

    def remove(self, metric: Metric) -> None:
        """Of those that were added."""
        del self._metrics[metric.name]


REGISTERED = _Registered()


@contextmanager
def registered(metrics: Sequence[Metric], taken: Sequence[str] = ()) -> Iterator[None]:
    """Adds metrics as long as the context lasts.

    Args:
        taken: further names that they must not have, as columns of records.

    Raises:
        InputError: a name is taken.
    """
    added = []
    try:
        for metric in metrics:
            REGISTERED.add(metric, taken)
            added.append(metric)
        yield
    finally:
        for metric in added:
            REGISTERED.remove(metric)


def known_metrics(definitions: Sequence[dict[str, Any]] = ()) -> tuple[Metric, ...]:
    """All registered ones, and those that runs have values of by these definitions."""
    found = {metric.name: metric for metric in REGISTERED}
    for definition in definitions:
        if definition.get("name") not in found:
            metric = defined(definition)
            taken = {other.title for other in found.values()}
            found[metric.name] = (
                replace(metric, title=metric.name) if metric.title in taken else metric
            )
    return tuple(found.values())
