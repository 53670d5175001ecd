"""Connected components of free space, proved on a grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from envs.errors import InputError
from envs.grid import RegularGrid, node_axes, node_positions
from envs.problem import Array, Problem


class GridComponents:
    """Which parts of a box-shaped configuration space hang together, for a translating robot.

    A node counts as free if the clearance there exceeds half the spacing. Neighbours along an
    axis are one spacing apart, so the edge between two free nodes is free as well: one component
    on the grid is a proof of a free path. Gaps narrower than about the spacing count as closed.

    Args:
        clearance: (n, d) -> (n,), in the unit of the configurations.
        lower, upper: (d,) bounds.
        nodes: (d,) the number of nodes along each axis, or one for all.
    """

    def __init__(
        self,
        clearance: Callable[[Array], Array],
        lower: Array,
        upper: Array,
        nodes: int | NDArray[np.int64] = 100,
    ) -> None:
        from scipy import ndimage  # a third of a second, which workers can save

        counts = np.broadcast_to(nodes, len(lower))
        points = node_positions(node_axes(lower, upper, counts))
        spacing = (upper - lower) / (counts - 1)
        free = clearance(points.reshape(-1, len(lower))) > spacing.max() / 2
        labels, _ = ndimage.label(free.reshape(points.shape[:-1]))
        self._labels = RegularGrid.between(labels.astype(np.int64), lower, upper)

    def label(self, q: Array) -> NDArray[np.int64]:
        """Component numbers (n,) of configurations (n, d), that of the nearest node.

        0 is no component. A configuration whose clearance exceeds its distance to the nearest
        node is joined to it by a free straight line.
        """
        return self._labels.at_nearest(q)


class Demanding(Protocol):
    """What problems have to keep to.

    Attributes:
        min_clearance: least clearance of a problem's start and goal.
        min_separation: least distance between them.
    """

    lower: Array
    upper: Array
    min_clearance: float
    min_separation: float

    @property
    def free_bounds(self) -> tuple[Array, Array]: ...

    def clearance(self, q: Array) -> Array: ...


def connected_pairs(
    env: Demanding, components: GridComponents, rng: np.random.Generator
) -> Iterator[tuple[Array, Array]]:
    """Starts and goals, each (d,), uniform in free space as far as `env` allows them, and in one
    component. Ends when a hundred thousand pairs in a row are refused."""
    fruitless = 0
    while fruitless < 100:
        start, goal = rng.uniform(*env.free_bounds, (2, 1024, len(env.lower)))
        keep = np.linalg.norm(goal - start, axis=1) >= env.min_separation
        label = components.label(start)
        keep &= (label > 0) & (label == components.label(goal))
        left = np.flatnonzero(keep)  # clearances are asked last, as they may take long
        for end in (start, goal):
            keep[left] &= env.clearance(end[left]) >= env.min_clearance
        fruitless = 0 if keep.any() else fruitless + 1
        yield from zip(start[keep], goal[keep], strict=True)


def connected_problems(
    env: Demanding,
    components: GridComponents,
    rng: np.random.Generator,
    n: int,
    planner_seed: Callable[[int], int],
    advice: str,
) -> list[Problem]:
    """The first `n` of `connected_pairs` as problems.

    Args:
        planner_seed: index of a problem to its planner's seed.
        advice: what to do if there are too few.

    Raises:
        InputError: there are fewer.
    """
    pairs = list(islice(connected_pairs(env, components, rng), n))
    if len(pairs) < n:
        raise InputError(f"found only {len(pairs)} of {n} problems: {advice}")
    return [Problem(a, b, index, planner_seed(index)) for index, (a, b) in enumerate(pairs)]
