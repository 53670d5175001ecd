"""OMPL's state space of a configuration space, its states, and its objective.

OMPL's bindings look for an override in Python at every virtual call of an object that Python made.
Planners call the distance of a space and the cost of a motion millions of times, so that most of
their time went into looking. What OMPL makes of its own accord is called directly: real vectors,
rotations and headings are taken from spaces that have them. Only a product of spaces has to be made
here, and is slower.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from envs.spaces import Coordinates, Kind, Space
from planners.ompl import parameters

_TURN = 2 * math.pi


class StateSpace:
    """OMPL's space for a configuration space: real vectors for R^n, SE(2) and SE(3) for what these
    are, and a compound of real vectors, SO(2) and SO(3) for others.

    Distances are the same, but where some coordinates of one part wrap and others do not, or
    several do: then OMPL's is the sum over those that wrap and the rest, which is never less.

    Args:
        space: whose bounds are those of the states.

    Attributes:
        ompl: `ompl.base.StateSpace`.
    """

    def __init__(self, space: Space) -> None:
        factors = _factors(space)
        self._order = np.concatenate([factor.numbers for factor in factors])
        circles = [factor.numbers for factor in factors if factor.kind is Kind.CIRCLE]
        self._circles = np.concatenate([np.zeros(0, dtype=np.int64), *circles])
        self._begin = space.lower[self._circles]
        self._is_flat = [factor.kind for factor in factors] == [Kind.REALS]
        self.ompl = factors[0].made() if self._is_flat else _product(factors)

    def values(self, state: Any) -> Array:
        """A state's configuration (size,)."""
        if self._is_flat:
            return np.array([state[axis] for axis in range(len(self._order))])
        _, _, util = parameters.load()
        reals = util.vectorDouble()
        self.ompl.copyToReals(reals, state)
        q = np.empty(len(self._order))
        q[self._order] = list(reals)
        q[self._circles] = self._begin + (q[self._circles] - self._begin) % _TURN
        return q

    def state(self, q: Array) -> Any:
        """A state (`ompl.base.State`) at a configuration (size,)."""
        base, _, util = parameters.load()
        state = base.State(self.ompl)
        q = np.array(q, dtype=np.float64)
        q[self._circles] -= _TURN * np.round(q[self._circles] / _TURN)  # OMPL has them about 0
        reals = util.vectorDouble()
        reals.extend(q[self._order].tolist())
        self.ompl.copyFromReals(state(), reals)
        return state

    def information(self) -> Any:
        """A `SpaceInformation` of it, not yet set up."""
        _, geometric, _ = parameters.load()
        return geometric.SimpleSetup(self.ompl).getSpaceInformation()

    def path_length(self, si: Any) -> Any:
        """The objective of path length: what a planner chooses for a problem without one.

        OMPL knows how to draw states that may shorten a path in real vectors, SE(2) and SE(3), and
        refuses other spaces. As the only one among several objectives, the same draws them by
        rejection.

        Args:
            si: space information of this space, set up.
        """
        base, geometric, _ = parameters.load()
        definition = base.ProblemDefinition(si)
        anywhere = self.state(np.zeros(len(self._order)))
        definition.setStartAndGoalStates(anywhere, anywhere)
        planner = geometric.RRTstar(si)
        planner.setProblemDefinition(definition)
        planner.setup()
        objective = definition.getOptimizationObjective()
        if self._is_flat or isinstance(self.ompl, base.SE2StateSpace | base.SE3StateSpace):
            return objective
        alone = base.MultiOptimizationObjective(si)
        alone.addObjective(objective, 1.0)
        alone.lock()
        return alone


def unit_square() -> StateSpace:
    """A space to make planners in that are only asked for their parameters."""
    return StateSpace(Space([Coordinates([0, 0], [1, 1])]))


@dataclass(frozen=True, eq=False)
class _Factor:
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

    def made(self) -> Any:
        base, _, _ = parameters.load()
        if self.kind is Kind.CIRCLE:
            return base.SE2StateSpace().getSubspace(1)
        if self.kind is Kind.ROTATIONS:
            return base.SE3StateSpace().getSubspace(1)
        return _real_vectors(self.lower, self.upper)


_HALVES = {Kind.ROTATIONS: 2.0}
"""By how much OMPL's distance is less than ours: that of rotations is half the angle."""


def _factors(space: Space) -> list[_Factor]:
    found = []
    begin = 0
    for part in space.parts:
        for factor in part.factors():
            lower, upper = part.lower[factor.places], part.upper[factor.places]
            weight = part.weight * _HALVES.get(factor.kind, 1.0)
            found.append(_Factor(factor.kind, begin + factor.places, weight, lower, upper))
        begin += part.size
    return found


def _product(factors: Sequence[_Factor]) -> Any:
    """SE(2) or SE(3), where it is one and positions have a weight of at least 1, which their
    informed sampling takes for granted; else a compound."""
    base, _, _ = parameters.load()
    named = {
        ((Kind.REALS, 2), (Kind.CIRCLE, 1)): base.SE2StateSpace,
        ((Kind.REALS, 3), (Kind.ROTATIONS, 4)): base.SE3StateSpace,
    }
    kinds = tuple((factor.kind, len(factor.numbers)) for factor in factors)
    if kinds in named and factors[0].weight >= 1:
        space = named[kinds]()
        _bound(space, factors[0].lower, factors[0].upper)
        for number, factor in enumerate(factors):
            space.setSubspaceWeight(number, factor.weight)
    else:
        space = base.CompoundStateSpace()
        for factor in factors:
            space.addSubspace(factor.made(), factor.weight)
    space.setup()  # which finds the places of the values of states
    return space


def _real_vectors(lower: Array, upper: Array) -> Any:
    """The `RealVectorStateSpace` between two corners (d,).

    OMPL makes one for the positions of SE(2), which takes further dimensions. It has none for a
    single one: that is made here, and is slower.
    """
    base, _, _ = parameters.load()
    dimension = len(lower)
    if dimension == 1:
        space = base.RealVectorStateSpace(1)
    else:
        space = base.SE2StateSpace().getSubspace(0)
        for _ in range(dimension - 2):
            space.addDimension(0.0, 1.0)
    _bound(space, lower, upper)
    return space


def _bound(space: Any, lower: Array, upper: Array) -> None:
    base, _, _ = parameters.load()
    bounds = base.RealVectorBounds(len(lower))
    for axis in range(len(lower)):
        bounds.setLow(axis, float(lower[axis]))
        bounds.setHigh(axis, float(upper[axis]))
    space.setBounds(bounds)
