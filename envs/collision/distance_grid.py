"""Clearances that are looked up instead of computed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from envs.problem import Array


class ClearanceGrid:
    """Clearances at the nodes of a regular grid, multilinearly interpolated.

    Args:
        values: on the nodes, one axis a dimension.
        lower, upper: (d,) the first node and the last; beyond, the grid's border goes on.

    Attributes:
        values: as float32.
        lower: (d,) the first node.
        per_unit: (d,) nodes by length.
    """

    def __init__(self, values: Array, lower: Array, upper: Array) -> None:
        self.values = values.astype(np.float32)
        self.lower = lower
        self.per_unit = (np.array(values.shape) - 1) / (upper - lower)

    @staticmethod
    def sampled(
        clearance: Callable[[Array], Array], lower: Array, upper: Array, spacing: float
    ) -> ClearanceGrid:
        """That of a function (n, d) -> (n,), with nodes at most `spacing` apart.

        If a robot only translates, its clearance changes no faster than it moves; then the error
        is at most sqrt(d) / 2 spacings: the corners of a cell, weighted as they are, lie no
        farther than that from a point of it in the root mean square.
        """
        axes = grid_axes(lower, upper, spacing)
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        values = clearance(nodes.reshape(-1, len(axes)))
        return ClearanceGrid(values.reshape(nodes.shape[:-1]), lower, upper)

    def __call__(self, q: Array) -> Array:
        """Clearances (n,) at configurations (n, d)."""
        from scipy import ndimage  # a third of a second, which most workers can save

        at = ((q - self.lower) * self.per_unit).T
        found: Array = ndimage.map_coordinates(
            self.values, at, output=np.float64, order=1, mode="nearest"
        )
        return found


def grid_axes(lower: Array, upper: Array, spacing: float) -> list[Array]:
    """Positions of the nodes along each axis, at most `spacing` apart."""
    cells = np.ceil((upper - lower) / spacing).astype(int)
    return [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, cells, strict=True)]
