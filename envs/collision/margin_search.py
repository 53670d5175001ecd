"""The search for the least clearance along a path, once for Python and for compiled code.

A Piyavskii-Shubert search: between two known clearances the clearance cannot fall below where the
two cones of slope `bound` meet; the interval with the lowest such point is split there until none
can be lower than what was found by more than the tolerance.
"""

from __future__ import annotations

import heapq
import math
from typing import Any

import numpy as np

from envs.collision.ball_distances import ball_to_shapes, none_nearest, room_for_ball
from envs.collision.distance_fields import to_boxes
from envs.compiled import njit_cached, njit_hot, njit_inline

FIRST_QUERIES = 10_000
"""How many waypoints of a path are asked about in any case, if it has so many."""

NO_PROOFS = -2.0


def least_clearance(
    clearance: Any, place_below: Any, path: Any, bounds: Any, tolerance: float, most_queries: float
) -> tuple[float, bool]:
    """The least clearance along a path, see `continuous.path_min_clearance`, and whether the
    queries that were allowed have decided about it. `compiled_least_clearance` is the same for
    compiled code, part of its callers.

    Args:
        clearance: (path, n, t, most) -> the clearance at t of segment n, or at waypoint n where t
            is 0; `most` where that is less.
        place_below: (path, n, low, high, level) -> a share of the part from low to high of segment
            n, at which the clearance may be about the level or less; -1 where it is proved to be
            more all along, `NO_PROOFS` where there are no such proofs.
        path: whatever these two want to know.
        bounds: (k - 1,) on the speed of any point of the robot, by segment.
    """
    last = len(bounds)
    along = np.zeros(last + 1)  # at most so far, by waypoint
    for n in range(last):
        along[n + 1] = along[n] + bounds[n]
    stride = max(1, math.ceil(last / FIRST_QUERIES))
    least, left = math.inf, most_queries
    # How low the clearance can fall, first and last segment (of several it holds the whole), from
    # where on the first to where on the last, and the clearances at these two.
    intervals = [(0.0, 0, 0, 0.0, 0.0, 0.0, 0.0)]
    intervals.pop()
    known, begin = 0.0, -1
    for knot in range(0, last + stride, stride):
        n = min(knot, last)
        if left <= 0:
            return least, False
        left -= 1
        found = clearance(path, n, 0.0, math.inf)
        least = min(least, found)
        if begin >= 0 and n > begin:
            first, until = begin, n - 1
            reach = bounds[first] if first == until else along[until + 1] - along[first]
            intervals.append(((known + found - reach) / 2, first, until, 0.0, 1.0, known, found))
        known, begin = found, n
    if least <= tolerance:
        return least, True
    heapq.heapify(intervals)
    while len(intervals) > 0:
        lowest, first, until, low, high, at_low, at_high = heapq.heappop(intervals)
        floor = max(least - tolerance, tolerance / 2)
        if lowest >= floor:
            break
        if left <= 0:
            if lowest < tolerance / 2:
                return least, False
            return min(least, lowest + tolerance), True
        left -= 1
        if first < until:  # at a waypoint near where the cones meet
            reach = along[until + 1] - along[first]
            share = min(max((reach + at_low - at_high) / (2 * reach), 0.05), 0.95)
            place = along[first] + share * reach
            middle = min(max(int(np.searchsorted(along, place)), first + 1), until)
            found = clearance(path, middle, 0.0, floor + reach)
            before = (first, middle - 1, 0.0, 1.0, at_low, found)
            behind = (middle, until, 0.0, 1.0, found, at_high)
        else:
            # Where the cones meet, or a proof fails.
            reach = bounds[first] * (high - low)
            t = (low + high) / 2 + (at_low - at_high) / (2 * bounds[first])
            share = place_below(path, first, low, high, floor)
            if share >= 0:
                t = low + share * (high - low)
            elif share > NO_PROOFS:  # what is proved is left, but for its middle
                found = clearance(path, first, (low + high) / 2, floor + tolerance)
                least = min(least, found)
                if least <= tolerance:
                    break
                continue
            # It may be at an end, where splitting would gain nothing.
            t = min(max(t, low + 0.05 * (high - low)), high - 0.05 * (high - low))
            found = clearance(path, first, t, floor + reach)
            before = (first, first, low, t, at_low, found)
            behind = (first, first, t, high, found, at_high)
        least = min(least, found)
        if least <= tolerance:
            break
        floor = max(least - tolerance, tolerance / 2)
        for first, until, low, high, at_low, at_high in (before, behind):
            reach = along[until + 1] - along[first]
            if first == until:
                reach = bounds[first] * (high - low)
            lowest = (at_low + at_high - reach) / 2
            if lowest < floor:
                heapq.heappush(intervals, (lowest, first, until, low, high, at_low, at_high))
    return least, True


