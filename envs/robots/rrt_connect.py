"""Whether two configurations of an arm are joined by a path, as far as a long search can show.

RRT-Connect (Kuffner and LaValle 2000) with certified motions, compiled, on the spheres that cover
the links: what it joins is joined, also across the ends of joints that wrap. It only decides which
problems are asked; no planner sees it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.part_scenes import PartScenes
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array
from envs.robots.arm import RobotArrays
from envs.robots.arm_clearance import keeps, segment_is_free
from envs.robots.swept_pairs import NONE, motion_keeps_apart

ITERATIONS = 4000
"""Of a search before it gives up."""

STEP = 0.5
"""The longest motion, in radians or metres."""


def is_connected(
    arm: RobotArrays,
    scenes: PartScenes,
    start: Array,
    goal: Array,
    samples: Array,
    tolerance: float,
    swept: NDArray[np.int64] = NONE,
) -> bool:
    """Whether a search that draws `samples` (n, d) joins two configurations (d,) by motions that
    are certified to a tolerance in metres; what they keep apart besides the arm's pairs are pairs
    (k, 3) of `swept_pairs`."""
    outward = np.arange(arm.moving)[::-1].copy()
    # Copies: of arrays that must not be written to, as those of problems are, it would be compiled
    # again.
    ends = np.array(start), np.array(goal)
    return bool(_joined((arm, swept, scenes, tolerance, outward), *ends, np.array(samples), STEP))


@njit_hot
def _shortest(wraps: Any, a: float, b: float, i: int) -> float:
    """The way from a to b of coordinate i."""
    way = b - a
    if wraps[i]:
        way -= 2 * math.pi * round(way / (2 * math.pi))
    return way


@njit_cached
def reached(wraps: Any, a: Any, b: Any) -> Any:
    """The numbers (d,) with which one comes from a to b (d,) by the shortest way: b itself, but
    where it wraps."""
    there = np.empty(len(b))
    write_reached(wraps, a, b, there)
    return there


@njit_hot
def write_reached(wraps: Any, a: Any, b: Any, there: Any) -> None:
    """Writes what `reached` gives."""
    for i in range(len(b)):
        there[i] = a[i] + _shortest(wraps, a[i], b[i], i) if wraps[i] else b[i]


@njit_cached
def _nearest(wraps: Any, tree: Any, size: int, q: Any) -> int:
    best, least = 0, np.inf
    for n in range(size):
        squared = 0.0
        for i in range(len(q)):
            squared += _shortest(wraps, q[i], tree[n, i], i) ** 2
        if squared < least:
            best, least = n, squared
    return best


@njit_cached
def _is_free(motions: Any, a: Any, b: Any) -> bool:
    """Whether the motion from a to b (d,) is proved free."""
    arm, swept, scenes, tolerance, order = motions
    # What is in the way of a motion is nearly always in the way at its end, too.
    if not keeps(arm, scenes, swept, b, tolerance / 2, order):
        return False
    if not segment_is_free(arm, scenes, a, b, tolerance):
        return False
    return bool(motion_keeps_apart(arm, swept, a, b, tolerance))


@njit_cached
def _extended(motions: Any, tree: Any, size: int, q: Any, step: float) -> tuple[int, bool]:
    """Grows a tree by one motion toward a configuration: its new size, and whether it is there."""
    wraps = motions[0].tree.wraps
    near = _nearest(wraps, tree, size, q)
    goal = reached(wraps, tree[near], q)
    way = goal - tree[near]
    length = np.sqrt((way**2).sum())
    there = length <= step
    tip = goal if there else tree[near] + way * (step / length)
    if size == len(tree) or not _is_free(motions, tree[near], tip):
        return size, False
    tree[size] = tip
    return size + 1, there


@njit_cached
def _joined(motions: Any, start: Any, goal: Any, samples: Any, step: float) -> bool:
    """See `is_connected`; motions are those of an arm and its swept pairs, in a scene, certified to
    a tolerance, its parts asked in an order that changes, see `keeps`."""
    if _is_free(motions, start, reached(motions[0].tree.wraps, start, goal)):
        return True
    trees = np.empty((2, 20 * len(samples), len(start)))
    trees[0, 0], trees[1, 0] = start, goal
    sizes = np.ones(2, dtype=np.int64)
    for n in range(len(samples)):
        this, other = n % 2, 1 - n % 2
        before = sizes[this]
        sizes[this], _ = _extended(motions, trees[this], before, samples[n], step)
        if sizes[this] == before:
            continue
        tip = trees[this, before]
        while True:
            before = sizes[other]
            sizes[other], there = _extended(motions, trees[other], before, tip, step)
            if there:
                return True
            if sizes[other] == before:
                break
    return False
