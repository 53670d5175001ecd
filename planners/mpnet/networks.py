"""The two networks: what the obstacles are, and where to go next.

Positions are in the learned planners' space, where the bounds' longest side is 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional


@dataclass(frozen=True)
class PlannerShape:
    """What the networks are made of.

    Attributes:
        dimension: d.
        code: length of the encoding of the obstacles.
        point_widths: of the layers that see one point at a time.
        widths: of the planning network's hidden layers.
        dropout: share of the hidden units that are left out, while planning too.
    """

    dimension: int
    code: int = 128
    point_widths: tuple[int, ...] = (64, 128, 256)
    widths: tuple[int, ...] = (448, 448, 256)
    dropout: float = 0.1


class PointEncoder(nn.Module):
    """An order-free encoder of a cloud of points: the same layers for each point, the maximum over
    all of them, and a linear layer.

    It stands where the published method has a contractive autoencoder.
    """

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        widths = (3, *shape.point_widths)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.last = nn.Linear(widths[-1], shape.code)

    def forward(self, points: Tensor) -> Tensor:
        """Codes (s, c) of clouds (s, n, 3)."""
        x = 2 * points
        for layer in self.layers:
            x = functional.relu(layer(x))
        code: Tensor = self.last(x.amax(dim=1))
        return code


class PlanningNetwork(nn.Module):
    """The next configuration on the way."""

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        widths = (shape.code + 2 * shape.dimension, *shape.widths)
        self.dropout = shape.dropout
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.last = nn.Linear(widths[-1], shape.dimension)

    def forward(self, code: Tensor, current: Tensor, goal: Tensor) -> Tensor:
        """The configuration (..., d) to go to, from `current` to `goal` (..., d) among obstacles of
        `code` (..., c)."""
        x = torch.cat([code, 2 * current, 2 * goal], dim=-1)
        for layer in self.layers:
            x = functional.dropout(functional.relu(layer(x)), self.dropout)
        step: Tensor = self.last(x)
        return current + step


class Mpnet(nn.Module):
    """Both networks."""

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        self.shape = shape
        self.encoder = PointEncoder(shape)
        self.planner = PlanningNetwork(shape)