compiled_least_clearance = njit_inline(least_clearance)


@njit_cached
def least_among_boxes(
    waypoints: Any,
    bounds: Any,
    boxes: Any,
    radius: float,
    tolerance: float,
    most_queries: float,
    near: float,
    asked: Any,
) -> tuple[float, bool, int, int]:
    """`least_clearance` of a ball whose middle goes straight between waypoints (k, 3) among boxes,
    `distance_fields.box_arrays`; and at how many configurations it was asked, and found above 0
    and no more than `near`: the first of these are written to `asked` (m, 4), each with what it
    is."""
    count = np.zeros(2, dtype=np.int64)
    path = waypoints, boxes, radius, near, asked, count
    least, decided = compiled_least_clearance(
        _to_boxes, _no_proofs, path, bounds, tolerance, most_queries
    )
    return least, decided, count[0], count[1]


@njit_cached
def least_among_shapes(
    waypoints: Any,
    bounds: Any,
    ball: Any,
    around: Any,
    tolerance: float,
    most_queries: float,
    near: float,
    asked: Any,
) -> tuple[float, bool, int, int]:
    """As `least_among_boxes`, of a ball, which is the only one of `Shapes`, among others."""
    count = np.zeros(2, dtype=np.int64)
    nearest, place = none_nearest(around), np.empty(3)
    path = waypoints, ball, around, nearest, place, room_for_ball(), near, asked, count
    least, decided = compiled_least_clearance(
        _to_shapes, _no_proofs, path, bounds, tolerance, most_queries
    )
    return least, decided, count[0], count[1]


@njit_hot
def _to_boxes(path: Any, n: int, t: float, most: float) -> float:
    waypoints, boxes, radius, near, asked, count = path
    x, y, z = _place(waypoints, n, t)
    found = to_boxes(x, y, z, boxes[0], boxes[1]) - radius
    _note(asked, count, near, x, y, z, found)
    return float(min(found, most))


@njit_cached
def _to_shapes(path: Any, n: int, t: float, most: float) -> float:
    waypoints, ball, around, nearest, place, room, near, asked, count = path
    x, y, z = _place(waypoints, n, t)
    place[0], place[1], place[2] = x, y, z
    found = ball_to_shapes(ball, around, nearest, place, room, most)
    _note(asked, count, near, x, y, z, found)
    return float(found)


@njit_hot
def _place(waypoints: Any, n: int, t: float) -> tuple[float, float, float]:
    """Where the middle of the ball is."""
    x, y, z = waypoints[n, 0], waypoints[n, 1], waypoints[n, 2]
    if t > 0.0:
        x += t * (waypoints[n + 1, 0] - x)
        y += t * (waypoints[n + 1, 1] - y)
        z += t * (waypoints[n + 1, 2] - z)
    return x, y, z


@njit_hot
def _note(asked: Any, count: Any, near: float, x: float, y: float, z: float, found: float) -> None:
    """Counts what was asked, (2,), and writes it down with what was found, if that is above 0 and
    no more than `near`."""
    count[0] += 1
    if not 0.0 < found <= near:
        return
    if count[1] < len(asked):
        row = asked[count[1]]
        row[0], row[1], row[2], row[3] = x, y, z, found
    count[1] += 1


@njit_hot
def _no_proofs(_path: Any, _n: int, _low: float, _high: float, _level: float) -> float:
    return NO_PROOFS
