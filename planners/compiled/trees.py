"""The trees that compiled searches grow, and paths through them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.motion_check import motion_is_free, motion_is_free_either_way
from envs.compiled import njit_cached, njit_hot
from envs.compiled_space import distance, go
from envs.problem import Array

SEARCHING, JOINED, FULL = 0, 1, 2
"""Where a search is: it may go on, has joined its trees, or needs larger ones."""


class Trees(NamedTuple):
    """Two trees of configurations: that of the start, and that of the goals.

    Attributes:
        nodes: (2, n, size).
        parents: (2, n), -1 of roots, which come first.
        refused: (2, n), how many motions from each were not free, of searches that mind it.
        costs: (2, n), the length of the way from a root to each, of searches that mind it.
        roots: (2,) how many.
        counts: (2,) of nodes.
        samples: (1,) how many were drawn.
        failures: (1,) how many of them, since the last from which a tree grew.
        state: (1,) of the random numbers.
        path: (2 n, size), the first waypoints of which are the path, once the trees are joined.
        waypoints: (1,) how many.
    """

    nodes: Array
    parents: NDArray[np.int64]
    refused: NDArray[np.int64]
    costs: Array
    roots: NDArray[np.int64]
    counts: NDArray[np.int64]
    samples: NDArray[np.int64]
    failures: NDArray[np.int64]
    state: NDArray[np.uint64]
    path: Array
    waypoints: NDArray[np.int64]

    @staticmethod
    def with_room(n: int, size: int) -> Trees:
        """Empty ones, for so many nodes each of configurations of so many numbers."""
        return Trees(
            np.empty((2, n, size)),
            np.empty((2, n), np.int64),
            np.zeros((2, n), np.int64),
            np.zeros((2, n)),
            np.zeros(2, np.int64),
            np.zeros(2, np.int64),
            np.zeros(1, np.int64),
            np.zeros(1, np.int64),
            np.zeros(1, np.uint64),
            np.empty((2 * n, size)),
            np.zeros(1, np.int64),
        )

    @property
    def room(self) -> int:
        """For how many nodes each."""
        return int(self.parents.shape[1])

    def begin(self, start: Array, goals: Array, seed: int) -> None:
        """Makes them trees of roots alone.

        Args:
            start: (size,).
            goals: (g, size), any of which will do; fewer than there is room for.
            seed: of the random numbers.
        """
        self.nodes[0, 0], self.nodes[1, : len(goals)] = start, goals
        self.parents[0, 0] = self.parents[1, : len(goals)] = -1
        self.roots[:] = 1, len(goals)
        self.refused[0, 0] = self.refused[1, : len(goals)] = 0
        self.samples[0], self.failures[0], self.state[0] = 0, 0, seed
        self.cut()

    def cut(self) -> None:
        """Takes away all but the roots; random numbers go on."""
        self.counts[:] = self.roots

    def enlarged(self) -> Trees:
        """The same with room for twice as many nodes."""
        larger = Trees.with_room(2 * self.room, self.nodes.shape[2])
        for many, few in zip(larger[:4], self[:4], strict=True):
            many[:, : self.room] = few
        return larger._replace(
            roots=self.roots,
            counts=self.counts,
            samples=self.samples,
            failures=self.failures,
            state=self.state,
        )


@njit_cached
def extend(
    check: Any, space: Any, trees: Any, tree: int, near: int, q: Any, step: float, tip: Any
) -> bool:
    """Grows a tree from a node toward a configuration by one motion, if that is free.

    Args:
        check: see `motion_is_free`.
        near: the node.
        step: the longest motion, by the space's distance.
        tip: (size,), room to work in.
    """
    length = toward(space, trees.nodes[tree, near], q, step, tip)
    return bool(grow(check, trees, tree, near, tip, length))


@njit_cached
def grow(check: Any, trees: Any, tree: int, near: int, tip: Any, length: float) -> bool:
    """Adds a node to a tree, by a motion of a length from a node, if that is free."""
    nodes, count = trees.nodes, trees.counts[tree]
    if not motion_is_free(check, nodes[tree, near], tip):
        return False
    nodes[tree, count] = tip
    trees.parents[tree, count], trees.refused[tree, count] = near, 0
    trees.costs[tree, count] = trees.costs[tree, near] + length
    trees.counts[tree] += 1
    return True


@njit_hot
def toward(space: Any, a: Any, q: Any, step: float, tip: Any) -> float:
    """Writes where a motion from a toward q (size,) comes to that is no longer than a step; and
    says how long it is."""
    away = float(distance(space, a, q))
    if away > step:
        go(space, a, q, step / away, tip)
    else:
        for i in range(len(q)):
            tip[i] = q[i]
    return min(away, step)


@njit_cached
def connect(
    check: Any, space: Any, trees: Any, tree: int, new: int, near: int, step: float, tip: Any
) -> int:
    """Grows the other tree from a node of it toward a new one of this, motion by motion, until they
    are joined or one is not free.

    Args:
        check, step, tip: see `extend`.
        new, near: the nodes, of this tree and of the other.

    Returns:
        `SEARCHING`, `JOINED`, with the path written, or `FULL`: the sample's way is given up.
    """
    other, goal = 1 - tree, trees.nodes[tree, new]
    while distance(space, trees.nodes[other, near], goal) > step:
        if trees.counts[other] == trees.nodes.shape[1]:
            return FULL
        if not extend(check, space, trees, other, near, goal, step, tip):
            return SEARCHING
        near = trees.counts[other] - 1
    if not motion_is_free_either_way(check, trees.nodes[other, near], goal):
        return SEARCHING
    write_path(trees, tree, new, near)
    return JOINED


@njit_cached
def write_path(trees: Any, tree: int, at: int, beyond: int) -> None:
    """Writes the path by a node of a tree and one of the other, from start to goal."""
    if tree == 1:
        at, beyond = beyond, at
    count, node = 0, at
    while node >= 0:
        count, node = count + 1, trees.parents[0, node]
    place, node = count, at
    while node >= 0:
        place -= 1
        trees.path[place] = trees.nodes[0, node]
        node = trees.parents[0, node]
    while beyond >= 0:
        trees.path[count] = trees.nodes[1, beyond]
        count, beyond = count + 1, trees.parents[1, beyond]
    trees.waypoints[0] = count
