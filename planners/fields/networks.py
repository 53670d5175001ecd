"""The networks of time fields, with their derivatives by the configurations written out.

A network maps a pair of configurations to the stretch c = log(T / |qs - qg|) = -log tau, which is
bounded: the speed is between 1 and 1 / ratio, so 1 <= T / |qs - qg|, and detours aside
T / |qs - qg| <= ratio. In rooms, where detours are all that counts, the stretch is bounded by
T over |qs - qg| plus the effective resistance between the two instead, see `laplacian_eigenmaps`.

The Jacobian of each configuration's features is carried forward through the encoder, d columns
at once, and the generator's derivative by its features is written as an explicit reverse pass.
Both are ordinary tensor code, so training needs one backward pass instead of two.

The w-space encoder says what the obstacles look like round a robot's points. Their surface points
fill a voxel grid W0 over the networks' cube. One 3-D convolution with ReLU makes W1 of it; both are
interpolated trilinearly at the robot's point and at six points round it. The convolution is
evaluated only where it is asked for: in the 4^3 voxels round each position, of which the 2^3
results at its corners are needed, and only where those are not empty.
"""

from __future__ import annotations

import itertools

import torch
from torch import Tensor, nn
from torch.nn import functional

from planners.fields.computed_inputs import ComputedInputs
from planners.fields.indoor_features import effective_resistance, resistance_stretch
from planners.fields.layers import (
    OPERATORS,
    Activation,
    CSpaceEncoder,
    FieldShape,
    Operator,
    TimeFieldGenerator,
    contract,
    every_pair,
    squareplus,
)


class TimeField(nn.Module):
    """The stretch between pairs of configurations, and its slopes at both ends.

    Args:
        grid: occupancy of the workspace, for a shape with a w-space encoder.
        inputs: computed ones, for a shape that has such.

    Attributes:
        workspace_weight: lambda, by which the w-space encoder's features count.

    Raises:
        ValueError: there is a w-space encoder and no grid, or a grid and no encoder; or the same
            of computed inputs.
    """

    def __init__(
        self,
        shape: FieldShape,
        grid: Tensor | None = None,
        inputs: ComputedInputs | None = None,
    ) -> None:
        super().__init__()
        if shape.workspace != (grid is not None):
            raise ValueError("a grid belongs to a w-space encoder, and only to one")
        if shape.computed != (0 if inputs is None else inputs.size):
            raise ValueError("computed inputs belong to a shape that has as many")
        self.shape = shape
        self.operator: Operator = OPERATORS[shape.operator]()
        self.encoder = CSpaceEncoder(shape)
        self.generator = TimeFieldGenerator(shape, self.operator.widening * shape.features)
        self.workspace_weight: Tensor
        self.register_buffer("workspace_weight", torch.ones(()), persistent=False)
        self.inputs = inputs
        self.workspace = None if grid is None else WSpaceEncoder(2 * shape.width, grid)

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Stretch (n,) and its gradients (n, d) by starts and goals (n, d)."""
        n = len(start)
        features, jacobian = self._features(torch.cat([start, goal]), self._axes(start))
        ends = features[:n], jacobian[:, :n], features[n:], jacobian[:, n:]
        return self._pairs(*ends, start - goal)

    def all_pairs(self, starts: Tensor, goals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The same for every start with every goal of a group.

        Args:
            starts, goals: (g, s, d) and (g, t, d).

        Returns:
            (g, s, t), (g, s, t, d) and (g, s, t, d).
        """
        groups, s, d = starts.shape
        points = torch.cat([starts, goals], dim=1)
        features, jacobian = self._features(points.reshape(-1, d), self._axes(starts))
        ends = every_pair(features, jacobian, groups, s)
        return self._pairs(*ends, starts[:, :, None] - goals[:, None])

    def stretch(self, sources: Tensor, goals: Tensor) -> Tensor:
        """The stretch (g, t) alone, between sources (g, d) and goals (g, t, d) of each."""
        groups, t, d = goals.shape
        points = torch.cat([sources[:, None], goals], dim=1).reshape(-1, d)
        features, _ = self._features(points, points.new_zeros(0, d))
        features = features.reshape(groups, 1 + t, -1)
        at_source, at_goal = features[:, :1].expand(-1, t, -1), features[:, 1:]
        f = self.shape.features
        combined, _ = self.operator.combine(
            at_source[..., :f].reshape(groups * t, f), at_goal[..., :f].reshape(groups * t, f)
        )
        stretch: Tensor = self.generator(combined)[0].reshape(groups, t)
        if self.shape.modes == 0:
            return stretch
        distance = (sources[:, None] - goals).norm(dim=-1)
        resistance = effective_resistance(at_source[..., f:] - at_goal[..., f:])
        return stretch + torch.log1p(resistance / distance)

    def _axes(self, like: Tensor) -> Tensor:
        return torch.eye(self.shape.dimension, dtype=like.dtype, device=like.device)

    def _features(self, q: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Features (n, f) of configurations (n, d), and their derivatives (k, n, f) along
        `directions` (k, d). In rooms the modes follow them, as they are."""
        if self.inputs is not None:
            inputs = self.inputs(q, directions)
            learned = self.encoder(q, directions, inputs)
            modes = self.shape.computed - self.shape.modes
            joined = (
                torch.cat([a, b[..., modes:]], -1) for a, b in zip(learned, inputs, strict=True)
            )
            return next(joined), next(joined)
        direct: tuple[Tensor, Tensor] = self.encoder(q, directions)
        if self.workspace is None:
            return direct
        local = self.workspace(q, directions)
        return (
            _halves_joined(direct[0], self.workspace_weight * local[0]),
            _halves_joined(direct[1], self.workspace_weight * local[1]),
        )

    def _pairs(
        self, at_start: Tensor, by_start: Tensor, at_goal: Tensor, by_goal: Tensor, offset: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        f = self.shape.features
        combined, bend = self.operator.combine(at_start[..., :f], at_goal[..., :f])
        shape = combined.shape[:-1]
        stretch, tape = self.generator(combined.reshape(-1, combined.shape[-1]))
        back = self.generator.back(tape).reshape(combined.shape)
        toward_start, toward_goal = self.operator.back(back, bend)
        found = (
            stretch.reshape(shape),
            contract(toward_start, by_start[..., :f]),
            contract(toward_goal, by_goal[..., :f]),
        )
        if self.shape.modes == 0:
            return found
        difference = at_start[..., f:] - at_goal[..., f:]
        lifted = resistance_stretch(difference, by_start[..., f:], by_goal[..., f:], offset)
        base, at_one, at_other = (a + b for a, b in zip(found, lifted, strict=True))
        return base, at_one, at_other


def _halves_joined(a: Tensor, b: Tensor) -> Tensor:
    """Two kinds of features as one, first halves first: operators treat the halves apart."""
    (a0, a1), (b0, b1) = a.chunk(2, dim=-1), b.chunk(2, dim=-1)
    return torch.cat([a0, b0, a1, b1], dim=-1)


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
