"""OMPL 2's state space of a configuration space, its states, and its objective.

In OMPL 2 a space that Python makes is called directly, and so is the objective of path length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from envs.problem import Array
from envs.spaces import Kind, Space
from planners.ompl_common.factors import Factor, Order, factors_of, is_flat, name_of


class StateSpace:
    """Real vectors for R^n, SE(2) and SE(3) for what these are, and a compound of real vectors,
    SO(2) and SO(3) for others; distances as behind OMPL 1.7.

    Args:
        space: whose bounds are those of the states.

    Attributes:
        ompl: `ompl.base.StateSpace`.
    """

    def __init__(self, space: Space) -> None:
        factors = factors_of(space)
        self._order = Order(space, factors)
        self._size = len(self._order)
        self._is_flat, self._name = is_flat(factors), name_of(factors)
        self._readers = [(number, _reader(factor)) for number, factor in enumerate(factors)]
        self.ompl = _made(factors[0]) if self._is_flat else _product(factors, self._name)

    def values(self, state: Any) -> Array:
        """A state's configuration (size,)."""
        if self._is_flat:
            return np.array(state[0 : self._size])
        return self._order.configuration(self._reals(state))

    def _reals(self, state: Any) -> list[float]:
        if self._name == "SE2":
            return [state.getX(), state.getY(), state.getYaw()]
        if self._name == "SE3":
            return [state.getX(), state.getY(), state.getZ(), *_quaternion(state.rotation())]
        return [real for number, read in self._readers for real in read(state[number])]

    def fill(self, state: Any, q: Array) -> None:
        """Makes a state that OMPL has allocated the one at a configuration (size,)."""
        self.ompl.copyFromReals(state, self._order.reals(q))

    def path_length(self, si: Any) -> Any:
        """The objective of path length.

        OMPL knows how to draw states that may shorten a path in real vectors, SE(2) and SE(3), and
        refuses other spaces. As the only one among several objectives, the same draws them by
        rejection.

        Args:
            si: space information of this space, set up.
        """
        from ompl import base

        objective = base.PathLengthOptimizationObjective(si)
        if self._is_flat or self._name:
            return objective
        alone = base.MultiOptimizationObjective(si)
        alone.addObjective(objective, 1.0)
        alone.lock()
        return alone


def _quaternion(state: Any) -> list[float]:
    return [state.x, state.y, state.z, state.w]


def _reader(factor: Factor) -> Callable[[Any], list[float]]:
    """What gives the numbers of a state of a factor's space."""
    if factor.kind is Kind.CIRCLE:
        return lambda state: [state.value]
    if factor.kind is Kind.ROTATIONS:
        return _quaternion
    size = len(factor.numbers)

    def reals(state: Any) -> list[float]:
        found: list[float] = state[0:size]
        return found

    return reals


def _made(factor: Factor) -> Any:
    from ompl import base

    if factor.kind is Kind.CIRCLE:
        return base.SO2StateSpace()
    if factor.kind is Kind.ROTATIONS:
        return base.SO3StateSpace()
    space = base.RealVectorStateSpace(len(factor.numbers))
    space.setBounds(_bounds(factor))
    return space


def _product(factors: Sequence[Factor], name: str | None) -> Any:
    """SE(2) or SE(3), where it is one; else a compound."""
    from ompl import base

    if name:
        space = getattr(base, f"{name}StateSpace")()
        space.setBounds(_bounds(factors[0]))
        for number, factor in enumerate(factors):
            space.setSubspaceWeight(number, factor.weight)
    else:
        space = base.CompoundStateSpace()
        for factor in factors:
            space.addSubspace(_made(factor), factor.weight)
    space.setup()  # which finds the places of the values of states
    return space


def _bounds(factor: Factor) -> Any:
    from ompl import base

    bounds = base.RealVectorBounds(len(factor.numbers))
    bounds.low, bounds.high = factor.lower.tolist(), factor.upper.tolist()
    return bounds
