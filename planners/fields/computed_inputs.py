"""Inputs of a network that are computed from a configuration's surroundings, not learned; among
them features of clearances.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor, nn

from envs.compiled import njit_inline
from envs.problem import Array

if TYPE_CHECKING:
    from planners.fields.clearance_field import ClearanceField
    from planners.fields.laplacian_eigenmaps import ModeArrays
    from planners.fields.robot_features import ArmClearanceField

PER_CLEARANCE = 3
"""Features of a clearance: slowness, but smooth; the clearance, but bounded; nearness."""


class ComputedInputs(nn.Module):
    """What a network is told about a configuration besides the configuration itself.

    Attributes:
        size: how many inputs there are.
    """

    size: int

    @property
    @abstractmethod
    def field(self) -> ClearanceField | ArmClearanceField:
        """What compiled code is given of clearances."""

    @property
    @abstractmethod
    def mode_arrays(self) -> ModeArrays:
        """What it is given of modes of free space."""

    @abstractmethod
    def at(self, x: Array, slopes: bool = True) -> Array:
        """Inputs at (n, d) and their derivatives along the axes, (n, 1 + d, size); the latter may
        be anything unless asked for."""

    def forward(self, q: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Inputs (n, size) at configurations (n, d), and their derivatives (k, n, size) along
        `directions` (k, d). PyTorch records no gradients of them: nothing in them is learned."""
        x = q.detach().cpu().numpy().astype(np.float64)
        rows = torch.from_numpy(self.at(x, slopes=len(directions) > 0)).to(q)
        along = torch.einsum("kd,ndf->knf", directions, rows[:, 1:])
        return rows[:, 0], along


# Compiled; they become part of their callers, and round as these are compiled.


@njit_inline
def write_clearance_features(clearance: float, rows: Any, first: int) -> tuple[float, float]:
    """Writes the features of a clearance, by d_max, to a row's places from `first` on; what
    `write_feature_slopes` wants of them."""
    root = math.sqrt(clearance * clearance + 0.01)
    bounded = math.tanh(2 * clearance)
    rows[0, first] = -math.log(0.5 * (clearance + root)) / 2
    rows[0, first + 1] = bounded
    rows[0, first + 2] = max(1 - clearance, 0.0)
    return root, bounded


@njit_inline
def write_feature_slopes(
    clearance: float, root: float, bounded: float, slope: Any, scale: float, rows: Any, first: int
) -> None:
    """Writes the features' derivatives along the axes to the rows below, from `scale` times the
    gradient (d,) of the clearance."""
    for k in range(len(slope)):
        by = scale * slope[k]
        rows[1 + k, first] = -0.5 / root * by
        rows[1 + k, first + 1] = 2 * (1 - bounded * bounded) * by
        rows[1 + k, first + 2] = -by if clearance < 1 else 0.0
