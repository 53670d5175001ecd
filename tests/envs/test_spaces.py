"""Configuration spaces: a metric, its shortest ways, and OMPL's own spaces as known answers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.problem import Array
from envs.spaces import Coordinates, Rotations, Space
from planners.ompl import parameters

PI = np.pi
PLANE = Coordinates([-3, 1], [5, 2])
HEADING = Coordinates([-PI], [PI], wraps=[True], weight=0.5)

SPACES = {
    "plane": Space([PLANE]),
    "a joint": Space([Coordinates([-1], [2])]),
    "arm": Space([Coordinates([-2, 0, -PI, -1], [2, 2 * PI, PI, 1], [False, True, True, False])]),
    "SE(2)": Space([PLANE, HEADING]),
    "SO(3)": Space([Rotations()]),
    "SE(3)": Space([Coordinates([-1] * 3, [1] * 3), Rotations(weight=2.0)]),
    "two": Space([Rotations(0.3), HEADING, Rotations(), PLANE]),
}

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(params=SPACES)
def space(request: pytest.FixtureRequest) -> Space:
    return SPACES[request.param]


def drawn(space: Space, seed: int, places: int) -> Array:
    """Places (places, 8, size), also very near to each other and half a turn apart."""
    rng = np.random.default_rng(seed)
    q = space.sample(rng, places * 8).reshape(places, 8, space.size)
    q[1:, 0] = q[0, 0]
    moved = space.interpolate(q[0, 1], q[1, 1], np.array(1e-9))
    q[1:, 1] = moved
    return q


@pytest.mark.parametrize("name", SPACES)
@given(seed=seeds)
def test_a_distance_is_a_metric(name: str, seed: int) -> None:
    space = SPACES[name]
    a, b, c = drawn(space, seed, 3)
    ab = space.distance(a, b)
    assert ab.shape == (8,)
    assert (ab >= 0).all()
    assert space.distance(a, a) == pytest.approx(0, abs=1e-12)
    assert space.distance(b, a) == pytest.approx(ab, abs=1e-12)
    assert (ab <= space.distance(a, c) + space.distance(c, b) + 1e-12).all()


@pytest.mark.parametrize("name", SPACES)
@given(seed=seeds)
def test_the_way_between_is_the_shortest_at_a_steady_pace(name: str, seed: int) -> None:
    space = SPACES[name]
    a, b = drawn(space, seed, 2)
    whole = space.distance(a, b)
    t = np.random.default_rng(seed).uniform(size=8)
    there = space.interpolate(a, b, t)
    assert space.contains(there).all()
    assert space.distance(a, there) == pytest.approx(t * whole, abs=1e-9)
    assert space.distance(there, b) == pytest.approx((1 - t) * whole, abs=1e-9)
    assert (space.interpolate(a, b, np.zeros(8)) == a).all()
    assert (space.interpolate(a, b, np.ones(8)) == b).all()


@pytest.mark.parametrize("name", SPACES)
@given(seed=seeds)
def test_velocities_lead_from_one_end_to_the_other(name: str, seed: int) -> None:
    """And stay the same on the way: those of its second half are half of the whole."""
    space = SPACES[name]
    a, b = drawn(space, seed, 2)
    velocity = space.difference(a, b)
    assert velocity.shape == (8, space.dimension)
    middle = space.interpolate(a, b, np.full(8, 0.5))
    assert space.difference(middle, b) == pytest.approx(velocity / 2, abs=1e-9)


@given(seed=seeds)
def test_a_quaternion_and_its_opposite_are_one_place(seed: int) -> None:
    space = SPACES["SO(3)"]
    a, b = drawn(space, seed, 2)
    assert space.distance(a, -a) == pytest.approx(0, abs=1e-12)
    assert space.distance(a, -b) == pytest.approx(space.distance(a, b), abs=1e-12)
    t = np.full(8, 0.3)
    ways = space.interpolate(a, b, t), space.interpolate(a, -b, t)
    assert space.distance(*ways) == pytest.approx(0, abs=1e-7)


@given(x=st.floats(-PI, PI), y=st.floats(-PI, PI))
def test_angles_wrap(x: float, y: float) -> None:
    heading = Space([Coordinates([-PI], [PI], wraps=[True])])
    a, b = np.array([[x]]), np.array([[y]])
    [[way]] = heading.difference(a, b)
    assert abs(way) <= PI
    assert np.exp(1j * (x + way)) == pytest.approx(np.exp(1j * y), abs=1e-9)
    [distance] = heading.distance(a, b)
    assert distance == pytest.approx(min(abs(y - x), 2 * PI - abs(y - x)), abs=1e-9)


@pytest.mark.parametrize("name", SPACES)
@given(seed=seeds)
def test_numbers_beyond_the_bounds_of_circles_are_the_same_places(name: str, seed: int) -> None:
    space = SPACES[name]
    q, _ = drawn(space, seed, 2)
    turns = np.random.default_rng(seed).integers(-3, 4, q.shape)
    back = space.wrapped(q + 2 * PI * turns * space.wraps)
    assert space.distance(back, q) == pytest.approx(0, abs=1e-9)
    assert space.contains(back).all()
    assert (space.wrapped(q) is q) == space.is_flat


def test_from_one_side_of_pi_to_the_other() -> None:
    heading = Space([Coordinates([-PI], [PI], wraps=[True])])
    a, b = np.array([[2.8]]), np.array([[-2.8]])
    assert heading.difference(a, b) == pytest.approx(np.array([[2 * PI - 5.6]]))
    way = heading.interpolate(np.repeat(a, 5, 0), np.repeat(b, 5, 0), np.linspace(0, 1, 5))
    assert np.abs(way).min() == pytest.approx(2.8), "never by way of 0"
    assert heading.length(np.array([[2.8], [-2.8], [2.8]])) == pytest.approx(2 * (2 * PI - 5.6))


@given(seed=seeds)
def test_without_wrapping_it_is_the_space_of_the_numbers_to_the_last_bit(seed: int) -> None:
    space = SPACES["plane"]
    assert space.is_flat
    a, b = drawn(space, seed, 2)
    assert (space.difference(a, b) == b - a).all()
    assert (space.distance(a, b) == np.linalg.norm(b - a, axis=1)).all()
    t = np.random.default_rng(seed).uniform(size=8)
    assert (space.interpolate(a, b, t) == a + t[:, None] * (b - a)).all()
    assert space.length(a) == np.linalg.norm(np.diff(a, axis=0), axis=1).sum()


@pytest.mark.parametrize("name", ["arm", "SE(2)", "SO(3)", "SE(3)", "two"])
def test_others_are_not_flat(name: str) -> None:
    assert not SPACES[name].is_flat


def state(space: Any, q: Array) -> Any:
    base, _, _ = parameters.load()
    made = base.State(space)
    for i, value in enumerate(q):
        made[i] = float(value)
    return made


@pytest.mark.parametrize(("name", "ours"), [("SE2StateSpace", "SE(2)"), ("SE3StateSpace", "SE(3)")])
def test_distances_and_ways_are_ompls(name: str, ours: str) -> None:
    """With its own weights: 1 and 0.5 in the plane, 1 and 1 in space, of half the angle."""
    base, _, _ = parameters.load()
    theirs = getattr(base, name)()
    space = SPACES[ours]
    if ours == "SE(3)":
        space = Space([space.parts[0], Rotations(weight=0.5)])
    bounds = base.RealVectorBounds(space.parts[0].size)
    bounds.setLow(-10)
    bounds.setHigh(10)
    theirs.setBounds(bounds)
    rng = np.random.default_rng(0)
    for a, b in zip(space.sample(rng, 50), space.sample(rng, 50), strict=True):
        here, there, between = (state(theirs, q) for q in (a, b, a))
        wanted = theirs.distance(here(), there())
        assert space.distance(a[None], b[None]) == pytest.approx([wanted], abs=1e-7)
        theirs.interpolate(here(), there(), 0.3, between())
        found = np.array([[between[i] for i in range(space.size)]])
        way = space.interpolate(a[None], b[None], np.array([0.3]))
        assert space.distance(way, found) == pytest.approx([0], abs=1e-6)


def test_what_is_out_of_it() -> None:
    space = SPACES["SE(3)"]
    inside = np.array([0.0, 0, 1 + 1e-10, 0, 0, 0, -1])
    outside = np.array([[0.0, 0, 1.1, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0.1, 1], [0, 0, 0, 0, 0, 0, 0]])
    assert space.contains(inside[None]).all()
    assert not space.contains(outside).any()


def test_samples_are_uniform_rotations() -> None:
    """Their angles' density is (1 - cos) / pi, so that their mean is pi / 2 + 2 / pi."""
    q = Rotations().sample(np.random.default_rng(0), 100_000)
    angles = Rotations().distance(np.array([0, 0, 0, 1.0]), q)
    assert angles.mean() == pytest.approx(PI / 2 + 2 / PI, abs=0.01)


def test_a_definition_is_data_that_tells_spaces_apart(space: Space) -> None:
    texts = {json.dumps(one.definition()) for one in SPACES.values()}
    assert len(texts) == len(SPACES)
    assert json.dumps(space.definition()) in texts


@pytest.mark.parametrize(
    ("lower", "upper", "wraps", "said"),
    [
        ([1], [0], None, "above"),
        ([0], [np.inf], None, "finite"),
        ([np.nan], [1], None, "finite"),
        ([0, 0], [1], None, r"must be \(d,\)"),
        ([[0]], [[1]], None, r"must be \(d,\)"),
        ([], [], None, r"must be \(d,\)"),
        ([0], [1], [True, False], r"must be \(d,\)"),
        ([0], [3], [True], "2 pi"),
    ],
)
def test_bounds_that_make_no_box(lower: Any, upper: Any, wraps: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Coordinates(lower, upper, wraps)
