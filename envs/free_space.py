"""Connected components of free space, proved on a grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from envs.problem import Array


class GridComponents:
    """Which parts of a box-shaped configuration space hang together, for a translating robot.

    A node counts as free if the clearance there exceeds half the spacing. Neighbours along an
    axis are one spacing apart, so the edge between two free nodes is free as well: one component
    on the grid is a proof of a free path. Gaps narrower than about the spacing count as closed.

    Args:
        clearance: (n, d) -> (n,), in the unit of the configurations.
        lower, upper: (d,) bounds.
        nodes: the number of nodes along each axis.
    """

    def __init__(
        self, clearance: Callable[[Array], Array], lower: Array, upper: Array, nodes: int = 100
    ) -> None:
        self._lower = lower
        self._spacing = (upper - lower) / (nodes - 1)
        self._last = nodes - 1
        axes = [np.linspace(lo, hi, nodes) for lo, hi in zip(lower, upper, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        free = clearance(points) > self._spacing.max() / 2
        labels, _ = ndimage.label(free.reshape((nodes,) * len(axes)))
        self._labels = labels.astype(np.int64)

    def label(self, q: Array) -> NDArray[np.int64]:
        """Component numbers (n,) of configurations (n, d), that of the nearest node.

        0 is no component. A configuration whose clearance exceeds its distance to the nearest
        node is joined to it by a free straight line.
        """
        nearest = np.rint((q - self._lower) / self._spacing).astype(int)
        labels: NDArray[np.int64] = self._labels[tuple(np.clip(nearest, 0, self._last).T)]
        return labels
