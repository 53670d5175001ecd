"""What a network is told about a configuration in rooms, besides the configuration itself.

A w-space encoding that is computed: clearances at the point and at six about it, as the paper's
encoder samples its features, and the slow modes of diffusion, see `laplacian_eigenmaps`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from envs import Environment
from envs.compiled import njit_cached_quick
from envs.problem import Array
from planners.fields.clearance_field import ClearanceField, clearance_at, clearance_map_of, uphill
from planners.fields.computed_inputs import (
    PER_CLEARANCE,
    ComputedInputs,
    write_clearance_features,
    write_feature_slopes,
)
from planners.fields.laplacian_eigenmaps import ModeArrays, Modes, modes_at
from planners.fields.layers import contract

_OFFSETS = 0.6 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
"""Of the points at which clearances are taken, by d_max."""

CLEARANCES = PER_CLEARANCE * len(_OFFSETS)
"""How many inputs are not modes."""

_DIFFERENCE = 0.02
"""Half the step of central differences of modes, by d_max."""


class RoomInputs(ComputedInputs):
    """Inputs of a network: `CLEARANCES` of them, then the modes.

    Args:
        env: in three dimensions, with a robot that only translates.
        count: of modes.

    Attributes:
        size: how many inputs there are.
    """

    def __init__(self, env: Environment, count: int) -> None:
        super().__init__()
        self.clearances = clearance_map_of(env)
        self.modes = Modes(self.clearances, count)
        self.size = CLEARANCES + count

    @property
    def field(self) -> ClearanceField:
        return self.clearances.field

    @property
    def mode_arrays(self) -> ModeArrays:
        return self.modes.arrays

    def at(self, x: Array, slopes: bool = True) -> Array:
        rows = np.zeros((len(x), 4, self.size))
        _all_inputs(self.modes.arrays, self.clearances.field, x, slopes, rows)
        return rows


def effective_resistance(difference: Tensor) -> Tensor:
    """Between pairs of places (...), from the differences (..., m) of their modes."""
    return (difference / 2).square().sum(-1)


def resistance_stretch(
    difference: Tensor, by_start: Tensor, by_goal: Tensor, offset: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """log((|offset| + |difference / 2|^2) / |offset|) (...), its gradients (..., d) at both ends.

    Args:
        difference: (..., m), start's modes minus goal's.
        by_start, by_goal: (d, ..., m), the modes' derivatives at each.
        offset: (..., d), start minus goal.
    """
    offset = offset + 1e-6  # never zero
    distance = offset.norm(dim=-1, keepdim=True)
    toward = offset / distance
    whole = distance + effective_resistance(difference)[..., None]
    near = toward / distance
    return (
        torch.log(whole / distance).squeeze(-1),
        (toward + contract(difference, by_start) / 2) / whole - near,
        near - (toward + contract(difference, by_goal) / 2) / whole,
    )


@njit_cached_quick
def room_inputs(modes: Any, field: Any, x: Any, slopes: bool, rows: Any) -> None:
    """Writes the inputs at (3,), and their derivatives along each axis if asked for, (4, size)."""
    slope = np.zeros(3)
    point = np.empty(3)
    for p in range(len(_OFFSETS)):
        for axis in range(3):
            point[axis] = x[axis] + _OFFSETS[p, axis] * field.reach
        clearance = clearance_at(field, point[0], point[1], point[2])
        clearance = min(max(clearance, -0.3), 1.5)
        if slopes:
            uphill(field, point, slope)
        at = PER_CLEARANCE * p
        root, bounded = write_clearance_features(clearance, rows, at)
        write_feature_slopes(clearance, root, bounded, slope, 1.0, rows, at)
    _mode_inputs(modes, field, x, slopes, rows[:, CLEARANCES:])


@njit_cached_quick
def _mode_inputs(modes: Any, field: Any, x: Any, slopes: bool, rows: Any) -> None:
    modes_at(modes, field, x, rows[0])
    if not slopes:
        return
    h = _DIFFERENCE * field.reach
    point = x.copy()
    below = np.empty(rows.shape[1])
    for axis in range(3):
        point[axis] = x[axis] - h
        modes_at(modes, field, point, below)
        point[axis] = x[axis] + h
        modes_at(modes, field, point, rows[1 + axis])
        point[axis] = x[axis]
        for m in range(len(below)):
            rows[1 + axis, m] = (rows[1 + axis, m] - below[m]) / (2 * h)


@njit_cached_quick
def _all_inputs(modes: Any, field: Any, x: Any, slopes: bool, rows: Any) -> None:
    for n in range(len(x)):
        room_inputs(modes, field, x[n], slopes, rows[n])
