"""RRT-Connect (Kuffner and LaValle 2000), compiled, with proofs of all its motions.

It is the smaller tree that grows toward a sample ("balanced", LaValle 2006, "Planning Algorithms",
section 5.5.3): one whose root is hard to get away from is worth all of them. And from a node from
which many motions were not free every other one is half as long, as long ones are likelier to meet
something.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.motion_check import LANES, motion_is_free_either_way, touching_ends
from envs.compiled import njit_cached, njit_hot
from envs.compiled_space import SpaceArrays, distance, draw
from envs.problem import Array
from planners.compiled.trees import FULL, JOINED, SEARCHING, connect, grow, toward, write_path

_MANY = 64
"""Motions from a node that were not free, after which it is taken to be in a narrow place."""

_FAILURES = 8
"""Samples in a row from which no tree grew, after which the ends of motions are asked about
together: to ask about `LANES` of them takes as long as to ask about some six one by one."""


class _Lanes(NamedTuple):
    """Motions toward some samples, which are tried one after another.

    Attributes:
        drawn: (LANES, size) the samples.
        nears: (LANES,) the nodes to grow from.
        tips: (LANES, size) to where.
        lengths: (LANES,) of the motions.
    """

    drawn: Array
    nears: NDArray[np.int64]
    tips: Array
    lengths: Array


@njit_cached
def search(check: Any, space: SpaceArrays, trees: Any, step: float, samples: int) -> int:
    """Grows the trees by so many samples more, a multiple of `LANES`, or until they are joined or
    full.

    The first call asks for the straight ways from the start to the goals, before any sample.

    Args:
        check: see `motion_is_free`.
        step: the longest motion, by the space's distance.

    Returns:
        `SEARCHING`, `JOINED` or `FULL`.
    """
    nodes, counts = trees.nodes, trees.counts
    if trees.samples[0] == 0:
        for goal in range(counts[1]):
            if motion_is_free_either_way(check, nodes[0, 0], nodes[1, goal]):
                write_path(trees, 0, 0, goal)
                return JOINED
    size = nodes.shape[2]
    lanes = _Lanes(
        np.empty((LANES, size)),
        np.empty(LANES, np.int64),
        np.empty((LANES, size)),
        np.empty(LANES),
    )
    for _ in range(0, samples, LANES):
        for n in range(LANES):
            draw(space, trees.state, lanes.drawn[n])
        found = _try(check, space, trees, step, lanes)
        if found != SEARCHING:
            return found
    return SEARCHING


@njit_cached
def _try(check: Any, space: Any, trees: Any, step: float, lanes: Any) -> int:
    """Grows the trees toward samples, one after another. Where many came to nothing, most of those
    that follow will: until a tree grows, their ends are known and are asked about together."""
    nodes, counts, first = trees.nodes, trees.counts, trees.samples[0]
    are_asked, touching = trees.failures[0] >= _FAILURES and check.of_ends != 0, 0
    if are_asked:
        for n in range(LANES):
            _aim(space, trees, _smaller(counts, first + n), step, first, n, lanes)
        touching = touching_ends(check, lanes.tips)
    for n in range(LANES):
        if max(counts[0], counts[1]) == nodes.shape[1]:
            return FULL
        this = _smaller(counts, first + n)
        if not are_asked:
            _aim(space, trees, this, step, first, n, lanes)
        near, tip = lanes.nears[n], lanes.tips[n]
        trees.samples[0] += 1
        is_touching = are_asked and touching >> n & 1 == 1
        if is_touching or not grow(check, trees, this, near, tip, lanes.lengths[n]):
            trees.failures[0] += 1
            trees.refused[this, near] += 1
            continue
        trees.failures[0], are_asked = 0, False
        other, new = 1 - this, counts[this] - 1
        near = _nearest(space, nodes[other], counts[other], nodes[this, new])
        found = connect(check, space, trees, this, new, near, step, tip)
        if found != SEARCHING:
            return found
    return SEARCHING


@njit_hot
def _aim(space: Any, trees: Any, tree: int, step: float, first: int, n: int, lanes: Any) -> None:
    """Writes the motion by which a tree as it is would grow toward the nth of the samples, of which
    `first` were drawn before."""
    nodes = trees.nodes[tree]
    near = _nearest(space, nodes, trees.counts[tree], lanes.drawn[n])
    # In pairs, as trees of as many nodes grow in turn.
    is_short = trees.refused[tree, near] >= _MANY and (first + n) // 2 % 2 == 1
    longest = step / 2 if is_short else step
    lanes.nears[n] = near
    lanes.lengths[n] = toward(space, nodes[near], lanes.drawn[n], longest, lanes.tips[n])


@njit_hot
def _smaller(counts: Any, samples: int) -> int:
    """Which of two trees has fewer nodes (2,); in turn where they have as many."""
    if counts[0] == counts[1]:
        return int(samples % 2)
    return 0 if counts[0] < counts[1] else 1


@njit_hot
def _nearest(space: Any, nodes: Any, count: int, q: Any) -> int:
    best, least = 0, np.inf
    if len(space.weights) == 1 and not space.are_rotations[0] and not space.wraps.any():
        for n in range(count):
            squared = 0.0
            for i in range(len(q)):
                squared += (nodes[n, i] - q[i]) ** 2
            if squared < least:
                best, least = n, squared
        return best
    for n in range(count):
        away = distance(space, nodes[n], q)
        if away < least:
            best, least = n, away
    return best
