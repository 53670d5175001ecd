"""Coordinates that wrap, as networks are told them.

A network that is told an angle as a number does not know that both of its bounds are the same
place. So each coordinate that wraps is told as a point of a circle, whose circumference is its
period: near each other, two points are as far apart as the coordinates are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from envs.problem import Array


@dataclass(frozen=True)
class Circles:
    """Which coordinates of the networks' space wrap; by default none.

    Attributes:
        places: which of the d coordinates wrap.
        period: after which each of them is back where it was.
    """

    places: tuple[int, ...] = ()
    period: float = 1.0

    @property
    def radius(self) -> float:
        """Of each circle."""
        return self.period / (2 * math.pi)

    def embedded_size(self, dimension: int) -> int:
        """How many numbers `embedded` makes of as many coordinates."""
        return dimension + len(self.places)

    def limits(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Between which configurations are kept, (d,) each, for bounds (d,) of the networks' space:
        in coordinates that wrap they are not."""
        low, high = lower.copy(), upper.copy()
        at = list(self.places)
        low[at], high[at] = -np.inf, np.inf
        return low, high

    def shortest(self, step: Tensor) -> Tensor:
        """Differences (..., d) of configurations, the short way where coordinates wrap."""
        if not self.places:
            return step
        at = list(self.places)
        short = step.clone()
        short[..., at] -= self.period * (step[..., at] / self.period).round()
        return short

    def embedded(self, x: Array) -> Array:
        """Numbers (..., e) that tell configurations (..., d), and do not jump where coordinates
        wrap: of these radius times the sine in their places, and after all coordinates radius
        times their cosines; the other coordinates as they are."""
        if not self.places:
            return x
        at = list(self.places)
        angle = x[..., at] / self.radius
        sines = x.copy()
        sines[..., at] = self.radius * np.sin(angle)
        return np.concatenate([sines, self.radius * np.cos(angle)], axis=-1)

    def embedded_with_slopes(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The same of tensors (..., d), and the derivative (..., e) of each number by the
        coordinate that it tells, see `told`."""
        numbers, slopes = x.clone(), torch.ones_like(x)
        if not self.places:
            return numbers, slopes
        at = list(self.places)
        angle = x[..., at] / self.radius
        sine, cosine = angle.sin(), angle.cos()
        numbers[..., at], slopes[..., at] = self.radius * sine, cosine
        return (
            torch.cat([numbers, self.radius * cosine], dim=-1),
            torch.cat([slopes, -sine], dim=-1),
        )

    def told(self, dimension: int) -> list[int]:
        """Which coordinate each of the embedded numbers tells."""
        return [*range(dimension), *self.places]


NO_CIRCLES = Circles()
"""Where nothing wraps."""
