"""RRT-Connect (Kuffner and LaValle 2000), compiled, with proofs of all its motions.

It is the smaller tree that grows toward a sample ("balanced", LaValle 2006, "Planning Algorithms",
section 5.5.3): one whose root is hard to get away from is worth all of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.motion_check import motion_is_free_either_way
from envs.compiled import njit_cached, njit_hot
from envs.compiled_space import SpaceArrays, distance, draw
from planners.compiled.trees import FULL, JOINED, SEARCHING, connect, extend, write_path


@njit_cached
def search(check: Any, space: SpaceArrays, trees: Any, step: float, samples: int) -> int:
    """Grows the trees by so many samples more, or until they are joined or full.

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
    sample, tip = np.empty(nodes.shape[2]), np.empty(nodes.shape[2])
    for _ in range(samples):
        this = _smaller(counts, trees.samples[0])
        other = 1 - this
        if max(counts[0], counts[1]) == nodes.shape[1]:
            return FULL
        trees.samples[0] += 1
        draw(space, trees.state, sample)
        near = _nearest(space, nodes[this], counts[this], sample)
        if not extend(check, space, trees, this, near, sample, step, tip):
            continue
        new = counts[this] - 1
        near = _nearest(space, nodes[other], counts[other], nodes[this, new])
        found = connect(check, space, trees, this, new, near, step, tip)
        if found != SEARCHING:
            return found
    return SEARCHING


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
