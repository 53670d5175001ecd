"""Numbers that describe a path: pure functions of its waypoints (k, size) in a space."""

from __future__ import annotations

import numpy as np

from envs.problem import Array
from envs.spaces import Space

MOST_PIECES = 100_000
"""In which a path is divided for integrals along it."""

_SHORTEST_STEP = 1e-9
"""The judge's idea of rounding: shorter steps have no direction."""


def pieces(space: Space, waypoints: Array, spacing: float) -> tuple[Array, Array]:
    """The path divided along its shortest ways into pieces no longer than `spacing`, or
    `MOST_PIECES` of them of one length: the middle of each (n, size), and its length (n,).

    Args:
        spacing: by the space's distance.
    """
    lengths = space.distance(waypoints[:-1], waypoints[1:])
    counts = np.maximum(np.ceil(lengths / spacing), 1)
    if counts.sum() > MOST_PIECES:
        return _equal_pieces(space, waypoints, lengths)
    number = counts.astype(int)
    segment = np.repeat(np.arange(len(lengths)), number)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(number) - number, number)
    t = (place + 0.5) / number[segment]
    middles = space.interpolate(waypoints[segment], waypoints[segment + 1], t)
    return middles, (lengths / number)[segment]


def _equal_pieces(space: Space, waypoints: Array, lengths: Array) -> tuple[Array, Array]:
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    places = (np.arange(MOST_PIECES) + 0.5) / MOST_PIECES * along[-1]
    # Each segment begins at or before its place and ends after it; of a path of no length any will
    # do.
    segment = np.minimum(np.searchsorted(along, places, side="right") - 1, len(lengths) - 1)
    t = (places - along[segment]) / np.where(lengths[segment] > 0, lengths[segment], 1)
    middles = space.interpolate(waypoints[segment], waypoints[segment + 1], t)
    return middles, np.full(MOST_PIECES, along[-1] / MOST_PIECES)


def turns(space: Space, waypoints: Array) -> tuple[Array, Array]:
    """The angles (m,) in radians by which the path turns at its inner waypoints, and the sums (m,)
    of the lengths of the two segments that meet there. Directions are those of the weighted
    velocities. Steps that are as short as rounding are left out; a path of fewer than two others
    has no turns."""
    steps = space.difference(waypoints[:-1], waypoints[1:]) * space.weights
    lengths = space.distance(waypoints[:-1], waypoints[1:])
    long = lengths > _SHORTEST_STEP
    steps, lengths = steps[long], lengths[long]
    if len(steps) < 2:
        return np.zeros(0), np.zeros(0)
    directions = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    before, after = directions[:-1], directions[1:]
    # Twice the angle's half by its tangent: exact for small turns, where arccos is not.
    angles: Array = 2 * np.arctan2(
        np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1)
    )
    return angles, lengths[:-1] + lengths[1:]


def smoothness(space: Space, waypoints: Array) -> float:
    """OMPL's `PathGeometric::smoothness`: the sum over inner waypoints of (2 angle / (a + b))^2,
    angle being the turn there and a, b the lengths of the segments that meet. 0 is straight."""
    angles, lengths = turns(space, waypoints)
    return float(((2 * angles / lengths) ** 2).sum())


def greatest_turn(space: Space, waypoints: Array) -> float:
    """The greatest turn at an inner waypoint, in degrees; 0 if there is none."""
    angles, _ = turns(space, waypoints)
    return float(np.degrees(angles.max(initial=0.0)))
