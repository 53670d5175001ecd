"""The spaces of OMPL's that a configuration space is a product of, and the order of its numbers
there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from envs.spaces import Kind, Space

_TURN = 2 * math.pi

_HALVES = {Kind.ROTATIONS: 2.0}
"""By how much OMPL's distance is less than ours: that of rotations is half the angle."""


@dataclass(frozen=True, eq=False)
class Factor:
    """A space of OMPL's that is part of a product.

    Attributes:
        kind: what it is.
        numbers: (n,) of int, places of its numbers in a configuration.
        weight: of its distance as OMPL has it.
        lower, upper: (n,) bounds.
    """

    kind: Kind
    numbers: NDArray[np.int64]
    weight: float
    lower: Array
    upper: Array


def factors_of(space: Space) -> list[Factor]:
    """Those of a configuration space."""
    found = []
    begin = 0
    for part in space.parts:
        for factor in part.factors():
            lower, upper = part.lower[factor.places], part.upper[factor.places]
            weight = part.weight * _HALVES.get(factor.kind, 1.0)
            found.append(Factor(factor.kind, begin + factor.places, weight, lower, upper))
        begin += part.size
    return found


def is_flat(factors: Sequence[Factor]) -> bool:
    """Whether it is one space of real vectors."""
    return [factor.kind for factor in factors] == [Kind.REALS]


def name_of(factors: Sequence[Factor]) -> str | None:
    """SE2 or SE3, where the product is one and positions have a weight of at least 1, which their
    informed sampling takes for granted; else None."""
    kinds = tuple((factor.kind, len(factor.numbers)) for factor in factors)
    return _NAMED.get(kinds) if factors[0].weight >= 1 else None


_NAMED: dict[tuple[tuple[Kind, int], ...], str] = {
    ((Kind.REALS, 2), (Kind.CIRCLE, 1)): "SE2",
    ((Kind.REALS, 3), (Kind.ROTATIONS, 4)): "SE3",
}


class Order:
    """Configurations and the numbers of OMPL's states, one factor after the other.

    Args:
        space: whose configurations.
        factors: of it.
    """

    def __init__(self, space: Space, factors: Sequence[Factor]) -> None:
        self._order = np.concatenate([factor.numbers for factor in factors])
        circles = [factor.numbers for factor in factors if factor.kind is Kind.CIRCLE]
        self._circles = np.concatenate([np.zeros(0, dtype=np.int64), *circles])
        self._begin = space.lower[self._circles]

    def __len__(self) -> int:
        return len(self._order)

    def configuration(self, reals: Sequence[float]) -> Array:
        """The configuration (size,) of a state's numbers, its angles between their bounds."""
        q = np.empty(len(self._order))
        q[self._order] = reals
        q[self._circles] = self._begin + (q[self._circles] - self._begin) % _TURN
        return q

    def reals(self, q: Array) -> list[float]:
        """The numbers of the state at a configuration (size,); OMPL has angles about 0."""
        q = np.array(q, dtype=np.float64)
        q[self._circles] -= _TURN * np.round(q[self._circles] / _TURN)
        found: list[float] = q[self._order].tolist()
        return found
