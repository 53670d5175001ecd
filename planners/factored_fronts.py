"""Arrival times by eikonalfm, which solves the factored Eikonal equation: T = T0 tau, where T0 is
the distance from the source and tau is smooth about it (Treister and Haber, "A fast marching
algorithm for the factored eikonal equation", 2016)."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from envs import InputError
from envs.compiled import njit_quick
from envs.problem import Array
from planners.fronts import Medium, Source


class FactoredFronts:
    """eikonalfm, on a grid that is moved so that one of its nodes is the exact source.

    Its sources are nodes, and the nearest one would be off by up to half a spacing. So slownesses
    are carried over to a grid with a node at the source, and tau back from there; T0 is exact on
    either grid. The front is followed to its end, as eikonalfm knows no other.

    Raises:
        InputError: eikonalfm is not installed.
    """

    goes_round: ClassVar[bool] = False

    def __init__(self) -> None:
        try:
            import eikonalfm
        except ImportError as error:
            advice = 'pip install "plannerbench[eikonalfm]"'
            raise InputError(f"solver eikonalfm: the package is not installed: {advice}") from error
        self._solve = eikonalfm.factored_fast_marching

    def arrival_times(self, medium: Medium, source: Source, until: float) -> Array:
        """See `planners.fronts.FrontSolver`."""
        before = np.floor(source.place)
        share = source.place - before
        # One more node an axis: the moved grid begins before the first and ends after the last.
        counts = np.array(medium.speed.shape)
        node = tuple(before.astype(int) + 1)
        slowness = carried(1 / medium.speed, share - 1, counts + 1)
        slowness[node] = 1 / source.speed
        tau = np.asarray(self._solve(1 / slowness, node, medium.spacing, medium.order))
        distances = source.outside + source.radius
        times: Array = distances * carried(tau, 1 - share, counts) - source.radius / source.speed
        return times


def carried(values: Array, offset: Array, counts: Array) -> Array:
    """Values (n0, n1, ...) of nodes, on others that are as far apart.

    Cubic along each axis in turn, and never beyond the two nodes next to a place: a wall of one
    node keeps its slowness, and there are no waves beside it. Beyond the first and last nodes
    their values go on.

    Args:
        values: on the nodes.
        offset: (d,) from the first node to the first of the others, in spacings.
        counts: (d,) of the others along each axis.
    """
    for axis, (first, count) in enumerate(zip(offset, counts, strict=True)):
        shape = list(values.shape)
        by_axis = np.ascontiguousarray(values).reshape(math.prod(shape[:axis]), shape[axis], -1)
        shape[axis] = int(count)
        found = np.empty((by_axis.shape[0], shape[axis], by_axis.shape[2]))
        step = math.floor(first)
        _carry(by_axis, step, _cubic_weights(first - step), found)
        values = found.reshape(shape)
    return values


def _cubic_weights(share: float) -> Array:
    """Lagrange's weights (4,) of the nodes at -1, 0, 1 and 2, for a place between 0 and 1."""
    u = share
    return np.array(
        [
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        ]
    )


@njit_quick
def _carry(values: Array, step: int, weights: Array, found: Array) -> None:
    """Fills `found` (a, m, b) from `values` (a, n, b): node i from those about node i + step."""
    last = values.shape[1] - 1
    for a in range(found.shape[0]):
        for i in range(found.shape[1]):
            k = i + step
            before, below = min(max(k - 1, 0), last), min(max(k, 0), last)
            above, after = min(max(k + 1, 0), last), min(max(k + 2, 0), last)
            for b in range(found.shape[2]):
                low, high = values[a, below, b], values[a, above, b]
                value = weights[0] * values[a, before, b] + weights[1] * low
                value += weights[2] * high + weights[3] * values[a, after, b]
                found[a, i, b] = min(max(value, min(low, high)), max(low, high))
