"""Continuous collision checking by conservative advancement.

The clearance c(q) changes by no more than the robot moves. If no point of the robot moves faster
than `bound` per unit of t along the motion a + t (b - a), then a clearance c at t proves
everything within |s - t| < c / bound to be free: the motion is covered by such intervals instead
of being sampled, so nothing thin can slip between two samples.

Both functions keep half the tolerance in hand, which is far above the rounding of a distance
query.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Sequence

from envs.problem import Array

Clearance = Callable[[Array], float]


def segment_is_free(
    clearance: Clearance, a: Array, b: Array, bound: float, tolerance: float
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
    """
    step = b - a
    uncovered = deque([(0.0, 1.0)])
    while uncovered:
        low, high = uncovered.popleft()
        middle = (low + high) / 2
        distance = clearance(a + middle * step)
        if distance <= tolerance:
            return False
        reach = distance - tolerance / 2
        if reach < bound * (high - low) / 2:
            uncovered.append((low, middle - reach / bound))
            uncovered.append((middle + reach / bound, high))
    return True


def path_min_clearance(
    clearance: Clearance, waypoints: Array, bounds: Sequence[float], tolerance: float
) -> float:
    """The least clearance along a path of waypoints (k, d), at most `tolerance` above the truth.

    Stops early at a configuration whose clearance is <= tolerance and returns that. A result
    above `tolerance` is a proof that the whole path is free.

    A Piyavskii-Shubert search: between two known clearances the clearance cannot fall below
    where the two cones of slope `bound` meet; the interval with the lowest such point is split
    there until none can be lower than what was found by more than the tolerance.

    Args:
        clearance: (d,) -> signed distance to the obstacles, in workspace units.
        bounds: k - 1 bounds on the speed of any point of the robot, one a segment.
        tolerance: in workspace units.
    """
    known = [clearance(q) for q in waypoints]
    least = min(known)
    if least <= tolerance:
        return least

    intervals: list[tuple[float, int, float, float, float, float]] = []

    def add(segment: int, low: float, high: float, at_low: float, at_high: float) -> None:
        lowest = (at_low + at_high - bounds[segment] * (high - low)) / 2
        if lowest < floor():
            heapq.heappush(intervals, (lowest, segment, low, high, at_low, at_high))

    def floor() -> float:
        return max(least - tolerance, tolerance / 2)

    for segment in range(len(bounds)):
        add(segment, 0.0, 1.0, known[segment], known[segment + 1])
    while intervals:
        lowest, segment, low, high, at_low, at_high = heapq.heappop(intervals)
        if lowest >= floor():
            break
        a, b = waypoints[segment], waypoints[segment + 1]
        meeting = (low + high) / 2 + (at_low - at_high) / (2 * bounds[segment])
        # Rounding may put the meeting point on an end, where splitting would gain nothing.
        t = min(max(meeting, low + 0.05 * (high - low)), high - 0.05 * (high - low))
        distance = clearance(a + t * (b - a))
        least = min(least, distance)
        if distance <= tolerance:
            return distance
        add(segment, low, t, at_low, distance)
        add(segment, t, high, distance, at_high)
    return least
