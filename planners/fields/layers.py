"""Layers of time fields' networks, with their derivatives.

The encoder carries the Jacobian of a configuration's features forward. An operator combines the
features of two configurations: it gives the combined features, what it needs to remember, and the
way back, from the derivative by the combined features to those by each end's. `widening` is the
width of the combined features by that of one end's. The generator makes the stretch of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, cast

import torch
from torch import Tensor, nn
from torch.nn import functional

from planners.learning.circles import NO_CIRCLES, Circles


@dataclass(frozen=True)
class FieldShape:
    """What a network is made of.

    Attributes:
        dimension: d.
        frequencies: number of random Fourier features.
        bandwidth: standard deviation of their frequencies, in periods per side of the space.
        width: of all hidden layers, and half of the number of features of a configuration.
        speed_ratio: the highest speed by the lowest, which bounds the stretch.
        below: how far the bounds of the stretch reach below 0.
        opening: where between the bounds an untrained network's stretch is, as log odds.
        operator: how two configurations' features are combined, see `OPERATORS`.
        bounded: whether the stretch is bounded.
        workspace: whether there is a w-space encoder.
        computed: how many inputs are computed from the environment, see `ComputedInputs`.
        modes: how many of them, the last ones, are modes of free space; 0 but in rooms.
        circles: which coordinates wrap.
    """

    dimension: int
    frequencies: int = 32
    bandwidth: float = 0.7
    width: int = 128
    encoder_blocks: int = 2
    generator_blocks: int = 2
    speed_ratio: float = 10.0
    below: float = 0.08
    opening: float = -1.0
    operator: str = "smooth"
    bounded: bool = True
    workspace: bool = False
    computed: int = 0
    modes: int = 0
    circles: Circles = NO_CIRCLES

    @property
    def features(self) -> int:
        """Of one configuration."""
        return (4 if self.workspace else 2) * self.width


Activation = Callable[[Tensor], tuple[Tensor, Tensor]]


def sine(x: Tensor) -> tuple[Tensor, Tensor]:
    """sin x."""
    return x.sin(), x.cos()


def squareplus(x: Tensor) -> tuple[Tensor, Tensor]:
    """(x + sqrt(x^2 + 1)) / 2, a smooth ReLU."""
    root = torch.sqrt(x**2 + 1)
    return (x + root) / 2, (1 + x / root) / 2


def elu(x: Tensor) -> tuple[Tensor, Tensor]:
    """x above 0, exp(x) - 1 below."""
    y = functional.elu(x)
    return y, torch.where(x > 0, torch.ones_like(x), y + 1)


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
    Coordinates that wrap are told as points of circles, in both of the former.
    """

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        self._circles = shape.circles
        numbers = shape.circles.embedded_size(shape.dimension)
        inputs = numbers + 2 * shape.frequencies + shape.computed
        self.waves: Tensor
        self.register_buffer("waves", shape.bandwidth * torch.randn(shape.frequencies, numbers))
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
        along = directions[:, None, :]
        if self._circles.places:
            told = self._circles.told(q.shape[-1])
            q, slopes = self._circles.embedded_with_slopes(q)
            along = along[..., told] * slopes
        phase = q @ self.waves.T * (2 * math.pi)
        sine, cosine = phase.sin(), phase.cos()
        turn = 2 * math.pi * along @ self.waves.T
        straight = 2 * along.expand(-1, *q.shape)
        return (
            torch.cat([2 * q, sine, cosine], dim=-1),
            torch.cat([straight, cosine * turn, -sine * turn], dim=-1),
        )


def _sine_layer(layer: nn.Linear, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
    y, slope = sine(layer(x))
    return y, slope * functional.linear(jacobian, layer.weight)


class Operator(Protocol):
    """Combines the features of two configurations."""

    widening: int

    def combine(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        """Combined features (..., widening w) of two (..., w), and the bend, for `back`."""

    def back(self, by_combined: Tensor, bend: Tensor) -> tuple[Tensor, Tensor]:
        """Derivatives by a's and by b's features, each (..., w)."""


class SmoothSymmetric:
    """A smooth symmetric combination of two feature vectors.

    The features come in halves (phi, psi). The result is (|phi_a - phi_b|, psi_a + psi_b), the
    first smoothed at 0: up to a linear map the same as the paper's max and min, with a gradient
    everywhere. Swapping a and b gives exactly the same numbers.
    """

    widening = 1
    smoothing = 1e-2

    def combine(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        phi_a, psi_a = a.chunk(2, dim=-1)
        phi_b, psi_b = b.chunk(2, dim=-1)
        difference = phi_a - phi_b
        size = torch.sqrt(difference**2 + self.smoothing**2)
        return torch.cat([size, psi_a + psi_b], dim=-1), difference / size

    def back(self, by_combined: Tensor, bend: Tensor) -> tuple[Tensor, Tensor]:
        by_phi, by_psi = by_combined.chunk(2, dim=-1)
        by_phi = by_phi * bend
        return torch.cat([by_phi, by_psi], dim=-1), torch.cat([-by_phi, by_psi], dim=-1)


class MaxMin:
    """The paper's operator: [max(a, b), min(a, b)]. Exactly symmetric."""

    widening = 2

    def combine(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        return torch.cat([torch.maximum(a, b), torch.minimum(a, b)], dim=-1), (a >= b).to(a.dtype)

    def back(self, by_combined: Tensor, bend: Tensor) -> tuple[Tensor, Tensor]:
        by_max, by_min = by_combined.chunk(2, dim=-1)
        return by_min + bend * (by_max - by_min), by_max + bend * (by_min - by_max)


class Concatenation:
    """[a, b]: no symmetry, as in EikoNet."""

    widening = 2

    def combine(self, a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
        together = torch.cat([a, b], dim=-1)
        return together, together[..., :0]

    def back(self, by_combined: Tensor, bend: Tensor) -> tuple[Tensor, Tensor]:
        by_a, by_b = by_combined.chunk(2, dim=-1)
        return by_a, by_b


def contract(by_features: Tensor, jacobian: Tensor) -> Tensor:
    """Derivatives by features (..., w) and their Jacobian (d, ..., w) to gradients (..., d)."""
    return torch.stack([(by_features * column).sum(-1) for column in jacobian], dim=-1)


OPERATORS: dict[str, type[SmoothSymmetric] | type[MaxMin] | type[Concatenation]] = {
    "smooth": SmoothSymmetric,
    "maxmin": MaxMin,
    "concatenation": Concatenation,
}


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


def every_pair(
    features: Tensor, jacobian: Tensor, groups: int, starts: int
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Every start with every goal of a group: features (g, s, t, f) and Jacobians, which fit
    (d, g, s, t, f), of either.

    Args:
        features: (g (s + t), f), of each group's starts and then its goals.
        jacobian: (d, g (s + t), f).
        groups, starts: g and s.
    """
    features = features.reshape(groups, -1, features.shape[-1])
    jacobian = jacobian.reshape(len(jacobian), *features.shape)
    goals = features.shape[1] - starts
    return (
        features[:, :starts, None].expand(-1, -1, goals, -1),
        jacobian[:, :, :starts, None],
        features[:, None, starts:].expand(-1, starts, -1, -1),
        jacobian[:, :, None, starts:],
    )
