"""The w-space encoder: what the obstacles look like round a robot's points.

The obstacles' surface points fill a voxel grid W0 over the networks' cube. One 3-D convolution
with ReLU makes W1 of it; both are interpolated trilinearly at the robot's point and at six points
round it. The convolution is evaluated only where it is asked for: in the 4^3 voxels round each
position, of which the 2^3 results at its corners are needed, and only where those are not empty.
"""

from __future__ import annotations

import itertools

import torch
from torch import Tensor, nn
from torch.nn import functional

from planners.fields.activations import Activation, squareplus

VOXELS = 128
"""Voxels per side of the grid."""

OFFSET = 0.0222
"""Distance of the six further points along the axes, in the networks' space."""

MAPS = 16
"""Feature maps of the convolution."""


def occupancy(points: Tensor) -> Tensor:
    """Which voxels of the cube [-0.5, 0.5]^3 hold some of `points` (n, 3): (v, v, v) of bool."""
    cells = ((points + 0.5) * VOXELS).long().clamp(0, VOXELS - 1)
    grid = torch.zeros((VOXELS,) * 3, dtype=torch.bool, device=points.device)
    grid[cells[:, 0], cells[:, 1], cells[:, 2]] = True
    return grid


class WSpaceEncoder(nn.Module):
    """Features of a point of the workspace and their Jacobian.

    Args:
        width: of the features and of the hidden layer.
        grid: occupancy (v, v, v).
        activation: of the hidden layer.
    """

    def __init__(self, width: int, grid: Tensor, activation: Activation = squareplus) -> None:
        super().__init__()
        self._activation = activation
        self.grid: Tensor
        # Two empty voxels all round, for windows at the border and beyond.
        padded = functional.pad(grid, (3,) * 6)
        self.register_buffer("grid", padded, persistent=False)
        self.occupied: Tensor  # whether the window that begins at a voxel holds anything
        occupied = functional.max_pool3d(padded[None].float(), 4, stride=1)[0] > 0
        self.register_buffer("occupied", occupied, persistent=False)
        self.convolution = nn.Conv3d(1, MAPS, 3)
        self.first = nn.Linear(7 * (1 + MAPS), width)
        self.last = nn.Linear(width, width)
        steps = OFFSET * torch.cat([torch.zeros(1, 3), torch.eye(3), -torch.eye(3)])
        self.steps: Tensor
        self.register_buffer("steps", steps, persistent=False)
        self.corners: Tensor
        corners = torch.tensor(list(itertools.product((0, 1), repeat=3)))
        self.register_buffer("corners", corners, persistent=False)

    def forward(self, points: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Features (n, w) at points (n, 3) of the workspace, and their derivatives (k, n, w)
        along `directions` (k, 3)."""
        n = len(points)
        positions = (points[:, None] + self.steps.to(points)).reshape(-1, 3)
        local, by_axes = self._interpolate(positions)
        inputs = self.first.in_features
        along = torch.einsum("kd,dmc->kmc", directions, by_axes).reshape(-1, n, inputs)
        y, slope = self._activation(self.first(local.reshape(n, inputs)))
        dy = slope * functional.linear(along, self.first.weight)
        return self.last(y), functional.linear(dy, self.last.weight)

    def _interpolate(self, positions: Tensor) -> tuple[Tensor, Tensor]:
        """[W0, W1] (m, 1 + maps) at positions (m, 3), and its derivatives (3, m, 1 + maps)."""
        scaled = (positions + 0.5) * VOXELS - 0.5
        cell = scaled.detach().floor().clamp(-1, VOXELS - 1)
        share = (scaled - cell).clamp(0, 1)
        corner = cell.long() + 2  # -1 for the voxel below, 3 for the padding
        [near] = self.occupied[corner.unbind(-1)].nonzero(as_tuple=True)
        window = self._window(corner[near]).to(positions.dtype)
        maps = functional.relu(self.convolution(window[:, None]))
        both = torch.cat([window[:, None, 1:3, 1:3, 1:3], maps], dim=1).flatten(2)
        weight, slopes = self._weights(share[near])
        assert self.convolution.bias is not None
        empty = functional.pad(functional.relu(self.convolution.bias), (1, 0))
        features = empty.repeat(len(positions), 1)
        slope = features.new_zeros(3, *features.shape)
        return (
            features.index_copy(0, near, torch.einsum("mck,mk->mc", both, weight)),
            slope.index_copy(1, near, VOXELS * torch.einsum("mck,dmk->dmc", both, slopes)),
        )

    def _weights(self, share: Tensor) -> tuple[Tensor, Tensor]:
        """Trilinear weights (m, 8) of the corners, and their derivatives (3, m, 8)."""
        upper = self.corners.to(share)
        factors = 1 - upper + share[:, None] * (2 * upper - 1)
        x, y, z = factors.unbind(-1)
        dx, dy, dz = (2 * upper - 1).unbind(-1)
        return x * y * z, torch.stack([dx * y * z, x * dy * z, x * y * dz])

    def _window(self, corner: Tensor) -> Tensor:
        """The windows (m, 4, 4, 4) that begin at voxels (m, 3) of the padded grid."""
        reach = torch.arange(4, device=corner.device)
        i, j, k = corner.unbind(-1)
        return self.grid[
            (i[:, None] + reach)[:, :, None, None],
            (j[:, None] + reach)[:, None, :, None],
            (k[:, None] + reach)[:, None, None, :],
        ]
