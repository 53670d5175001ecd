"""What OMPL makes itself is what we would have made, and is never asked in Python; spaces that turn
and wrap are OMPL's own, with our distances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from envs.problem import Array
from envs.spaces import Coordinates, Rotations, Space
from planners.ompl import parameters
from planners.ompl.state_space import StateSpace

PI = np.pi
PLANE = Coordinates([-3, 1], [5, 2])
HEADING = Coordinates([-PI], [PI], wraps=[True], weight=0.5)
SE2 = Space([PLANE, HEADING])
SE3 = Space([Coordinates([-1] * 3, [1] * 3), Rotations(weight=2.0)])
ARM = Space([Coordinates([-2, 0, -PI, -1], [2, 2 * PI, PI, 1], [False, True, True, False])])
TWO = Space([Rotations(0.3), HEADING, Rotations(), PLANE])
LIGHT = Space([Coordinates([-1] * 3, [1] * 3, weight=0.2), Rotations(weight=2.0)])


def never(*asked: Any) -> float:
    raise AssertionError("an override in Python was looked for")


def box(lower: Array, upper: Array) -> StateSpace:
    return StateSpace(Space([Coordinates(lower, upper)]))


@pytest.mark.parametrize("dimension", [2, 3, 6, 14])
def test_no_virtual_call_looks_in_python(dimension: int) -> None:
    base, geometric, _ = parameters.load()
    space = box(np.zeros(dimension), np.ones(dimension))
    si = space.information()
    si.setup()
    objective = space.path_length(si)
    space.ompl.distance = space.ompl.interpolate = objective.motionCost = never
    ends = [space.state(np.full(dimension, x)) for x in (0.25, 0.5)]
    path = geometric.PathGeometric(si, *(state() for state in ends))
    path.interpolate(5)
    assert path.length() == pytest.approx(0.25 * dimension**0.5)
    assert path.cost(objective).value() == pytest.approx(0.25 * dimension**0.5)

    ours = base.RealVectorStateSpace(dimension)  # for comparison: an override is found in this one
    ours.setBounds(0, 1)
    ours.distance = never
    si = base.SpaceInformation(ours)
    si.setup()
    ends = [base.State(ours), base.State(ours)]
    with pytest.raises(AssertionError, match="an override"):
        geometric.PathGeometric(si, *(state() for state in ends)).length()


@pytest.mark.parametrize("dimension", [1, 2, 3, 7])
def test_a_space_has_its_bounds_and_no_others(dimension: int) -> None:
    base, _, _ = parameters.load()
    lower, upper = -np.arange(1.0, dimension + 1), np.arange(2.0, dimension + 2)
    space = box(lower, upper)
    space.ompl.setup()
    assert space.ompl.getDimension() == dimension
    assert space.ompl.getMaximumExtent() == pytest.approx(np.linalg.norm(upper - lower))
    assert [*space.ompl.getBounds().low] == [*lower]
    assert [*space.ompl.getBounds().high] == [*upper]
    state = base.State(space.ompl)
    drawn = []
    for _ in range(200):
        state.random()
        drawn.append(space.values(state()))
    q = np.array(drawn)
    assert ((lower <= q) & (q <= upper)).all()
    assert (q.std(axis=0) > 0.2 * (upper - lower)).all()
    assert (space.values(space.state(upper)()) == upper).all()


@pytest.mark.parametrize(
    ("space", "kind"),
    [
        (SE2, "SE2StateSpace"),
        (SE3, "SE3StateSpace"),
        (ARM, "CompoundStateSpace"),
        (TWO, "CompoundStateSpace"),
        (LIGHT, "CompoundStateSpace"),  # positions that count little: informed sampling would miss
    ],
)
def test_spaces_are_ompls_own_kinds(space: Space, kind: str) -> None:
    assert type(StateSpace(space).ompl).__name__ == kind


@pytest.mark.parametrize("space", [SE2, SE3, ARM, TWO, LIGHT])
def test_distances_ways_and_states_agree(space: Space) -> None:
    """But of coordinates that are measured together of which several wrap, or some: there OMPL's
    distance is a sum."""
    base, _, _ = parameters.load()
    made = StateSpace(space)
    rng = np.random.default_rng(1)
    for a, b in zip(space.sample(rng, 50), space.sample(rng, 50), strict=True):
        x, y, between = made.state(a), made.state(b), base.State(made.ompl)
        assert space.distance(made.values(x())[None], a[None]) == pytest.approx([0], abs=1e-9)
        [ours] = space.distance(a[None], b[None])
        theirs = made.ompl.distance(x(), y())
        if space is ARM:
            d = space.difference(a[None], b[None])[0]
            assert theirs == pytest.approx(np.hypot(d[0], d[3]) + abs(d[1]) + abs(d[2]))
            assert theirs >= ours - 1e-9
        else:
            assert theirs == pytest.approx(ours, abs=1e-9)
        made.ompl.interpolate(x(), y(), 0.3, between())
        way = space.interpolate(a[None], b[None], np.array([0.3]))
        assert space.distance(made.values(between())[None], way) == pytest.approx([0], abs=1e-6)
    drawn = np.array([_random(made) for _ in range(100)])
    assert space.contains(drawn).all()


def _random(space: StateSpace) -> Array:
    base, _, _ = parameters.load()
    state = base.State(space.ompl)
    state.random()
    return space.values(state())


def test_ends_beyond_a_half_turn_are_the_same_place() -> None:
    turns = Space([Coordinates([0], [2 * PI], [True])])
    made = StateSpace(turns)
    for angle in (0.0, 1.0, 3.5, 6.2):
        state = made.state(np.array([angle]))
        assert made.ompl.satisfiesBounds(state())
        assert made.values(state()) == pytest.approx([angle])


@pytest.mark.parametrize("space", [SE2, SE3, ARM, TWO])
@pytest.mark.parametrize("algorithm", ["InformedRRTstar", "BITstar", "AITstar", "EITstar"])
def test_planners_that_draw_where_paths_shorten_do_so_in_any_space(
    space: Space, algorithm: str
) -> None:
    """OMPL's direct sampling refuses compounds that are not SE(2) or SE(3)."""
    base, geometric, util = parameters.load()
    util.RNG.setSeed(1)
    made = StateSpace(space)
    si = made.information()
    checker = base.StateValidityCheckerFn(lambda state: True)
    si.setStateValidityChecker(checker)
    si.setup()
    definition = base.ProblemDefinition(si)
    rng = np.random.default_rng(3)
    a, b = space.sample(rng, 2)
    x, y = made.state(a), made.state(b)
    definition.setStartAndGoalStates(x, y)
    objective = made.path_length(si)
    straight = made.ompl.distance(x(), y())
    objective.setCostThreshold(base.Cost(2 * straight + 1))
    definition.setOptimizationObjective(objective)
    planner = getattr(geometric, algorithm)(si)
    planner.setProblemDefinition(definition)
    planner.setup()
    planner.solve(base.timedPlannerTerminationCondition(20.0))
    assert definition.hasExactSolution()
    length = definition.getSolutionPath().length()
    assert straight - 1e-6 <= length <= 2 * straight + 1
