"""OMPL's state space of a configuration space, its states, and its objective.

OMPL's bindings look for an override in Python at every virtual call of an object that Python made.
Planners call the distance of a space and the cost of a motion millions of times, so that most of
their time went into looking. What OMPL makes of its own accord is called directly: real vectors,
rotations and headings are taken from spaces that have them. Only a product of spaces has to be made
here, and is slower.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from envs.problem import Array
from envs.spaces import Coordinates, Kind, Space
from planners.ompl import parameters
from planners.ompl_common.factors import Factor, Order, factors_of, is_flat, name_of


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
        factors = factors_of(space)
        self._order = Order(space, factors)
        self._is_flat = is_flat(factors)
        self.ompl = _made(factors[0]) if self._is_flat else _product(factors)

    def values(self, state: Any) -> Array:
        """A state's configuration (size,)."""
        if self._is_flat:
            return np.array([state[axis] for axis in range(len(self._order))])
        _, _, util = parameters.load()
        reals = util.vectorDouble()
        self.ompl.copyToReals(reals, state)
        return self._order.configuration(list(reals))

    def state(self, q: Array) -> Any:
        """A state (`ompl.base.State`) at a configuration (size,)."""
        base, _, util = parameters.load()
        state = base.State(self.ompl)
        reals = util.vectorDouble()
        reals.extend(self._order.reals(q))
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


def _made(factor: Factor) -> Any:
    base, _, _ = parameters.load()
    if factor.kind is Kind.CIRCLE:
        return base.SE2StateSpace().getSubspace(1)
    if factor.kind is Kind.ROTATIONS:
        return base.SE3StateSpace().getSubspace(1)
    return _real_vectors(factor.lower, factor.upper)


def _product(factors: Sequence[Factor]) -> Any:
    """SE(2) or SE(3), where it is one; else a compound."""
    base, _, _ = parameters.load()
    name = name_of(factors)
    if name:
        space = getattr(base, f"{name}StateSpace")()
        _bound(space, factors[0].lower, factors[0].upper)
        for number, factor in enumerate(factors):
            space.setSubspaceWeight(number, factor.weight)
    else:
        space = base.CompoundStateSpace()
        for factor in factors:
            space.addSubspace(_made(factor), factor.weight)
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
