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

import torch
from torch import Tensor, nn

from planners.fields.arm_inputs import ArmInputs
from planners.fields.encoder import CSpaceEncoder
from planners.fields.generator import TimeFieldGenerator
from planners.fields.operators import OPERATORS, Operator, contract
from planners.fields.rooms import RoomInputs, effective_resistance, resistance_stretch
from planners.fields.shape import FieldShape
from planners.fields.workspace import WSpaceEncoder

ComputedInputs = RoomInputs | ArmInputs
"""What a network is told about a configuration besides the configuration itself."""


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
        apart = at_start[..., f:] - at_goal[..., f:]
        lifted = resistance_stretch(apart, by_start[..., f:], by_goal[..., f:], offset)
        base, at_one, at_other = (a + b for a, b in zip(found, lifted, strict=True))
        return base, at_one, at_other


def _halves_joined(a: Tensor, b: Tensor) -> Tensor:
    """Two kinds of features as one, first halves first: operators treat the halves apart."""
    (a0, a1), (b0, b1) = a.chunk(2, dim=-1), b.chunk(2, dim=-1)
    return torch.cat([a0, b0, a1, b1], dim=-1)
