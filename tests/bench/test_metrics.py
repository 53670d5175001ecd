"""Metrics of paths with known answers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bench.judging import path_numbers
from bench.judging.path_numbers import MOST_PIECES, greatest_turn, pieces
from envs.spaces import Coordinates, Rotations, Space
from planners.ompl import parameters

Speed = Callable[[np.ndarray], np.ndarray]


def flat(waypoints: np.ndarray) -> Space:
    """R^d, of waypoints (k, d)."""
    corner = np.full(waypoints.shape[1], 10.0)
    return Space([Coordinates(-corner, corner)])


def path_length(waypoints: np.ndarray) -> float:
    return flat(waypoints).length(waypoints)


def smoothness(waypoints: np.ndarray) -> float:
    return path_numbers.smoothness(flat(waypoints), waypoints)


def travel_time(waypoints: np.ndarray, speed: Speed, spacing: float) -> float:
    """As the metric sums it up: over the path's pieces."""
    places, lengths = pieces(flat(waypoints), waypoints, spacing)
    return float((lengths / speed(places)).sum())


SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], float)

paths = arrays(float, st.tuples(st.integers(2, 12), st.just(3)), elements=st.floats(-10, 10))


def test_length_of_a_square() -> None:
    assert path_length(SQUARE) == 4


def test_travel_time_at_constant_speed() -> None:
    found = travel_time(SQUARE, lambda q: np.full(len(q), 0.5), 0.01)
    assert found == pytest.approx(8)


def test_travel_time_up_a_ramp_of_speed() -> None:
    """S = 1 + x from 0 to 3: the integral of dx / (1 + x) is ln 4."""
    found = travel_time(np.array([[0.0], [3.0]]), lambda q: 1 + q[:, 0], 1e-3)
    assert found == pytest.approx(math.log(4), rel=1e-6)


def test_travel_time_of_more_pieces_than_are_summed() -> None:
    """The same integral, back and forth, by waypoints that lie closer than the spacing."""
    there = np.linspace(0, 3, 2 * MOST_PIECES)[:, None]
    found = travel_time(np.vstack([there, there[::-1]]), lambda q: 1 + q[:, 0], 1e-3)
    assert found == pytest.approx(2 * math.log(4), rel=1e-6)


def test_a_path_of_no_length_and_more_waypoints_than_pieces() -> None:
    path = np.ones((MOST_PIECES + 2, 3))
    middles, lengths = pieces(flat(path), path, 0.01)
    assert (middles == 1).all()
    assert (lengths == 0).all()


def test_smoothness_of_right_angles() -> None:
    """(2 (pi / 2) / (1 + 1))^2 at each of three corners."""
    assert smoothness(SQUARE) == pytest.approx(3 * (math.pi / 2) ** 2)
    assert smoothness(SQUARE[:2]) == 0
    assert smoothness(np.array([[0.0, 0], [1, 0], [5, 0]])) == pytest.approx(0, abs=1e-12)
    assert smoothness(SQUARE[[0, 0, 1, 1, 2]]) == pytest.approx(smoothness(SQUARE[[0, 1, 2]]))


def test_smoothness_is_ompls() -> None:
    base, geometric, _ = parameters.load()
    waypoints = np.random.default_rng(0).uniform(-1, 1, (12, 3))
    space = base.RealVectorStateSpace(3)
    path = geometric.PathGeometric(base.SpaceInformation(space))
    for q in waypoints:
        state = base.State(space)
        for axis in range(3):
            state()[axis] = float(q[axis])
        path.append(state())
    assert smoothness(waypoints) == pytest.approx(path.smoothness())
    assert path_length(waypoints) == pytest.approx(path.length())


@given(paths)
def test_metrics_do_not_depend_on_direction(path: np.ndarray) -> None:
    back = path[::-1]
    assert path_length(back) == pytest.approx(path_length(path))
    assert smoothness(back) == pytest.approx(smoothness(path), rel=1e-6, abs=1e-6)

    def speed(q: np.ndarray) -> np.ndarray:
        return 1 + np.abs(q).sum(axis=1)

    assert travel_time(back, speed, 0.1) == pytest.approx(travel_time(path, speed, 0.1))


@given(paths)
def test_travel_time_lies_between_the_extremes_of_speed(path: np.ndarray) -> None:
    length = path_length(path)
    found = travel_time(path, lambda q: np.clip(q[:, 0], 0.1, 1), 0.1)
    assert length * (1 - 1e-9) <= found <= 10 * length * (1 + 1e-9)


def test_a_path_across_pi_is_short_and_straight() -> None:
    heading = Space([Coordinates([-math.pi], [math.pi], wraps=[True])])
    path = np.array([[2.8], [3.1], [-3.1], [-2.8]])
    assert greatest_turn(heading, path) == pytest.approx(0)
    middles, lengths = pieces(heading, path, 0.01)
    assert lengths.sum() == pytest.approx(2 * math.pi - 5.6)
    assert np.abs(middles).min() >= 2.8, "never by way of 0"
    assert heading.contains(middles).all()


@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.sampled_from([0.5, 0.01, 1e-4]))
def test_pieces_are_on_the_way_in_turning_spaces(seed: int, count: int, spacing: float) -> None:
    """And what is left of a path of many pieces, too: each begins where the last one ends."""
    space = Space([Coordinates([-1] * 2, [1] * 2), Rotations(weight=0.3)])
    path = space.sample(np.random.default_rng(seed), count)[[0, *range(count), count - 1]]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(path_numbers, "MOST_PIECES", 3000)  # which takes less time
        middles, lengths = pieces(space, path, spacing)
    assert len(middles) <= 3000
    assert lengths.sum() == pytest.approx(space.length(path))
    apart = (lengths[:-1] + lengths[1:]) / 2
    assert (space.distance(middles[:-1], middles[1:]) <= apart + 1e-9).all()


def test_turns_of_a_body_that_goes_on_turning() -> None:
    """About one axis all the way is straight; on about another is a right angle."""
    space = Space([Rotations()])
    half = math.sqrt(0.5)
    about_z = [[0, 0, math.sin(x / 2), math.cos(x / 2)] for x in (0, 0.4, 1.5, math.pi / 2)]
    assert greatest_turn(space, np.array(about_z)) == pytest.approx(0, abs=1e-5)
    then_x = np.array([0.5, 0.5, 0.5, 0.5])  # by a right angle about its own x
    path = np.array([about_z[0], [0, 0, half, half], then_x])
    assert greatest_turn(space, path) == pytest.approx(90)
