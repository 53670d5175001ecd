"""How the features of two configurations become the generator's input.

Each operator gives the combined features, what it needs to remember, and the way back: from the
derivative by the combined features to those by each end's features. `widening` is the width of
the combined features by that of one end's.
"""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor


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
