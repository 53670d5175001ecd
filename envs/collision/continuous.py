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

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.margin_search import NO_PROOFS, least_clearance
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

    A Piyavskii-Shubert search, see `margin_search`. Of very many waypoints it begins with some,
    evenly among them, and asks about others where it has to.

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

    def at(_path: None, n: int, t: float, most: float) -> float:
        a = waypoints[n]
        return clearance(a if t == 0 else between(a, waypoints[n + 1], t), most)

    def below(_path: None, n: int, low: float, high: float, level: float) -> float:
        if place_below is None:
            return NO_PROOFS
        a, b = waypoints[n], waypoints[n + 1]
        return place_below(between(a, b, low), between(a, b, high), level)

    least, decided = least_clearance(at, below, None, bounds, tolerance, most_queries)
    if not decided:
        raise UndecidedError
    return least


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
