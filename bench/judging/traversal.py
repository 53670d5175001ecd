"""How long the fastest traversal of a path takes within limits of velocity and acceleration.

By TOPP-RA, see `time_optimal`. At a corner of a polyline any motion must stop, so corners are
rounded first, by an arc that stays so close to the path that it makes no other difference.
"""

from __future__ import annotations

import numpy as np

from bench.judging.time_optimal import greatest_speeds
from envs.problem import Array

ROUNDING = 0.01
"""How far from a corner the rounded path may be, in the unit of the configurations."""

RISE_S = 0.5
"""Accelerations are limited to what reaches the limit of velocity in this time, in seconds: URDF
states limits of velocity, but none of acceleration."""

_SHORTEST = 1e-9  # steps that are as short as rounding have no direction
_INTERVALS = 1000
"""In each of which the acceleration is constant: about so many along the path, and in each arc and
straight piece at least `_PER_PIECE`, fewer where there are so many pieces that this would take
seconds. Against a grid eight times as fine times are 0.1 to 3 % too long for paths such as planners
give, 7 % for a random walk of 50 waypoints."""

_PER_PIECE = 16
_MOST_IN_PIECES = 4000


class RoundedPath:
    """A polyline whose corners are arcs of parabolas, by its arc's parameter from 0 to `end`; its
    first derivative is continuous and of unit length on straight pieces.

    A corner's arc is the quadratic Bezier curve from h before the corner to h behind it, along the
    two segments, with the corner as its middle control point. From parameter 0 to 2 h its
    derivative leads from one direction to the other in a straight line. At its middle it is
    h |d1 - d0| / 4 from the corner, which is the farthest.

    Args:
        waypoints: (k, d), no two in a row equal, k at least 2.
        rounding: how far the arcs may be from their corners.

    Attributes:
        knots: (m,), where pieces begin and end.
    """

    def __init__(self, waypoints: Array, rounding: float) -> None:
        steps = np.diff(waypoints, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        directions = steps / lengths[:, None]
        reach = self._reaches(directions, lengths, rounding)
        before, behind = np.append(0.0, reach), np.append(reach, 0.0)  # of each segment's ends
        straight = lengths - before - behind
        # Pieces in turn: straight, arc, straight, ..., arc, straight.
        durations = np.zeros(2 * len(lengths) - 1)
        durations[0::2], durations[1::2] = straight, 2 * reach
        self.knots = np.concatenate([[0.0], np.cumsum(durations)])
        self._starts = np.empty((len(durations), waypoints.shape[1]))
        self._starts[0::2] = waypoints[:-1] + before[:, None] * directions
        self._starts[1::2] = waypoints[1:-1] - reach[:, None] * directions[:-1]
        self._velocities = np.repeat(directions, 2, axis=0)[: len(durations)]
        self._curvatures = np.zeros_like(self._starts)
        bends = reach > 0
        change = np.diff(directions, axis=0)
        self._curvatures[1::2][bends] = change[bends] / (2 * reach[bends])[:, None]

    @staticmethod
    def _reaches(directions: Array, lengths: Array, rounding: float) -> Array:
        """How far from inner waypoints arcs begin and end: at most half way to the next."""
        change: Array = np.linalg.norm(np.diff(directions, axis=0), axis=1)
        half = np.minimum(lengths[:-1], lengths[1:]) / 2
        reach: Array = np.minimum(half, 4 * rounding / np.maximum(change, 1e-300))
        return reach

    @property
    def end(self) -> float:
        """The last parameter."""
        return float(self.knots[-1])

    def evaluate(self, s: Array, order: int) -> Array:
        """The configurations (n, d) at parameters (n,), or their first or second derivatives."""
        piece = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self._starts) - 1)
        # Where an arc ends, its limits hold, not those of the straight piece that begins there.
        piece = np.where(
            (piece % 2 == 0) & (piece > 0) & (s == self.knots[piece]), piece - 1, piece
        )
        t = (np.asarray(s) - self.knots[piece])[:, None]
        start, velocity, curvature = (
            part[piece] for part in (self._starts, self._velocities, self._curvatures)
        )
        if order == 0:
            place: Array = start + t * velocity + t**2 / 2 * curvature
            return place
        found: Array = velocity + t * curvature if order == 1 else curvature
        return found


def traversal_time(waypoints: Array, velocities: Array) -> float | None:
    """Seconds that the fastest traversal of a path takes from rest to rest, its corners rounded by
    at most `ROUNDING`; None if none is found.

    Args:
        waypoints: (k, d).
        velocities: (d,), limits of velocity, positive, in the unit of the configurations a second;
            accelerations are limited to velocity by `RISE_S`.
    """
    long = np.linalg.norm(np.diff(waypoints, axis=0), axis=1) > _SHORTEST
    path = waypoints[np.append(True, long)]
    if len(path) < 2:
        return 0.0
    return _fastest(RoundedPath(_corners(path), ROUNDING), velocities)


def _corners(path: Array) -> Array:
    """The waypoints (m, d) at which it turns, and its ends."""
    steps = np.diff(path, axis=0)
    directions = steps / np.linalg.norm(steps, axis=1)[:, None]
    turns = np.linalg.norm(np.diff(directions, axis=0), axis=1) > _SHORTEST
    corners: Array = path[np.concatenate([[True], turns, [True]])]
    return corners


def _fastest(path: RoundedPath, velocities: Array) -> float | None:
    places = _grid(path.knots)
    slopes, bends = path.evaluate(places, 1), path.evaluate(places, 2)
    speeds = greatest_speeds(places, slopes, bends, velocities, velocities / RISE_S)
    # Speeds squared are linear between grid points, so that a piece takes 2 ds / (v0 + v1).
    means = (speeds[:-1] + speeds[1:]) / 2
    return float((np.diff(places) / means).sum()) if (means > 0).all() else None


def _grid(knots: Array) -> Array:
    """Parameters at which the acceleration may change: the ends of pieces, and between them."""
    sizes = np.diff(knots)
    least = np.clip(_MOST_IN_PIECES // len(sizes), 2, _PER_PIECE)
    counts = np.maximum(least, np.ceil(sizes * _INTERVALS / knots[-1])).astype(int)
    piece = np.repeat(np.arange(len(sizes)), counts)
    place = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.unique(np.append(knots[piece] + place / counts[piece] * sizes[piece], knots[-1]))
