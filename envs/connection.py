"""Whether two configurations are joined by a path, as far as a search can show, in any space.

RRT-Connect (Kuffner and LaValle 2000) along the shortest ways of the space. It only decides which
problems are asked; no planner sees it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from envs.problem import Array
from envs.spaces import Space

IsFree = Callable[[Array, Array], bool]
"""Whether the motion between two configurations (size,) is proved free."""


class _Tree:
    """Configurations that are joined to its root by free motions."""

    def __init__(self, space: Space, root: Array) -> None:
        self._space = space
        self._nodes = root[None].repeat(64, axis=0)
        self._count = 1

    def extended(self, q: Array, step: float, is_free: IsFree) -> tuple[Array | None, bool]:
        """Grows by one motion of at most `step` toward a configuration (size,): where it ends, None
        if it is blocked, and whether that is the configuration."""
        toward = np.broadcast_to(q, (self._count, len(q)))
        away = self._space.distance(self._nodes[: self._count], toward)
        near = int(np.argmin(away))
        there = bool(away[near] <= step)
        tip = q if there else self._space.between(self._nodes[near], q, step / away[near])
        if not is_free(self._nodes[near], tip):
            return None, False
        self._add(tip)
        return tip, there

    def _add(self, q: Array) -> None:
        if self._count == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, self._nodes])
        self._nodes[self._count] = q
        self._count += 1


def is_connected(
    space: Space,
    is_free: IsFree,
    start: Array,
    goal: Array,
    samples: Iterable[Array],
    step: float,
) -> bool:
    """Whether a search that draws `samples`, (size,) each, joins two configurations (size,).

    Args:
        is_free: decides about motions.
        step: the longest motion of a tree, by the space's distance.
    """
    if is_free(start, goal):
        return True
    trees = [_Tree(space, start), _Tree(space, goal)]
    for n, sample in enumerate(samples):
        this, other = trees[n % 2], trees[1 - n % 2]
        tip, _ = this.extended(sample, step, is_free)
        while tip is not None:
            reached, there = other.extended(tip, step, is_free)
            if there:
                return True
            if reached is None:
                break
    return False
