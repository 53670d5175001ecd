"""Steepest descent in a field that is known on the nodes of a regular grid."""

from __future__ import annotations

import itertools

import numpy as np

from envs.problem import Array

_STEP = 0.5  # length of a step, in grid spacings


class GridField:
    """A scalar field, multilinearly interpolated.

    Args:
        values: on the nodes, one axis a dimension, each at least 4 long.
        lower: (d,) position of the first node.
        spacing: (d,) between nodes.
    """

    def __init__(self, values: Array, lower: Array, spacing: Array) -> None:
        self._values = values
        self._lower = lower
        self._spacing = spacing
        self._cells = np.array(values.shape) - 2
        d = values.ndim
        self._corners = np.array(list(itertools.product((0, 1), repeat=d)))
        self._axes = np.eye(d, dtype=int)

    def descend(self, start: Array, goal: Array, radius: float) -> Array | None:
        """The path (k, d) of steepest descent from `start` to `goal`, or None if it gets stuck.

        Goes on until `goal` is within `radius`, then straight; each step is half a spacing long,
        in the direction of the gradient half a step ahead (midpoint rule).
        """
        length = _STEP * float(self._spacing.min())
        upper = self._lower + self._spacing * (self._cells + 1)
        q = np.array(start)
        path = [q]
        for _ in range(_STEP_LIMIT * max(self._values.shape)):
            if np.linalg.norm(q - goal) <= radius:
                return np.array([*path, goal])
            direction = self._downhill(q)
            if direction is None:
                return None
            ahead = self._downhill(np.clip(q + 0.5 * length * direction, self._lower, upper))
            direction = direction if ahead is None else ahead
            q = np.clip(q + length * direction, self._lower, upper)
            path.append(q)
        return None

    def _downhill(self, q: Array) -> Array | None:
        """The unit vector (d,) of steepest descent at `q`, or None where the field is flat."""
        gradient = self.gradient(q)
        norm = float(np.sqrt(gradient @ gradient))
        return None if norm == 0 else -gradient / norm

    def gradient(self, q: Array) -> Array:
        """Gradient (d,) at `q`: central differences at the corners of its cell, interpolated."""
        position = (q - self._lower) / self._spacing
        cell = np.clip(position.astype(int), 0, self._cells)
        weight = position - cell
        corners = cell + self._corners
        weights = np.prod(np.where(self._corners == 1, weight, 1 - weight), axis=1)
        last = self._cells + 1
        above = np.minimum(corners[:, None] + self._axes, last)
        below = np.maximum(corners[:, None] - self._axes, 0)
        rise = self._at(above) - self._at(below)
        run = np.diagonal(above - below, axis1=1, axis2=2) * self._spacing
        gradient: Array = weights @ (rise / run)
        return gradient

    def _at(self, index: Array) -> Array:
        values: Array = self._values[tuple(np.moveaxis(index, -1, 0))]
        return values


_STEP_LIMIT = 20  # steps per node of an axis: ten times across the grid
