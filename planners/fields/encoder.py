"""The encoder of configurations, which carries the Jacobian of its features forward."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from planners.fields.activations import sine
from planners.fields.shape import FieldShape


class SineBlock(nn.Module):
    """A residual block of two sine layers that carries a Jacobian along."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Linear(width, width)
        self.second = nn.Linear(width, width)

    def forward(self, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
        """New features (n, w) and Jacobian (k, n, w)."""
        y, dy = _sine_layer(self.first, x, jacobian)
        y, dy = _sine_layer(self.second, y, dy)
        return x + y, jacobian + dy


class CSpaceEncoder(nn.Module):
    """Features of configurations and their Jacobian.

    Linear and random Fourier inputs, and computed ones, then residual blocks of sine layers.
    """

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        inputs = shape.dimension + 2 * shape.frequencies + shape.computed
        self.waves: Tensor
        self.register_buffer(
            "waves", shape.bandwidth * torch.randn(shape.frequencies, shape.dimension)
        )
        self.first = nn.Linear(inputs, shape.width)
        self.blocks = nn.ModuleList(SineBlock(shape.width) for _ in range(shape.encoder_blocks))
        self.last = nn.Linear(shape.width, 2 * shape.width)

    def forward(
        self, q: Tensor, directions: Tensor, more: tuple[Tensor, Tensor] | None = None
    ) -> tuple[Tensor, Tensor]:
        """Features (n, 2 width) of configurations (n, d), and their derivatives (k, n, 2 width)
        along `directions` (k, d); `more` are further inputs with theirs."""
        x, jacobian = self._inputs(q, directions)
        if more is not None:
            x = torch.cat([x, more[0]], dim=-1)
            jacobian = torch.cat([jacobian, more[1]], dim=-1)
        x, jacobian = _sine_layer(self.first, x, jacobian)
        for block in self.blocks:
            x, jacobian = block(x, jacobian)
        return self.last(x), functional.linear(jacobian, self.last.weight)

    def _inputs(self, q: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        phase = q @ self.waves.T * (2 * math.pi)
        sine, cosine = phase.sin(), phase.cos()
        turn = (2 * math.pi * directions @ self.waves.T)[:, None, :]
        straight = 2 * directions[:, None, :].expand(-1, *q.shape)
        return (
            torch.cat([2 * q, sine, cosine], dim=-1),
            torch.cat([straight, cosine * turn, -sine * turn], dim=-1),
        )


def _sine_layer(layer: nn.Linear, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
    y, slope = sine(layer(x))
    return y, slope * functional.linear(jacobian, layer.weight)
