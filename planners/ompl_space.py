"""State space, space information and objective, made by OMPL itself.

OMPL's bindings look for an override in Python at every virtual call of an object that Python made.
Planners call the distance of a space and the cost of a motion millions of times, so that most of
their time went into looking. What OMPL makes of its own accord is called directly.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.problem import Array
from planners import ompl_import


def box_space(lower: Array, upper: Array) -> Any:
    """The `RealVectorStateSpace` between two corners (d,).

    OMPL makes one for the positions of SE(2), which takes further dimensions. It has none for a
    single one: that is made here, and is slower.
    """
    base, _, _ = ompl_import.load()
    dimension = len(lower)
    if dimension == 1:
        space = base.RealVectorStateSpace(1)
    else:
        space = base.SE2StateSpace().getSubspace(0)
        for _ in range(dimension - 2):
            space.addDimension(0.0, 1.0)
    bounds = base.RealVectorBounds(dimension)
    for axis in range(dimension):
        bounds.setLow(axis, float(lower[axis]))
        bounds.setHigh(axis, float(upper[axis]))
    space.setBounds(bounds)
    return space


def space_information(space: Any) -> Any:
    """A `SpaceInformation` of a space, not yet set up."""
    _, geometric, _ = ompl_import.load()
    return geometric.SimpleSetup(space).getSpaceInformation()


def path_length(si: Any) -> Any:
    """The objective of path length: what a planner chooses for a problem without one.

    Args:
        si: set up.
    """
    base, geometric, _ = ompl_import.load()
    definition = base.ProblemDefinition(si)
    space = si.getStateSpace()
    anywhere = state_of(np.zeros(space.getDimension()), space)
    definition.setStartAndGoalStates(anywhere, anywhere)
    planner = geometric.RRTstar(si)
    planner.setProblemDefinition(definition)
    planner.setup()
    return definition.getOptimizationObjective()


def values(state: Any, dimension: int) -> Array:
    """A state's values (d,)."""
    return np.array([state[axis] for axis in range(dimension)])


def state_of(q: Array, space: Any) -> Any:
    """A state with values (d,)."""
    base, _, _ = ompl_import.load()
    state = base.State(space)
    for axis, value in enumerate(q):
        state()[axis] = float(value)
    return state
