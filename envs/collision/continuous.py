"""Continuous collision checking by conservative advancement, of one motion and of many paths.

The clearance c(q) changes by no more than the robot moves. If no point of the robot moves faster
than `bound` per unit of t along the motion a + t (b - a), then a clearance c at t proves
everything within |s - t| < c / bound to be free: the motion is covered by such intervals instead
of being sampled, so nothing thin can slip between two samples. If the clearances at both ends of a
motion add up to more than the robot moves between, all of it is free.

The checks of one motion keep half the tolerance in hand, which is far above the rounding of a
distance query. They differ in the order in which they ask: `is_covered` where a collision would be
found early, for Python and for compiled code; `path_min_clearance` where the clearance may be
least; `paths_are_free` at the middles of what is left of many paths, all at once; and
`first_contact.first_contact` from start to goal.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_inline
from envs.problem import Array
from envs.spaces import Space

Clearance = Callable[[Array], float]

ClearanceUpTo = Callable[[Array, float], float]
"""((d,), most) -> the clearance, or `most` where that is less."""

Between = Callable[[Array, Array, float], Array]
"""(a, b, t) -> the configuration (d,) at t of the motion from a to b, see `Space.between`."""


def straight(a: Array, b: Array, t: float) -> Array:
    """The motion of the numbers themselves."""
    found: Array = a + t * (b - a)
    return found


PlaceBelow = Callable[[Array, Array, float], float]
"""(a, b, level) -> a place t of the motion from a to b at which the clearance may be about the
level or less, or -1 where it is proved to be more all along."""

FIRST_QUERIES = 10_000
"""How many waypoints of a path are asked about in any case, if it has so many."""

_Interval = tuple[float, int, int, float, float, float, float]
"""How low the clearance can fall in it, and its place; see `_Search._add`."""

DEFAULT_TOLERANCE = 1e-3


def segment_is_free(
    clearance: Clearance,
    a: Array,
    b: Array,
    bound: float,
    tolerance: float,
    between: Between = straight,
) -> bool:
    """Whether the motion from a to b (d,) is proved free of collision.

    True is a proof that the clearance exceeds tolerance / 2 everywhere on the segment, both ends
    included. False means that some configuration on it has a clearance <= tolerance.

    Middles of uncovered parts are asked first, breadth first: short free motions cost one query
    and collisions are found early.

    Args:
        clearance: (d,) -> signed distance to the obstacles, in workspace units.
        bound: on the speed of any point of the robot, workspace units per unit of t.
        tolerance: in workspace units.
        between: the motion.
    """

    def room_at(_motion: None, t: float) -> float:
        distance = clearance(between(a, b, t))
        return -1.0 if distance <= tolerance else distance - tolerance / 2

    return is_covered(room_at, None, bound)


def is_covered(room_at: Any, motion: Any, bound: float) -> bool:
    """Whether a motion, t in [0, 1], is covered by intervals in which nothing can be touched.

    Middles of uncovered parts are asked first, breadth first. `compiled_is_covered` is the same
    for compiled code, part of its callers, which give it a compiled function.

    Args:
        room_at: (motion, t) -> how far the robot may surely move from where it is at t, or
            something negative where it must not be.
        motion: whatever `room_at` wants to know.
        bound: on how far it moves per unit of t, as `room_at` counts.
    """
    low, high = [0.0], [1.0]
    asked = 0
    while asked < len(low):
        begin, end = low[asked], high[asked]
        middle = (begin + end) / 2
        room = room_at(motion, middle)
        if room < 0:
            return False
        if room < bound * (end - begin) / 2:
            low.append(begin)
            high.append(middle - room / bound)
            low.append(middle + room / bound)
            high.append(end)
        asked += 1
    return True


compiled_is_covered = njit_inline(is_covered)


class UndecidedError(Exception):
    """The queries that were allowed do not decide whether a path is free."""


def path_min_clearance(
    clearance: ClearanceUpTo,
    waypoints: Array,
    bounds: Sequence[float],
    tolerance: float,
    most_queries: float = math.inf,
    between: Between = straight,
    place_below: PlaceBelow | None = None,
) -> float:
    """The least clearance along a path of waypoints (k, d), at most `tolerance` above the truth.

    Stops early at a configuration whose clearance is <= tolerance and returns that. A result
    above `tolerance` is a proof that the whole path is free.

    A Piyavskii-Shubert search: between two known clearances the clearance cannot fall below
    where the two cones of slope `bound` meet; the interval with the lowest such point is split
    there until none can be lower than what was found by more than the tolerance. Of very many
    waypoints it begins with some, evenly among them, and asks about others where it has to.

    Without more queries the result may be below the least clearance.

    Args:
        clearance: ((d,), most) -> signed distance to the obstacles, in workspace units, or `most`
            where that is less.
        bounds: k - 1 bounds on the speed of any point of the robot, one a segment.
        tolerance: in workspace units.
        most_queries: how often `clearance` may be asked. A motion along which no point travels
            farther than `reach` is decided by about FIRST_QUERIES + 2 reach / tolerance.
        between: the motion from each waypoint to the next.
        place_below: quick proofs that spare most of the search, and say where to look else; the
            clearance in the middle of what is proved is asked all the same. None for none.

    Raises:
        UndecidedError: that was not enough.
    """
    search = _Search(clearance, waypoints, bounds, tolerance, most_queries, between, place_below)
    return search.least()


class _Search:
    """See `path_min_clearance`."""

    def __init__(
        self,
        clearance: ClearanceUpTo,
        waypoints: Array,
        bounds: Sequence[float],
        tolerance: float,
        most_queries: float,
        between: Between,
        place_below: PlaceBelow | None,
    ) -> None:
        self._place_below = place_below
        self._clearance = clearance
        self._between = between
        self._waypoints = waypoints
        self._bounds = bounds
        self._along = np.concatenate([[0.0], np.cumsum(bounds)])  # at most so far, by waypoint
        self._tolerance = tolerance
        self._left = most_queries
        self._least = math.inf
        self._intervals: list[_Interval] = []

    def least(self) -> float:
        """The least clearance, or one that refutes the path."""
        last = len(self._waypoints) - 1
        stride = max(1, math.ceil(last / FIRST_QUERIES))
        knots = [*range(0, last, stride), last]
        known = [self._at(self._waypoints[i], math.inf) for i in knots]
        if self._least <= self._tolerance:
            return self._least
        for (begin, end), ends in zip(pairwise(knots), pairwise(known), strict=True):
            self._add(begin, end - 1, 0.0, 1.0, *ends)
        while self._intervals:
            interval = heapq.heappop(self._intervals)
            lowest = interval[0]
            if lowest >= self._floor():
                break
            if self._left <= 0:
                return self._so_far(lowest)
            self._split(*interval[1:])
            if self._least <= self._tolerance:
                break
        return self._least

    def _so_far(self, lowest: float) -> float:
        """What is proved, when nothing is lower than `lowest`."""
        if lowest < self._tolerance / 2:
            raise UndecidedError
        return min(self._least, lowest + self._tolerance)

    def _at(self, q: Array, reach: float) -> float:
        """The clearance at a configuration (d,), as far as it matters to what is within `reach`,
        which is all above the floor if the clearance is by as much."""
        if self._left <= 0:
            raise UndecidedError
        self._left -= 1
        distance = self._clearance(q, self._floor() + reach)
        self._least = min(self._least, distance)
        return distance

    def _floor(self) -> float:
        return max(self._least - self._tolerance, self._tolerance / 2)

    def _add(
        self, first: int, last: int, low: float, high: float, at_low: float, at_high: float
    ) -> None:
        """Notes an interval from `low` on segment `first` to `high` on segment `last`, if it is to
        be looked at; of several segments it holds the whole."""
        lowest = (at_low + at_high - self._reach(first, last, low, high)) / 2
        if lowest < self._floor():
            interval = (lowest, first, last, low, high, at_low, at_high)
            heapq.heappush(self._intervals, interval)

    def _reach(self, first: int, last: int, low: float, high: float) -> float:
        if first == last:
            return self._bounds[first] * (high - low)
        return float(self._along[last + 1] - self._along[first])

    def _split(
        self, first: int, last: int, low: float, high: float, at_low: float, at_high: float
    ) -> None:
        """Asks where the cones meet, or a proof fails; among several segments, at a waypoint near
        there. What is proved to be above the floor is left."""
        if first == last:
            a, b = self._waypoints[first], self._waypoints[first + 1]
            meeting = (low + high) / 2 + (at_low - at_high) / (2 * self._bounds[first])
            if self._place_below is not None:
                ends = self._between(a, b, low), self._between(a, b, high)
                share = self._place_below(*ends, self._floor())
                if share < 0:
                    self._at(self._between(a, b, (low + high) / 2), self._tolerance)
                    return
                meeting = low + share * (high - low)
            # It may be at an end, where splitting would gain nothing.
            t = min(max(meeting, low + 0.05 * (high - low)), high - 0.05 * (high - low))
            distance = self._at(self._between(a, b, t), self._reach(first, last, low, high))
            self._add(first, last, low, t, at_low, distance)
            self._add(first, last, t, high, distance, at_high)
            return
        reach = self._reach(first, last, low, high)
        share = min(max((reach + at_low - at_high) / (2 * reach), 0.05), 0.95)
        place = self._along[first] + share * reach
        middle = int(np.searchsorted(self._along, place))
        middle = min(max(middle, first + 1), last)
        distance = self._at(self._waypoints[middle], reach)
        self._add(first, middle - 1, 0.0, 1.0, at_low, distance)
        self._add(middle, last, 0.0, 1.0, distance, at_high)


def paths_are_free(
    clearance: Callable[[Array], Array],
    rate_bound: float,
    paths: Sequence[Array],
    tolerance: float,
    space: Space,
) -> NDArray[np.bool_]:
    """Which paths are proved free of collision, (n,) of bool.

    True is a proof that the clearance exceeds tolerance / 2 all along the path. False means that
    it is <= tolerance somewhere.

    Args:
        clearance: (n, d) -> (n,), in workspace units; never more than the true one.
        rate_bound: how far any point of the robot moves per unit of configuration distance.
        paths: each (k, d).
        space: whose shortest ways join their waypoints, and whose distances these are.
    """
    free = np.ones(len(paths), dtype=bool)
    if not paths:
        return free
    owner = np.repeat(np.arange(len(paths)), [len(path) for path in paths])
    points = np.concatenate(paths)
    known = clearance(points)
    free[owner[known <= tolerance]] = False
    inner = owner[:-1] == owner[1:]
    owner = owner[:-1][inner]
    a, b = points[:-1][inner], points[1:][inner]
    at_a, at_b = known[:-1][inner], known[1:][inner]
    while True:
        # Clearance falls from either end by no more than points move, so that it is nowhere less
        # than (at_a + at_b - moved) / 2. Motions of which that says too little are halved.
        moved = rate_bound * space.distance(a, b)
        uncertain = (at_a + at_b - tolerance < moved) & free[owner]
        if not uncertain.any():
            return free
        owner, a, b, at_a, at_b = (x[uncertain] for x in (owner, a, b, at_a, at_b))
        middle = space.middle(a, b)
        at_middle = clearance(middle)
        free[owner[at_middle <= tolerance]] = False
        owner = np.concatenate([owner, owner])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        at_a, at_b = np.concatenate([at_a, at_middle]), np.concatenate([at_middle, at_b])
