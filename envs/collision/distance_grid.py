"""Clearances that are looked up instead of computed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from envs.problem import Array


class ClearanceGrid:
    """Clearances at the nodes of a regular grid, multilinearly interpolated.

    Clearance changes no faster than the configuration moves if the robot only translates; then
    the error is at most sqrt(d) / 2 spacings: the corners of a cell, weighted as they are, lie
    no farther than that from a point of it in the root mean square.

    Args:
        clearance: (n, d) -> (n,), of a robot that only translates.
        lower, upper: (d,) corners of what the grid covers; beyond, its border goes on.
        spacing: between nodes, at most.

    Attributes:
        values: on the nodes, one axis a dimension, float32.
        lower: (d,) the first node.
        per_unit: (d,) nodes by length.
    """

    def __init__(
        self, clearance: Callable[[Array], Array], lower: Array, upper: Array, spacing: float
    ) -> None:
        cells = np.ceil((upper - lower) / spacing).astype(int)
        axes = [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, cells, strict=True)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        values = clearance(nodes.reshape(-1, len(axes)))
        self.values = values.reshape(nodes.shape[:-1]).astype(np.float32)
        self.lower = lower
        self.per_unit = cells / (upper - lower)

    def __call__(self, q: Array) -> Array:
        """Clearances (n,) at configurations (n, d)."""
        at = ((q - self.lower) * self.per_unit).T
        found: Array = ndimage.map_coordinates(
            self.values, at, output=np.float64, order=1, mode="nearest"
        )
        return found
