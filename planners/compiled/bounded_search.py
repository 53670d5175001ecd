"""RRT-Connect for paths shorter than a bound, compiled, as AORRTC repeats it.

Wilson, Thomason, Kingston and Gammell, "AORRTC: Almost-Surely Asymptotically Optimal Planning With
RRT-Connect", RA-L 2025: by the AO-x meta-algorithm (Hauser and Zhou 2016), samples have a cost
beside their configuration, and a node may only be reached from one from which that cost is kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.motion_check import motion_is_free
from envs.compiled import njit_cached, njit_hot
from envs.compiled_space import SpaceArrays, distance, uniform
from planners.compiled.informed_set import draw_informed
from planners.compiled.trees import FULL, SEARCHING, connect, extend

_NONE = -1


@njit_cached
def search_below(
    check: Any, space: SpaceArrays, trees: Any, step: float, samples: int, bound: float
) -> int:
    """Grows the trees by so many samples more, or until a path shorter than the bound joins them,
    or they are full.

    Args:
        check: see `motion_is_free`.
        step: the longest motion, by the space's distance.
        bound: by the space's distance.

    Returns:
        `SEARCHING`, `JOINED` or `FULL`.
    """
    nodes, counts, costs = trees.nodes, trees.counts, trees.costs
    sample, tip = np.empty(nodes.shape[2]), np.empty(nodes.shape[2])
    for _ in range(samples):
        this = trees.samples[0] % 2
        other = 1 - this
        if max(counts[0], counts[1]) == nodes.shape[1]:
            return FULL
        trees.samples[0] += 1
        if not draw_informed(space, trees, bound, sample):
            continue
        # The cost that the sample may have is between what it has at least and what leaves enough
        # for the rest of the way.
        least = _from_roots(space, trees, this, sample)
        most = bound - _from_roots(space, trees, other, sample)
        cost = least + uniform(trees.state) * (most - least)
        near = _nearest_below(space, trees, this, counts[this], sample, cost)
        if near == _NONE or not extend(check, space, trees, this, near, sample, step, tip):
            continue
        new = counts[this] - 1
        _lower_cost(check, space, trees, this, new)
        left = bound - costs[this, new]
        near = _nearest_below(space, trees, other, counts[other], nodes[this, new], left)
        if near == _NONE:
            continue
        found = connect(check, space, trees, this, new, near, step, tip)
        if found != SEARCHING:
            return found
    return SEARCHING


@njit_cached
def _lower_cost(check: Any, space: Any, trees: Any, tree: int, new: int) -> None:
    """Looks for a shorter way to a new node, with ever lower costs that it might have, until there
    is none (the paper's resampling of costs)."""
    q, costs = trees.nodes[tree, new], trees.costs
    least = _from_roots(space, trees, tree, q)
    while costs[tree, new] > least:
        cost = least + uniform(trees.state) * (costs[tree, new] - least)
        near = _nearest_below(space, trees, tree, new, q, cost)
        if near == _NONE or not motion_is_free(check, trees.nodes[tree, near], q):
            return
        trees.parents[tree, new] = near
        costs[tree, new] = costs[tree, near] + distance(space, trees.nodes[tree, near], q)


@njit_hot
def _from_roots(space: Any, trees: Any, tree: int, q: Any) -> float:
    """The distance to the nearest root of a tree: no way is shorter."""
    least = np.inf
    for n in range(trees.roots[tree]):
        least = min(least, distance(space, trees.nodes[tree, n], q))
    return least


@njit_hot
def _nearest_below(space: Any, trees: Any, tree: int, count: int, q: Any, cost: float) -> int:
    """The nearest of the first nodes of a tree from which the way to a configuration costs less."""
    best, least = _NONE, np.inf
    nodes, costs = trees.nodes[tree], trees.costs[tree]
    for n in range(count):
        if costs[n] >= cost:
            continue
        away = distance(space, nodes[n], q)
        if away < least and costs[n] + away < cost:
            best, least = n, away
    return best
