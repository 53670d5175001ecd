"""Where the bodies of an arm are at many places of a motion, or configurations, at once, compiled.

All numbers of a body stand side by side for the places, so that processors take several of these
at a time (SIMD).
"""

from __future__ import annotations

import math
from typing import Any

from envs.compiled import njit_simd

PLACES = 16
"""In the middles of as many equal shares of a stretch of a motion."""

BODY = 18 * PLACES
"""Numbers of a body: its pose (3, 4) row by row, the velocity of its origin, its angular velocity,
each at all places."""

POINT = 6 * PLACES
"""Numbers of a point of a body: its coordinates and its velocity, each at all places."""

_QUARTERS = 2 / math.pi
"""Quarter turns in a radian."""

_DOUBLINGS = (1, 2, 4, 8)
"""By which one place becomes `PLACES`."""


@njit_simd
def bodies_at_places(
    tree: Any, a: Any, b: Any, begin: float, width: float, bodies: Any, turns: Any
) -> None:
    """Writes poses and velocities of the bodies at places of the motion from a to b (d,), of joints
    of which none is spherical; as `body_motions` does at one.

    Args:
        tree: `TreeArrays`.
        begin, width: of the stretch, of all of the motion 0 and 1.
        bodies: ((1 + m) BODY,) is written to.
        turns: (2 PLACES,), room to work in.
    """
    step = width / PLACES
    first = begin + step / 2
    _stand(bodies[:BODY])
    for joint in range(len(tree.parents)):
        parent, k = tree.parents[joint], tree.coordinates[joint]
        here = bodies[parent * BODY : (parent + 1) * BODY]
        there = bodies[(joint + 1) * BODY : (joint + 2) * BODY]
        speed = tree.ratios[joint] * (b[k] - a[k])
        value = tree.ratios[joint] * a[k] + tree.offsets[joint] + first * speed
        if tree.prismatic[joint]:
            for n in range(PLACES):
                turns[n] = value + n * step * speed
            _slide(here, there, tree.origins[joint], tree.axes[joint], turns)
            _velocities(here, there, tree.axes[joint], speed, 0.0)
        else:
            _cosines_and_sines(value, step * speed, turns)
            _turn(here, there, tree.origins[joint], tree.axes[joint], turns)
            _velocities(here, there, tree.axes[joint], 0.0, speed)


@njit_simd
def bodies_at_configurations(tree: Any, q: Any, bodies: Any, turns: Any) -> None:
    """Writes poses of the bodies at configurations (PLACES, d), as `bodies_at_places` does, which
    are as though they stood still.

    Args:
        bodies, turns: see `bodies_at_places`.
    """
    _stand(bodies[:BODY])
    for joint in range(len(tree.parents)):
        parent, k = tree.parents[joint], tree.coordinates[joint]
        here = bodies[parent * BODY : (parent + 1) * BODY]
        there = bodies[(joint + 1) * BODY : (joint + 2) * BODY]
        ratio, offset = tree.ratios[joint], tree.offsets[joint]
        for n in range(PLACES):
            turns[n] = ratio * q[n, k] + offset
        if tree.prismatic[joint]:
            _slide(here, there, tree.origins[joint], tree.axes[joint], turns)
        else:
            _cosines_and_sines_of(turns)
            _turn(here, there, tree.origins[joint], tree.axes[joint], turns)
        there[12 * PLACES :] = 0.0


@njit_simd
def point_at_places(body: Any, point: Any, out: Any) -> None:
    """Writes where a point (3,) of a body (BODY,) is, and its velocities, (POINT,)."""
    cx, cy, cz = point[0], point[1], point[2]
    for n in range(PLACES):
        x = body[n] * cx + body[PLACES + n] * cy + body[2 * PLACES + n] * cz
        y = body[4 * PLACES + n] * cx + body[5 * PLACES + n] * cy + body[6 * PLACES + n] * cz
        z = body[8 * PLACES + n] * cx + body[9 * PLACES + n] * cy + body[10 * PLACES + n] * cz
        u, v, w = body[15 * PLACES + n], body[16 * PLACES + n], body[17 * PLACES + n]
        out[n] = x + body[3 * PLACES + n]
        out[PLACES + n] = y + body[7 * PLACES + n]
        out[2 * PLACES + n] = z + body[11 * PLACES + n]
        out[3 * PLACES + n] = body[12 * PLACES + n] + v * z - w * y
        out[4 * PLACES + n] = body[13 * PLACES + n] + w * x - u * z
        out[5 * PLACES + n] = body[14 * PLACES + n] + u * y - v * x


@njit_simd
def _stand(body: Any) -> None:
    """Writes a body (BODY,) that stands at the origin: the base."""
    body[:] = 0.0
    for n in range(PLACES):
        body[n] = body[5 * PLACES + n] = body[10 * PLACES + n] = 1.0


@njit_simd
def _cosines_and_sines(angle: float, step: float, out: Any) -> None:
    """Writes those (2 PLACES,) of angles by even steps: half of them by the sum of two angles each
    time, which takes a fifth of the time of as many calls."""
    out[0], out[PLACES] = math.cos(angle), math.sin(angle)
    c, s = math.cos(step), math.sin(step)
    for count in _DOUBLINGS:
        for n in range(count):
            out[count + n] = out[n] * c - out[PLACES + n] * s
            out[PLACES + count + n] = out[PLACES + n] * c + out[n] * s
        c, s = c * c - s * s, 2 * c * s


