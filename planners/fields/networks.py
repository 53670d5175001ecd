"""The networks of time fields, with their derivatives by the configurations written out.

A network maps a pair of configurations to the stretch c = log(T / |qs - qg|) = -log tau, which is
bounded: the speed is between 1 and 1 / ratio, so 1 <= T / |qs - qg|, and detours aside
T / |qs - qg| <= ratio. In rooms, where detours are all that counts, the stretch is bounded by
T over |qs - qg| plus the effective resistance between the two instead, see `modes`.

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

from planners.fields.activations import sine, squareplus
from planners.fields.operators import OPERATORS, Operator
from planners.fields.rooms import CLEARANCES, RoomInputs
from planners.fields.workspace import WSpaceEncoder


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
        modes: how many modes of free space are inputs; 0 but in rooms.
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
    modes: int = 0

    @property
    def features(self) -> int:
        """Of one configuration."""
        return (4 if self.workspace else 2) * self.width


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

    Linear and random Fourier inputs, and those of rooms, then residual blocks of sine layers.
    """

    def __init__(self, shape: FieldShape) -> None:
        super().__init__()
        inputs = shape.dimension + 2 * shape.frequencies
        if shape.modes:
            inputs += CLEARANCES + shape.modes
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


class TimeField(nn.Module):
    """The stretch between pairs of configurations, and its slopes at both ends.

    Args:
        grid: occupancy of the workspace, for a shape with a w-space encoder.
        rooms: further inputs, for a shape with modes.

    Attributes:
        workspace_weight: lambda, by which the w-space encoder's features count.

    Raises:
        ValueError: there is a w-space encoder and no grid, or a grid and no encoder; or the same
            of modes and rooms.
    """

    def __init__(
        self, shape: FieldShape, grid: Tensor | None = None, rooms: RoomInputs | None = None
    ) -> None:
        super().__init__()
        if shape.workspace != (grid is not None):
            raise ValueError("a grid belongs to a w-space encoder, and only to one")
        if (shape.modes > 0) != (rooms is not None):
            raise ValueError("room inputs belong to a shape with modes, and only to one")
        self.shape = shape
        self.operator: Operator = OPERATORS[shape.operator]()
        self.encoder = CSpaceEncoder(shape)
        self.generator = TimeFieldGenerator(shape, self.operator.widening * shape.features)
        self.workspace_weight = 1.0
        self.rooms = rooms
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
        t = goals.shape[1]
        points = torch.cat([starts, goals], dim=1)
        features, jacobian = self._features(points.reshape(-1, d), self._axes(starts))
        features = features.reshape(groups, s + t, -1)
        jacobian = jacobian.reshape(d, groups, s + t, -1)
        return self._pairs(
            features[:, :s, None].expand(-1, -1, t, -1),
            jacobian[:, :, :s, None],
            features[:, None, s:].expand(-1, s, -1, -1),
            jacobian[:, :, None, s:],
            starts[:, :, None] - goals[:, None],
        )

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
        if self.rooms is None:
            return stretch
        distance = (sources[:, None] - goals).norm(dim=-1)
        resistance = ((at_source[..., f:] - at_goal[..., f:]) / 2).square().sum(-1)
        return stretch + torch.log1p(resistance / distance)

    def _axes(self, like: Tensor) -> Tensor:
        return torch.eye(self.shape.dimension, dtype=like.dtype, device=like.device)

    def _features(self, q: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Features (n, f) of configurations (n, d), and their derivatives (k, n, f) along
        `directions` (k, d). In rooms the modes follow them, as they are."""
        if self.rooms is not None:
            inputs = self.rooms(q, directions)
            learned = self.encoder(q, directions, inputs)
            joined = (
                torch.cat([a, b[..., CLEARANCES:]], -1)
                for a, b in zip(learned, inputs, strict=True)
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
            _contract(toward_start, by_start[..., :f]),
            _contract(toward_goal, by_goal[..., :f]),
        )
        if self.rooms is None:
            return found
        apart = at_start[..., f:] - at_goal[..., f:]
        lifted = _resistance_stretch(apart, by_start[..., f:], by_goal[..., f:], offset)
        base, at_one, at_other = (a + b for a, b in zip(found, lifted, strict=True))
        return base, at_one, at_other


def _resistance_stretch(
    apart: Tensor, by_start: Tensor, by_goal: Tensor, offset: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """log((|offset| + |apart / 2|^2) / |offset|) (...) and its gradients (..., d) at both ends.

    Args:
        apart: (..., m), start's modes minus goal's.
        by_start, by_goal: (d, ..., m), the modes' derivatives at each.
        offset: (..., d), start minus goal.
    """
    offset = offset + 1e-6  # never zero
    distance = offset.norm(dim=-1, keepdim=True)
    toward = offset / distance
    whole = distance + (apart / 2).square().sum(-1, keepdim=True)
    near = toward / distance
    return (
        torch.log(whole / distance).squeeze(-1),
        (toward + _contract(apart, by_start) / 2) / whole - near,
        near - (toward + _contract(apart, by_goal) / 2) / whole,
    )


def _halves_joined(a: Tensor, b: Tensor) -> Tensor:
    """Two kinds of features as one, first halves first: operators treat the halves apart."""
    (a0, a1), (b0, b1) = a.chunk(2, dim=-1), b.chunk(2, dim=-1)
    return torch.cat([a0, b0, a1, b1], dim=-1)


def _contract(by_features: Tensor, jacobian: Tensor) -> Tensor:
    """Derivatives by features (..., w) and their Jacobian (d, ..., w) to gradients (..., d)."""
    return torch.stack([(by_features * column).sum(-1) for column in jacobian], dim=-1)


def _sine_layer(layer: nn.Linear, x: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
    y, slope = sine(layer(x))
    return y, slope * functional.linear(jacobian, layer.weight)
