"""The time field generator: from combined features to the stretch, and the derivative back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import torch
from torch import Tensor, nn

from planners.fields.activations import squareplus
from planners.fields.shape import FieldShape


class Bound(nn.Module):
    """A number mapped between -below and 1.1 log(speed ratio) - below, and the derivative."""

    def __init__(self, speed_ratio: float, below: float, opening: float) -> None:
        super().__init__()
        self.scale = 1.1 * math.log(speed_ratio)
        self.below = below
        self.opening = opening

    def forward(self, y: Tensor) -> tuple[Tensor, Tensor]:
        gate = torch.sigmoid(y + self.opening)
        return self.scale * gate - self.below, self.scale * gate * (1 - gate)


class Unbounded(nn.Module):
    """A number as it is, and the derivative."""

    def forward(self, y: Tensor) -> tuple[Tensor, Tensor]:
        return y, torch.ones_like(y)


def _head(shape: FieldShape) -> Bound | Unbounded:
    return Bound(shape.speed_ratio, shape.below, shape.opening) if shape.bounded else Unbounded()


@dataclass(frozen=True)
class Tape:
    """What the generator remembers for its reverse pass: the slopes of its layers."""

    first: Tensor
    blocks: list[Tensor]
    head: Tensor


class TimeFieldGenerator(nn.Module):
    """Stretch from the combined features of two configurations."""

    def __init__(self, shape: FieldShape, inputs: int) -> None:
        super().__init__()
        self.first = nn.Linear(inputs, shape.width)
        self.blocks = nn.ModuleList(
            nn.Linear(shape.width, shape.width) for _ in range(shape.generator_blocks)
        )
        self.last = nn.Linear(shape.width, 1)
        self.head = _head(shape)

    def forward(self, features: Tensor) -> tuple[Tensor, Tape]:
        """Stretch (n,) for `features` (n, inputs), and what `back` needs."""
        x, first = squareplus(self.first(features))
        slopes = []
        for layer in self.blocks:
            y, slope = squareplus(layer(x))
            slopes.append(slope)
            x = x + y
        stretch, head = self.head(self.last(x))
        return stretch.squeeze(-1), Tape(first, slopes, head)

    def back(self, tape: Tape) -> Tensor:
        """Derivative (n, inputs) of the stretch by the features."""
        back = tape.head * self.last.weight
        layers = cast(list[nn.Linear], list(self.blocks))
        for layer, slope in zip(reversed(layers), reversed(tape.blocks), strict=True):
            back = back + (back * slope) @ layer.weight
        return (back * tape.first) @ self.first.weight
