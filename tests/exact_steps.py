"""How far solids that move are proved to stay apart by balls and boxes about them, compiled: where
coal need not be asked. Nothing here is shared with our own checks but the way it is compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_cached
from envs.problem import Array


class Frames(NamedTuple):
    """Where bodies are, and how fast joints move them, at one time of a motion.

    Attributes:
        turns, shifts: (b, 3, 3) and (b, 3), of the bodies' frames; the first stands still.
        velocities, turning: (m, 3) each, of what is rigidly on each joint: linear, of the point
            that is at the world's origin, and angular, per unit of time.
    """

    turns: Array
    shifts: Array
    velocities: Array
    turning: Array


class Solids(NamedTuple):
    """What solids are, and where on their bodies.

    Attributes:
        bodies: (g,) that they are on.
        turns, shifts: (g, 3, 3) and (g, 3), from their frames to the bodies'.
        middles: (g, 3) of their bounding boxes, in their frames.
        halves: (g, 3) of the sides of these.
        radii: (g,) of balls about the middles that hold the solids.
    """

    bodies: NDArray[np.int64]
    turns: Array
    shifts: Array
    middles: Array
    halves: Array
    radii: Array


class Pairs(NamedTuple):
    """Which solids are asked about.

    Attributes:
        pairs: (p, 2) of solids.
        side_of: (p, 2) which side each of them is.
        sides: (s,) the solids of sides.
        set_of: (s,) which set of joints moves each side, as seen from the other.
        sets: (u, m) of bool, the sets.
    """

    pairs: NDArray[np.int64]
    side_of: NDArray[np.int64]
    sides: NDArray[np.int64]
    set_of: NDArray[np.int64]
    sets: NDArray[np.bool_]


class Places(NamedTuple):
    """Where solids are: their turns (g, 3, 3), and (g, 3) their origins and the middles of their
    bounding boxes."""

    turns: Array
    origins: Array
    centres: Array


@njit_cached
def body_frames(turn: Array, shift: Array, step: Array, about: Array) -> Frames:
    """Of a body at `shift` that slides by `step` and turns `about` itself per unit of time."""
    turns, shifts = np.zeros((2, 3, 3)), np.zeros((2, 3))
    velocities, turning = np.zeros((2, 3)), np.zeros((2, 3))
    for i in range(3):
        turns[0, i, i] = 1.0
    turns[1], shifts[1] = turn, shift
    velocities[0], turning[1] = step, about
    _cross(shift, about, velocities[1])
    return Frames(turns, shifts, velocities, turning)


@njit_cached
def carried_frames(
    base: Frames, turns: Array, shifts: Array, columns: Array, rates: Array
) -> Frames:
    """Of a base, and of what is on it, which is told in its frame.

    Args:
        turns, shifts: (n, 3, 3) and (n, 3), of the bodies on the base.
        columns: (6, n) what a unit speed of each joint on the base does, linear and angular.
        rates: (n,) the joints' speeds.
    """
    n = len(rates)
    every_turn, every_shift = np.empty((2 + n, 3, 3)), np.empty((2 + n, 3))
    velocities, turning = np.empty((2 + n, 3)), np.empty((2 + n, 3))
    every_turn[:2], every_shift[:2] = base.turns, base.shifts
    velocities[:2], turning[:2] = base.velocities, base.turning
    turn, shift = base.turns[1], base.shifts[1]
    moved = np.empty(3)
    for k in range(n):
        for i in range(3):
            every_shift[2 + k, i] = shift[i]
            velocities[2 + k, i] = turning[2 + k, i] = 0.0
            for j in range(3):
                every_shift[2 + k, i] += turn[i, j] * shifts[k, j]
                velocities[2 + k, i] += turn[i, j] * columns[j, k] * rates[k]
                turning[2 + k, i] += turn[i, j] * columns[3 + j, k] * rates[k]
                every_turn[2 + k, i, j] = 0.0
                for m in range(3):
                    every_turn[2 + k, i, j] += turn[i, m] * turns[k, m, j]
        _cross(shift, turning[2 + k], moved)
        velocities[2 + k] += moved
    return Frames(every_turn, every_shift, velocities, turning)


@njit_cached
def place(frames: Frames, solids: Solids) -> Places:
    """Solids where their bodies are."""
    count = len(solids.bodies)
    turns, origins, centres = np.empty((count, 3, 3)), np.empty((count, 3)), np.empty((count, 3))
    for g in range(count):
        body = solids.bodies[g]
        for i in range(3):
            origins[g, i] = frames.shifts[body, i]
            for j in range(3):
                origins[g, i] += frames.turns[body, i, j] * solids.shifts[g, j]
                turns[g, i, j] = 0.0
                for m in range(3):
                    turns[g, i, j] += frames.turns[body, i, m] * solids.turns[g, m, j]
            centres[g, i] = origins[g, i]
            for j in range(3):
                centres[g, i] += turns[g, i, j] * solids.middles[g, j]
    return Places(turns, origins, centres)


@njit_cached
def speeds(frames: Frames, places: Places, pairs: Pairs, solids: Solids) -> Array:
    """Bounds (s,) on the speeds of points of the solids of sides, where they are."""
    sets, joints = pairs.sets.shape
    linear, angular = np.zeros((sets, 3)), np.zeros((sets, 3))
    for u in range(sets):
        for m in range(joints):
            if pairs.sets[u, m]:
                linear[u] += frames.velocities[m]
                angular[u] += frames.turning[m]
    found, at_middle = np.empty(len(pairs.sides)), np.empty(3)
    for s in range(len(pairs.sides)):
        u, solid = pairs.set_of[s], pairs.sides[s]
        _cross(angular[u], places.centres[solid], at_middle)
        for i in range(3):
            at_middle[i] += linear[u, i]
        found[s] = _norm(at_middle) + _norm(angular[u]) * solids.radii[solid]
    return found


@njit_cached
def apart_at_least(a: int, b: int, places: Places, solids: Solids) -> float:
    """How far two solids are apart at least: by balls about them, and by a ball about the one and
    a box about the other."""
    x = places.centres[a, 0] - places.centres[b, 0]
    y = places.centres[a, 1] - places.centres[b, 1]
    z = places.centres[a, 2] - places.centres[b, 2]
    found = math.sqrt(x * x + y * y + z * z) - solids.radii[a] - solids.radii[b]
    for box, ball in ((a, b), (b, a)):
        turn, squares = places.turns[box], 0.0
        for j in range(3):
            along = abs(turn[0, j] * x + turn[1, j] * y + turn[2, j] * z)
            squares += max(along - solids.halves[box, j], 0.0) ** 2
        found = max(found, math.sqrt(squares) - solids.radii[ball])
    return found


@njit_cached
def each_apart_at_least(places: Places, pairs: Pairs, solids: Solids) -> Array:
    """The same of all pairs, (p,)."""
    found = np.empty(len(pairs.pairs))
    for k in range(len(found)):
        found[k] = apart_at_least(pairs.pairs[k, 0], pairs.pairs[k, 1], places, solids)
    return found


@njit_cached
def step_within(gap: float, speed: float, bend: float) -> float:
    """For how long a point that begins at some speed, and is accelerated by no more than `bend`,
    moves no farther than a gap."""
    if gap <= 0:
        return 0.0
    under = speed + math.sqrt(speed * speed + 2 * bend * gap)
    return 2 * gap / under if under > 0 else math.inf


@njit_cached
def advance(
    t: float,
    soon: float,
    floor: float,
    frames: Frames,
    pairs: Pairs,
    solids: Solids,
    bends: Array,
    proved: Array,
) -> tuple[Places, NDArray[np.int64], Array]:
    """Proves of pairs, until when they stay farther apart than a floor, from a time on.

    Args:
        t: the time.
        soon: which pairs need more: those of which no later time is proved.
        bends: (p,) bounds on accelerations of points of the one as seen from the other.
        proved: (p,) until when what is asked is proved of pairs, changed in place.

    Returns:
        Where solids are; the pairs that need more; and bounds (p,) on the speeds of all pairs.
    """
    places = place(frames, solids)
    of_sides = speeds(frames, places, pairs, solids)
    todo, count = np.empty(len(proved), dtype=np.int64), 0
    of_pairs = np.empty(len(proved))
    for k in range(len(proved)):
        if proved[k] >= 1:
            continue
        of_pairs[k] = of_sides[pairs.side_of[k, 0]] + of_sides[pairs.side_of[k, 1]]
        gap = apart_at_least(pairs.pairs[k, 0], pairs.pairs[k, 1], places, solids) - floor
        proved[k] = max(proved[k], t + step_within(gap, of_pairs[k], bends[k]))
        if proved[k] <= soon:
            todo[count] = k
            count += 1
    return places, todo[:count], of_pairs


@njit_cached
def encloses(surface: Array, points: Array) -> bool:
    """Whether the inside of a closed surface of triangles (m, 3, 3) has one of some points (n, 3):
    by the sum of solid angles (Van Oosterom and Strackee 1983)."""
    a, b, c, across = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for point in points:
        angles = 0.0
        for k in range(len(surface)):
            for i in range(3):
                a[i] = surface[k, 0, i] - point[i]
                b[i] = surface[k, 1, i] - point[i]
                c[i] = surface[k, 2, i] - point[i]
            la, lb, lc = _norm(a), _norm(b), _norm(c)
            _cross(b, c, across)
            under = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
            angles += math.atan2(_dot(a, across), under)
        if abs(angles) > math.pi:  # half of 4 pi, by half angles
            return True
    return False


@njit_cached
def _cross(a: Array, b: Array, out: Array) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit_cached
def _dot(a: Array, b: Array) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@njit_cached
def _norm(a: Array) -> float:
    return math.sqrt(_dot(a, a))
