"""Configuration spaces as compiled code sees them: distances, shortest ways, random places."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_hot
from envs.problem import Array
from envs.spaces import Kind, Space

_TURN = 2 * math.pi


class SpaceArrays(NamedTuple):
    """A product of p parts.

    Attributes:
        begins: (p + 1,) where the numbers of each begin in a configuration.
        are_rotations: (p,) of bool, parts that are unit quaternions; others are coordinates.
        weights: (p,) by which their distances count.
        lower, upper: (size,) bounds.
        wraps: (size,) of bool, coordinates that wrap.
    """

    begins: NDArray[np.int64]
    are_rotations: NDArray[np.bool_]
    weights: Array
    lower: Array
    upper: Array
    wraps: NDArray[np.bool_]


def space_arrays(space: Space) -> SpaceArrays:
    """What compiled code is given of a space."""
    parts = space.parts
    return SpaceArrays(
        np.cumsum([0, *(part.size for part in parts)]),
        np.array([part.factors()[0].kind is Kind.ROTATIONS for part in parts]),
        np.array([part.weight for part in parts], dtype=np.float64),
        np.array(space.lower),
        np.array(space.upper),
        np.array(space.wraps),
    )


@njit_hot
def distance(space: Any, a: Any, b: Any) -> float:
    """Of two configurations (size,), see `Space.distance`."""
    total = 0.0
    for part in range(len(space.weights)):
        begin, end = space.begins[part], space.begins[part + 1]
        if space.are_rotations[part]:
            total += space.weights[part] * rotation_angle(a, b, begin)
            continue
        squared = 0.0
        for i in range(begin, end):
            squared += shortest(space, a[i], b[i], i) ** 2
        total += space.weights[part] * math.sqrt(squared)
    return total


@njit_hot
def shortest(space: Any, a: float, b: float, i: int) -> float:
    """The way from a to b of coordinate i."""
    way = b - a
    if space.wraps[i]:
        way -= _TURN * round(way / _TURN)
    return way


@njit_hot
def rotation_angle(a: Any, b: Any, begin: int) -> float:
    """Between two unit quaternions (Rotations.difference)."""
    together = apart = 0.0
    for i in range(begin, begin + 4):
        together += (a[i] + b[i]) ** 2
        apart += (a[i] - b[i]) ** 2
    # By the tangent of a quarter of the angle: exact for small ones, where arccos is not.
    return 4 * math.atan2(math.sqrt(min(apart, together)), math.sqrt(max(apart, together)))


@njit_hot
def go(space: Any, a: Any, b: Any, t: float, there: Any) -> None:
    """Writes the place (size,) at t of the shortest way from a to b, see `Space.between`."""
    for part in range(len(space.weights)):
        begin, end = space.begins[part], space.begins[part + 1]
        if space.are_rotations[part]:
            _turn(a, b, t, begin, there)
            continue
        for i in range(begin, end):
            x = a[i] + t * shortest(space, a[i], b[i], i)
            if space.wraps[i]:
                x -= _TURN * math.floor((x - space.lower[i]) / _TURN)
                x = min(max(x, space.lower[i]), space.upper[i])
            there[i] = x


@njit_hot
def _turn(a: Any, b: Any, t: float, begin: int, there: Any) -> None:
    """Writes the unit quaternion at t between two, by the shorter way (Shoemake 1985)."""
    half = rotation_angle(a, b, begin) / 2
    cosine = 0.0
    for i in range(begin, begin + 4):
        cosine += a[i] * b[i]
    sine = math.sin(half)
    if sine < 1e-9:  # so near that the straight line is the arc
        s, u = 1 - t, t
    else:
        s, u = math.sin((1 - t) * half) / sine, math.sin(t * half) / sine
    if cosine < 0:
        u = -u
    squared = 0.0
    for i in range(begin, begin + 4):
        there[i] = s * a[i] + u * b[i]
        squared += there[i] ** 2
    for i in range(begin, begin + 4):
        there[i] /= math.sqrt(squared)


@njit_hot
def draw(space: Any, state: Any, q: Any) -> None:
    """Writes a uniform configuration (size,), and moves on the state (1,) of the random numbers."""
    for part in range(len(space.weights)):
        begin, end = space.begins[part], space.begins[part + 1]
        if space.are_rotations[part]:
            _draw_rotation(state, begin, q)
            continue
        for i in range(begin, end):
            q[i] = space.lower[i] + uniform(state) * (space.upper[i] - space.lower[i])


@njit_hot
def _draw_rotation(state: Any, begin: int, q: Any) -> None:
    """Uniform (Shoemake 1992, "Uniform random rotations")."""
    share, s, u = uniform(state), _TURN * uniform(state), _TURN * uniform(state)
    inner, outer = math.sqrt(1 - share), math.sqrt(share)
    q[begin], q[begin + 1] = inner * math.sin(s), inner * math.cos(s)
    q[begin + 2], q[begin + 3] = outer * math.sin(u), outer * math.cos(u)


@njit_hot
def uniform(state: Any) -> float:
    """The next random number, in [0, 1), of a state (1,) of uint64: SplitMix64 (Steele, Lea and
    Flood 2014), whose first 53 bits are taken. NumPy's take longer to begin than many a problem
    takes to be solved."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return float(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)
