"""Numbers that describe a path, pure functions of waypoints (k, d), and which problems a straight
line does not solve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from envs import Environment, Problem
from envs.problem import Array

MOST_PIECES = 100_000
"""In which a path's time of travel is summed."""


def path_length(waypoints: Array) -> float:
    """The sum of the Euclidean lengths of the segments, in the unit of the configurations."""
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())


def travel_time(waypoints: Array, speed: Callable[[Array], Array], spacing: float) -> float:
    """The time of travel along the path at the speed field S*: the integral of ds / S*(q).

    Midpoint rule with pieces no longer than `spacing`, or `MOST_PIECES` of them.

    Args:
        speed: (n, d) -> (n,), positive.
        spacing: in the unit of the configurations.
    """
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    counts = np.maximum(np.ceil(lengths / spacing), 1)
    if counts.sum() > MOST_PIECES:
        return _time_in_equal_pieces(waypoints, lengths, speed)
    pieces = counts.astype(int)
    segment = np.repeat(np.arange(len(steps)), pieces)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    t = (place + 0.5) / pieces[segment]
    points = waypoints[segment] + t[:, None] * steps[segment]
    return float(((lengths / pieces)[segment] / speed(points)).sum())


def _time_in_equal_pieces(
    waypoints: Array, lengths: Array, speed: Callable[[Array], Array]
) -> float:
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    places = (np.arange(MOST_PIECES) + 0.5) / MOST_PIECES * along[-1]
    points = np.column_stack([np.interp(places, along, axis) for axis in waypoints.T])
    return float((along[-1] / MOST_PIECES / speed(points)).sum())


def smoothness(waypoints: Array) -> float:
    """OMPL's `PathGeometric::smoothness`: the sum over inner waypoints of (2 angle / (a + b))^2,
    angle being the turn there and a, b the lengths of the segments that meet. 0 is straight.

    Steps shorter than 1e-9, the judge's idea of rounding, are left out.
    """
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    long = lengths > 1e-9
    steps, lengths = steps[long], lengths[long]
    if len(steps) < 2:
        return 0.0
    directions = steps / lengths[:, None]
    before, after = directions[:-1], directions[1:]
    # Twice the angle's half by its tangent: exact for small turns, where arccos is not.
    angle = 2 * np.arctan2(
        np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1)
    )
    return float(((2 * angle / (lengths[:-1] + lengths[1:])) ** 2).sum())


BLOCKED, FREE = "B", "F"
"""A letter each, of the problems 0, 1, ..., as runs note them."""


def straight_lines(env: Environment, problems: Sequence[Problem]) -> str:
    """Of each problem whether its straight line is BLOCKED or FREE, by the check that the judge
    has, at its tolerance."""
    model = env.collision_model()
    free = (model.segment_is_free(problem.start, problem.goal) for problem in problems)
    return "".join(FREE if is_free else BLOCKED for is_free in free)


def share_blocked(letters: str) -> float:
    """The share of blocked straight lines, to four digits; 0 without problems."""
    return round(letters.count(BLOCKED) / max(len(letters), 1), 4)
