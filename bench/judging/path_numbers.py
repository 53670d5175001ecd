"""Numbers that describe a path: pure functions of its waypoints (k, d)."""

from __future__ import annotations

import numpy as np

from envs.problem import Array

MOST_PIECES = 100_000
"""In which a path is divided for integrals along it."""

_SHORTEST_STEP = 1e-9
"""The judge's idea of rounding: shorter steps have no direction."""


def path_length(waypoints: Array) -> float:
    """The sum of the Euclidean lengths of the segments, in the unit of the configurations."""
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())


def pieces(waypoints: Array, spacing: float) -> tuple[Array, Array]:
    """The path divided into straight pieces no longer than `spacing`, or `MOST_PIECES` of them of
    one length: the middle of each (n, d), and its length (n,).

    Args:
        spacing: in the unit of the configurations.
    """
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    counts = np.maximum(np.ceil(lengths / spacing), 1)
    if counts.sum() > MOST_PIECES:
        return _equal_pieces(waypoints, lengths)
    number = counts.astype(int)
    segment = np.repeat(np.arange(len(steps)), number)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(number) - number, number)
    t = (place + 0.5) / number[segment]
    return waypoints[segment] + t[:, None] * steps[segment], (lengths / number)[segment]


def _equal_pieces(waypoints: Array, lengths: Array) -> tuple[Array, Array]:
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    places = (np.arange(MOST_PIECES) + 0.5) / MOST_PIECES * along[-1]
    middles = np.column_stack([np.interp(places, along, axis) for axis in waypoints.T])
    return middles, np.full(MOST_PIECES, along[-1] / MOST_PIECES)


def turns(waypoints: Array) -> tuple[Array, Array]:
    """The angles (m,) in radians by which the path turns at its inner waypoints, and the sums (m,)
    of the lengths of the two segments that meet there. Steps that are as short as rounding are left
    out; a path of fewer than two others has no turns."""
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    long = lengths > _SHORTEST_STEP
    steps, lengths = steps[long], lengths[long]
    if len(steps) < 2:
        return np.zeros(0), np.zeros(0)
    directions = steps / lengths[:, None]
    before, after = directions[:-1], directions[1:]
    # Twice the angle's half by its tangent: exact for small turns, where arccos is not.
    angles: Array = 2 * np.arctan2(
        np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1)
    )
    return angles, lengths[:-1] + lengths[1:]


def smoothness(waypoints: Array) -> float:
    """OMPL's `PathGeometric::smoothness`: the sum over inner waypoints of (2 angle / (a + b))^2,
    angle being the turn there and a, b the lengths of the segments that meet. 0 is straight."""
    angles, lengths = turns(waypoints)
    return float(((2 * angles / lengths) ** 2).sum())


def greatest_turn(waypoints: Array) -> float:
    """The greatest turn at an inner waypoint, in degrees; 0 if there is none."""
    angles, _ = turns(waypoints)
    return float(np.degrees(angles.max(initial=0.0)))
