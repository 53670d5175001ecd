"""Paths made shorter by random shortcuts, compiled, with proofs of all motions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.collision.motion_check import motion_is_free_either_way
from envs.compiled import compiled_for, njit_cached, njit_hot
from envs.compiled_space import distance, go, space_arrays, uniform
from envs.problem import Array

_TRIES = 32
"""Shortcuts that are tried between two looks at the clock."""

_LEAST_GAIN = 1e-6
"""Of a shortcut, as a share of the path: less is not worth a proof."""


class Waypoints(NamedTuple):
    """A path that is being changed.

    Attributes:
        places: (n, size), the first of which are its waypoints.
        used: (1,) how many these are.
        state: (1,) of the random numbers.
    """

    places: Array
    used: NDArray[np.int64]
    state: NDArray[np.uint64]

    @staticmethod
    def of(path: Array, seed: int) -> Waypoints:
        """Those of a path (k, size), with room for twice as many and some more."""
        places = np.empty((2 * len(path) + 16, path.shape[1]))
        places[: len(path)] = path
        return Waypoints(places, np.array([len(path)]), np.array([seed], np.uint64))

    @property
    def path(self) -> Array:
        """(k, size), a copy."""
        path: Array = self.places[: self.used[0]].copy()
        return path


class Shortener:
    """Shortens paths in an environment that has compiled proofs of motions.

    Args:
        env: the environment, to whose `planning_tolerance` motions are proved.

    Raises:
        ValueError: it has no such proofs.
    """

    def __init__(self, env: Environment) -> None:
        space = env.sampling_space
        check = env.motion_check(env.planning_tolerance)
        if check is None:
            raise ValueError("there are no compiled proofs of motions")
        self._kept = check
        self._known = check.compiled, space_arrays(space)
        some = Waypoints.of(np.zeros((2, space.size)), 1)
        self._shorten = compiled_for(shorten, *self._known, some, _TRIES)
        self._length = compiled_for(length, self._known[1], some)

    def length(self, path: Waypoints) -> float:
        """In the environment's unit."""
        return self._length(self._known[1], path)

    def improve(self, path: Waypoints) -> int:
        """Tries some shortcuts; how many were taken."""
        return self._shorten(*self._known, path, _TRIES)


@njit_hot
def length(space: Any, path: Any) -> float:
    """Of `Waypoints`, by the space's distance."""
    total = 0.0
    for n in range(path.used[0] - 1):
        total += distance(space, path.places[n], path.places[n + 1])
    return total


@njit_cached
def shorten(check: Any, space: Any, path: Any, tries: int) -> int:
    """Joins two random places of a path by a straight motion where that is free, so many times
    (Geraerts and Overmars 2007, "Creating high-quality paths for motion planning").

    What is left of the motions about a shortcut is part of motions that were proved free.

    Args:
        check: see `motion_is_free`.
        path: `Waypoints`, which are changed; of motions that are free.

    Returns:
        How many shortcuts were taken.
    """
    size = path.places.shape[1]
    begin, end = np.empty(size), np.empty(size)
    taken, total = 0, length(space, path)
    for _ in range(tries):
        low, high = uniform(path.state) * total, uniform(path.state) * total
        low, high = min(low, high), max(low, high)
        first = _place(space, path, low, begin)
        last = _place(space, path, high, end)
        more = first + 2 - last  # waypoints than before
        if first == last or path.used[0] + more > len(path.places):
            continue
        gain = high - low - distance(space, begin, end)
        if gain <= _LEAST_GAIN * total or not motion_is_free_either_way(check, begin, end):
            continue
        _replace(path, first, last, begin, end)
        taken, total = taken + 1, length(space, path)
    return taken


@njit_hot
def _place(space: Any, path: Any, along: float, q: Any) -> int:
    """Writes the configuration (size,) at a length along a path; the number of its motion."""
    last = path.used[0] - 2
    for n in range(last + 1):
        away = distance(space, path.places[n], path.places[n + 1])
        if along <= away or n == last:
            t = min(along / away, 1.0) if away > 0 else 0.0
            go(space, path.places[n], path.places[n + 1], t, q)
            return n
        along -= away
    return int(last)


@njit_cached
def _replace(path: Any, first: int, last: int, begin: Any, end: Any) -> None:
    """Puts two places for all waypoints between those of two motions."""
    count, more = path.used[0], first + 2 - last
    if more > 0:  # the later ones first, so that none is lost
        for n in range(count - 1, last, -1):
            path.places[n + more] = path.places[n]
    else:
        for n in range(last + 1, count):
            path.places[n + more] = path.places[n]
    path.places[first + 1], path.places[first + 2] = begin, end
    path.used[0] = count + more
