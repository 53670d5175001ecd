"""What OMPL makes itself is what we would have made, and is never asked in Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planners.ompl import parameters
from planners.ompl.validity import box_space, path_length, space_information, state_of, values


def never(*asked: Any) -> float:
    raise AssertionError("an override in Python was looked for")


@pytest.mark.parametrize("dimension", [2, 3, 6, 14])
def test_no_virtual_call_looks_in_python(dimension: int) -> None:
    base, geometric, _ = parameters.load()
    space = box_space(np.zeros(dimension), np.ones(dimension))
    si = space_information(space)
    si.setup()
    objective = path_length(si)
    space.distance = space.interpolate = objective.motionCost = never
    ends = [state_of(np.full(dimension, x), space) for x in (0.25, 0.5)]
    path = geometric.PathGeometric(si, *(state() for state in ends))
    path.interpolate(5)
    assert path.length() == pytest.approx(0.25 * dimension**0.5)
    assert path.cost(objective).value() == pytest.approx(0.25 * dimension**0.5)

    ours = base.RealVectorStateSpace(dimension)  # for comparison: an override is found in this one
    ours.setBounds(0, 1)
    ours.distance = never
    si = base.SpaceInformation(ours)
    si.setup()
    ends = [state_of(np.full(dimension, x), ours) for x in (0.25, 0.5)]
    with pytest.raises(AssertionError, match="an override"):
        geometric.PathGeometric(si, *(state() for state in ends)).length()


@pytest.mark.parametrize("dimension", [1, 2, 3, 7])
def test_a_space_has_its_bounds_and_no_others(dimension: int) -> None:
    base, _, _ = parameters.load()
    lower, upper = -np.arange(1.0, dimension + 1), np.arange(2.0, dimension + 2)
    space = box_space(lower, upper)
    space.setup()
    assert space.getDimension() == dimension
    assert space.getMaximumExtent() == pytest.approx(np.linalg.norm(upper - lower))
    assert [*space.getBounds().low] == [*lower]
    assert [*space.getBounds().high] == [*upper]
    state = base.State(space)
    drawn = []
    for _ in range(200):
        state.random()
        drawn.append(values(state(), dimension))
    q = np.array(drawn)
    assert ((lower <= q) & (q <= upper)).all()
    assert (q.std(axis=0) > 0.2 * (upper - lower)).all()
    assert (values(state_of(upper, space)(), dimension) == upper).all()