@njit_simd
def _cosines_and_sines_of(turns: Any) -> None:
    """Writes those (2 PLACES,) of angles (PLACES,) that stand there, to 1e-11: by series about the
    nearest quarter turn, of which processors take several at a time."""
    for n in range(PLACES):
        quarters = math.floor(turns[n] * _QUARTERS + 0.5)
        x = turns[n] - quarters / _QUARTERS
        square = x * x
        s = x * _series(square, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0)
        c = _series(square, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0)
        quarters -= 4.0 * math.floor(quarters / 4.0)
        is_odd = (quarters == 1.0) | (quarters == 3.0)
        cosine, sine = (s, c) if is_odd else (c, s)
        turns[n] = -cosine if (quarters == 1.0) | (quarters == 2.0) else cosine
        turns[PLACES + n] = -sine if quarters >= 2.0 else sine


@njit_simd
def _series(square: float, a: float, b: float, c: float, d: float, e: float, f: float) -> float:
    """1 - x^2 / (a (a - 1)) (1 - x^2 / (b (b - 1)) (...)): with even numbers the cosine of x, with
    odd ones its sine over x."""
    found = 1.0 - square / (f * (f - 1.0))
    for n in (e, d, c, b, a):
        found = 1.0 - square / (n * (n - 1.0)) * found
    return found


@njit_simd
def _turn(here: Any, there: Any, origin: Any, axis: Any, turns: Any) -> None:
    """Writes the poses of a body that a joint turns, whose parent's are `here`, with cosines and
    sines (2 PLACES,); each row as in `kinematic_tree`."""
    x, y, z = axis[0], axis[1], axis[2]
    for i in range(3):
        row = there[4 * PLACES * i : 4 * PLACES * (i + 1)]
        _mount(here[4 * PLACES * i : 4 * PLACES * (i + 1)], row, origin)
        if x == 0.0 and y == 0.0:  # as in most robots, and in a third of the time
            for n in range(PLACES):
                u, v = row[n], row[PLACES + n]
                c, s = turns[n], z * turns[PLACES + n]
                row[n], row[PLACES + n] = u * c + v * s, v * c - u * s
            continue
        for n in range(PLACES):
            u, v, w = row[n], row[PLACES + n], row[2 * PLACES + n]
            c, s = turns[n], turns[PLACES + n]
            along = (u * x + v * y + w * z) * (1.0 - c)
            row[n] = u * c + (v * z - w * y) * s + along * x
            row[PLACES + n] = v * c + (w * x - u * z) * s + along * y
            row[2 * PLACES + n] = w * c + (u * y - v * x) * s + along * z


@njit_simd
def _slide(here: Any, there: Any, origin: Any, axis: Any, slides: Any) -> None:
    """Writes the poses of a body that a joint slides so far (PLACES,)."""
    x, y, z = axis[0], axis[1], axis[2]
    for i in range(3):
        row = there[4 * PLACES * i : 4 * PLACES * (i + 1)]
        _mount(here[4 * PLACES * i : 4 * PLACES * (i + 1)], row, origin)
        for n in range(PLACES):
            along = row[n] * x + row[PLACES + n] * y + row[2 * PLACES + n] * z
            row[3 * PLACES + n] += slides[n] * along


@njit_simd
def _mount(here: Any, there: Any, origin: Any) -> None:
    """Writes a row of poses times the pose (3, 4) of a joint in the frame of its parent."""
    a0, a1, a2, a3 = origin[0, 0], origin[0, 1], origin[0, 2], origin[0, 3]
    b0, b1, b2, b3 = origin[1, 0], origin[1, 1], origin[1, 2], origin[1, 3]
    c0, c1, c2, c3 = origin[2, 0], origin[2, 1], origin[2, 2], origin[2, 3]
    for n in range(PLACES):
        u, v, w = here[n], here[PLACES + n], here[2 * PLACES + n]
        there[n] = u * a0 + v * b0 + w * c0
        there[PLACES + n] = u * a1 + v * b1 + w * c1
        there[2 * PLACES + n] = u * a2 + v * b2 + w * c2
        there[3 * PLACES + n] = u * a3 + v * b3 + w * c3 + here[3 * PLACES + n]


@njit_simd
def _velocities(here: Any, there: Any, axis: Any, slides: float, turns: float) -> None:
    """Writes those of a body whose joint slides or turns it so fast."""
    x, y, z = axis[0], axis[1], axis[2]
    for n in range(PLACES):
        u, v, w = here[15 * PLACES + n], here[16 * PLACES + n], here[17 * PLACES + n]
        dx = there[3 * PLACES + n] - here[3 * PLACES + n]
        dy = there[7 * PLACES + n] - here[7 * PLACES + n]
        dz = there[11 * PLACES + n] - here[11 * PLACES + n]
        ax = there[n] * x + there[PLACES + n] * y + there[2 * PLACES + n] * z
        ay = there[4 * PLACES + n] * x + there[5 * PLACES + n] * y + there[6 * PLACES + n] * z
        az = there[8 * PLACES + n] * x + there[9 * PLACES + n] * y + there[10 * PLACES + n] * z
        there[12 * PLACES + n] = here[12 * PLACES + n] + v * dz - w * dy + slides * ax
        there[13 * PLACES + n] = here[13 * PLACES + n] + w * dx - u * dz + slides * ay
        there[14 * PLACES + n] = here[14 * PLACES + n] + u * dy - v * dx + slides * az
        there[15 * PLACES + n] = u + turns * ax
        there[16 * PLACES + n] = v + turns * ay
        there[17 * PLACES + n] = w + turns * az
