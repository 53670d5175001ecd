"""Random configurations through which a path may be shorter than a bound, compiled."""

from __future__ import annotations

import math
from typing import Any

from envs.compiled import njit_hot
from envs.compiled_space import distance, draw, uniform

_TRIES = 100


@njit_hot
def draw_informed(space: Any, trees: Any, bound: float, q: Any) -> bool:
    """Writes a configuration (size,) that is uniform among those from which the distances to the
    start and to some goal add up to less than the bound; False if none was found.

    Such a set is an ellipsoid where the space is Euclidean. It is drawn from directly (Gammell,
    Srinivasa and Barfoot 2014), and what is beyond the bounds of the space is left out. In turn
    with that the whole space is drawn from, and what is not in the ellipsoid is left out. Either is
    uniform, and one of the two is quick whether the ellipsoid is small or large. Of several goals
    one is chosen first.
    """
    start, goals = trees.nodes[0, 0], trees.nodes[1]
    goal = int(uniform(trees.state) * trees.roots[1])
    is_flat = len(space.weights) == 1 and not space.are_rotations[0] and not space.wraps.any()
    if distance(space, start, goals[goal]) >= bound:
        return False
    for turn in range(_TRIES):
        if is_flat and turn % 2 == 0:
            _draw_ellipsoid(trees.state, start, goals[goal], bound / space.weights[0], q)
            if not _is_within(space, q):
                continue
        else:
            draw(space, trees.state, q)
        if distance(space, start, q) + distance(space, q, goals[goal]) < bound:
            return True
    return False


@njit_hot
def _is_within(space: Any, q: Any) -> bool:
    inside = True
    for i in range(len(q)):
        inside &= space.lower[i] <= q[i] <= space.upper[i]
    return inside


@njit_hot
def _draw_ellipsoid(state: Any, a: Any, b: Any, total: float, q: Any) -> None:
    """Uniform where the distances to the foci a and b (d,) add up to less than the total."""
    _draw_ball(state, q)
    between = 0.0
    for i in range(len(q)):
        between += (b[i] - a[i]) ** 2
    between = math.sqrt(between)
    half, across = total / 2, math.sqrt(max(total**2 - between**2, 0.0)) / 2
    for i in range(len(q)):
        q[i] *= half if i == 0 else across
    # The first axis is turned to the direction from a to b by a reflection (Householder), which is
    # as good as a rotation, as the ellipsoid is round about that axis.
    if between > 0.0:
        along, squared = 0.0, 0.0
        for i in range(len(q)):
            mirror = (1.0 if i == 0 else 0.0) - (b[i] - a[i]) / between
            along += mirror * q[i]
            squared += mirror**2
        if squared > 0.0:
            for i in range(len(q)):
                mirror = (1.0 if i == 0 else 0.0) - (b[i] - a[i]) / between
                q[i] -= 2 * along / squared * mirror
    for i in range(len(q)):
        q[i] += (a[i] + b[i]) / 2


@njit_hot
def _draw_ball(state: Any, q: Any) -> None:
    """Uniform in the unit ball: a normal direction (Box and Muller 1958), and a radius."""
    squared = 0.0
    for i in range(len(q)):
        radius = math.sqrt(-2 * math.log(1 - uniform(state)))
        q[i] = radius * math.cos(2 * math.pi * uniform(state))
        squared += q[i] ** 2
    scale = uniform(state) ** (1 / len(q)) / math.sqrt(squared) if squared > 0 else 0.0
    for i in range(len(q)):
        q[i] *= scale
