"""The networks of time fields, with their derivatives by the configurations written out.

A network maps a pair of configurations to the stretch c = log(T / |qs - qg|) = -log tau, which is
bounded: the speed is at most 1 and at least d_min / d_max, so 1 <= T / |qs - qg|, and detours aside
T / |qs - qg| <= d_max / d_min.

The Jacobian of each configuration's features is carried forward through the encoder, d columns
at once, and the generator's derivative by its features is written as an explicit reverse pass.
Both are ordinary tensor code, so training needs one backward pass instead of two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import torch
from torch import Tensor, nn
from torch.nn import functional


@dataclass(frozen=True)
class FieldShape:
    """The sizes of a network.

    `dimension` is d; `frequencies` the number of random Fourier features; `width` that of all
    hidden layers and of each of the two feature vectors of a configuration; `speed_ratio` is
    d_max / d_min, which bounds the stretch.
    """

    dimension: int
    frequencies: int = 32
    width: int = 128
    encoder_blocks: int = 2
    generator_blocks: int = 2
    speed_ratio: float = 10.0


class SineBlock(nn.Module):
    """A residual block of two sine layers that carries a Jacobian along."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Linear(width, width)
        self.second = nn.Linear(width, width)

    def forward(self, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
        """New features (n, w) and Jacobian (d, n, w)."""
        y, dy = _sine(*_linear(self.first, x, jacobian))
        y, dy = _sine(*_linear(self.second, y, dy))
        return x + y, jacobian + dy


class CSpaceEncoder(nn.Module):
    """Features of configurations and their Jacobian.

    Linear and random Fourier inputs, then residual blocks of sine layers.
    """

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        inputs = shape.dimension + 2 * shape.frequencies
        self.waves: Tensor
        self.register_buffer("waves", torch.randn(shape.frequencies, shape.dimension))
        self.first = nn.Linear(inputs, shape.width)
        self.blocks = nn.ModuleList(SineBlock(shape.width) for _ in range(shape.encoder_blocks))
        self.last = nn.Linear(shape.width, 2 * shape.width)

    def forward(self, q: Tensor) -> tuple[Tensor, Tensor]:
        """Features (n, 2 width) and their Jacobian (d, n, 2 width) for configurations (n, d)."""
        x, jacobian = self._inputs(q)
        x, jacobian = _sine(*_linear(self.first, x, jacobian))
        for block in self.blocks:
            x, jacobian = block(x, jacobian)
        return _linear(self.last, x, jacobian)

    def _inputs(self, q: Tensor) -> tuple[Tensor, Tensor]:
        phase = q @ self.waves.T * (2 * math.pi)
        sine, cosine = phase.sin(), phase.cos()
        n, d = q.shape
        turn = (2 * math.pi * self.waves.T)[:, None, :]
        identity = 2 * torch.eye(d, dtype=q.dtype, device=q.device)[:, None, :].expand(d, n, d)
        return (
            torch.cat([2 * q, sine, cosine], dim=-1),
            torch.cat([identity, cosine * turn, -sine * turn], dim=-1),
        )


class TimeFieldGenerator(nn.Module):
    """Stretch from the combined features of two configurations, with its derivative by them."""

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        self.first = nn.Linear(2 * shape.width, shape.width)
        self.blocks = nn.ModuleList(
            nn.Linear(shape.width, shape.width) for _ in range(shape.generator_blocks)
        )
        self.last = nn.Linear(shape.width, 1)
        self._scale = 1.1 * math.log(shape.speed_ratio)

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Stretch (n,) and its derivative (n, 2 width) by `features` (n, 2 width)."""
        z = self.first(features)
        x, bend = _squareplus(z)
        bends = []
        layers = cast(list[nn.Linear], list(self.blocks))
        for layer in layers:
            y, slope = _squareplus(layer(x))
            bends.append(slope)
            x = x + y
        gate = torch.sigmoid(self.last(x) - 1)
        stretch = (self._scale * gate - 0.08).squeeze(-1)
        back = self._scale * gate * (1 - gate) * self.last.weight
        for layer, slope in zip(reversed(layers), reversed(bends), strict=True):
            back = back + (back * slope) @ layer.weight
        return stretch, (back * bend) @ self.first.weight


class SymmetricOperator(nn.Module):
    """A smooth symmetric combination of two feature vectors.

    The features come in halves (phi, psi). The result is (|phi_a - phi_b|, psi_a + psi_b), the
    first smoothed at 0: up to a linear map the same as the paper's max and min, with a gradient
    everywhere. Swapping a and b gives exactly the same numbers.
    """

    smoothing = 1e-2

    def forward(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        """Combined features (..., w) of two (..., w), and the derivative (..., w / 2) of its
        first half by phi_a, which is the negative of that by phi_b."""
        phi_a, psi_a = a.chunk(2, dim=-1)
        phi_b, psi_b = b.chunk(2, dim=-1)
        difference = phi_a - phi_b
        size = torch.sqrt(difference**2 + self.smoothing**2)
        return torch.cat([size, psi_a + psi_b], dim=-1), difference / size


class TimeField(nn.Module):
    """The stretch between pairs of configurations, and its slopes at both ends."""

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        self.shape = shape
        self.encoder = CSpaceEncoder(shape)
        self.combine = SymmetricOperator()
        self.generator = TimeFieldGenerator(shape)

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Stretch (n,) and its gradients (n, d) by starts and goals (n, d)."""
        n = len(start)
        features, jacobian = self.encoder(torch.cat([start, goal]))
        return self._pairs(features[:n], jacobian[:, :n], features[n:], jacobian[:, n:])

    def all_pairs(self, starts: Tensor, goals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The same for every start with every goal of a group.

        Args:
            starts, goals: (g, s, d) and (g, t, d).

        Returns:
            (g, s, t), (g, s, t, d) and (g, s, t, d).
        """
        groups, s, d = starts.shape
        t = goals.shape[1]
        points = torch.cat([starts, goals], dim=1)
        features, jacobian = self.encoder(points.reshape(-1, d))
        features = features.reshape(groups, s + t, -1)
        jacobian = jacobian.reshape(d, groups, s + t, -1)
        return self._pairs(
            features[:, :s, None],
            jacobian[:, :, :s, None],
            features[:, None, s:],
            jacobian[:, :, None, s:],
        )

    def _pairs(
        self, at_start: Tensor, by_start: Tensor, at_goal: Tensor, by_goal: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        combined, bend = self.combine(at_start, at_goal)
        shape = combined.shape[:-1]
        stretch, back = self.generator(combined.reshape(-1, combined.shape[-1]))
        back = back.reshape(combined.shape)
        by_phi, by_psi = back.chunk(2, dim=-1)
        by_phi = by_phi * bend
        toward_start = torch.cat([by_phi, by_psi], dim=-1)
        toward_goal = torch.cat([-by_phi, by_psi], dim=-1)
        return (
            stretch.reshape(shape),
            _contract(toward_start, by_start),
            _contract(toward_goal, by_goal),
        )


def _contract(by_features: Tensor, jacobian: Tensor) -> Tensor:
    """Derivatives by features (..., w) and their Jacobian (d, ..., w) to gradients (..., d)."""
    return torch.stack([(by_features * column).sum(-1) for column in jacobian], dim=-1)


def _linear(layer: nn.Linear, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
    return layer(x), functional.linear(jacobian, layer.weight)


def _sine(x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
    return x.sin(), x.cos() * jacobian


def _squareplus(x: Tensor) -> tuple[Tensor, Tensor]:
    """(x + sqrt(x^2 + 1)) / 2, a smooth ReLU, and its derivative."""
    root = torch.sqrt(x**2 + 1)
    return (x + root) / 2, (1 + x / root) / 2
