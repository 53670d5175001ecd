"""The fastest traversal of paths, where it is known."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest
import toppra
import toppra.algorithm
import toppra.constraint
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.judging.traversal import (
    RISE_S,
    ROUNDING,
    RoundedPath,
    _corners,
    _grid,
    traversal_time,
)

V = np.array([1.0, 2.0])
CORNER = np.array([[0.0, 0], [1, 0], [1, 1]])


@pytest.mark.parametrize("waypoints", [2, 3, 50])
def test_a_straight_line_takes_a_trapezoid_of_velocity(waypoints: int) -> None:
    """2 rad at 1 rad/s, RISE_S to get there and as long to stop: 2 / 1 + RISE_S."""
    path = np.linspace([0.0, 0], [2, 0], waypoints)
    assert traversal_time(path, V) == pytest.approx(2 + RISE_S, rel=1e-3)


def test_a_short_line_takes_a_triangle_of_velocity() -> None:
    """Without ever reaching the limit of velocity: 2 sqrt(length / acceleration)."""
    found = traversal_time(np.array([[0.0, 0], [0.2, 0]]), V)
    assert found == pytest.approx(2 * np.sqrt(0.2 / (1 / RISE_S)), rel=1e-3)


def test_the_slowest_joint_decides() -> None:
    """Both go 2 rad; the first may do 1 rad/s."""
    found = traversal_time(np.array([[0.0, 0], [2, 2]]), V)
    assert found == pytest.approx(2 + RISE_S, rel=1e-3)


def test_a_corner_is_slower_than_a_line_and_faster_than_a_stop() -> None:
    lines = [traversal_time(CORNER[i : i + 2], V) for i in (0, 1)]
    found = traversal_time(CORNER, V)
    assert found is not None
    assert max(filter(None, lines)) < found < sum(filter(None, lines))


def test_standing_still_takes_no_time() -> None:
    assert traversal_time(np.zeros((3, 2)), V) == 0


def test_twice_the_speed_and_acceleration_is_half_the_time() -> None:
    one, other = traversal_time(CORNER, V), traversal_time(CORNER, 2 * V)
    assert one is not None
    # Times scale so only if velocities and accelerations both do, by the factor and its square.
    assert one > (other or 0) > one / 2


def by_toppra(waypoints: np.ndarray, velocities: np.ndarray) -> float:
    """The same by the package of the method's authors, on the same grid."""
    rounded = RoundedPath(waypoints, ROUNDING)
    places = _grid(rounded.knots)

    class Geometric(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        """The path as the package wants it."""

        dof = len(velocities)
        path_interval = np.array([0.0, rounded.end])
        waypoints = None

        def __call__(self, s: Any, order: int = 0) -> np.ndarray:
            return rounded.evaluate(np.atleast_1d(np.asarray(s, dtype=float)), order)

    limits = np.column_stack([-velocities, velocities])
    constraints = [
        toppra.constraint.JointVelocityConstraint(limits),
        toppra.constraint.JointAccelerationConstraint(limits / RISE_S),
    ]
    logging.getLogger("toppra").setLevel(logging.ERROR)
    solver = toppra.algorithm.TOPPRA(
        constraints, Geometric(), gridpoints=places, solver_wrapper="seidel"
    )
    _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
    return float((2 * np.diff(places) / (speeds[:-1] + speeds[1:])).sum())


@pytest.mark.parametrize("seed", range(12))
def test_times_are_those_of_toppra(seed: int) -> None:
    """To its own rounding: it lets squared speeds be off by 1e-8, which counts beside a stop. Some
    paths turn back where they came from, and joints stand still."""
    rng = np.random.default_rng(seed)
    waypoints = rng.uniform(-2, 2, (rng.integers(2, 12), rng.integers(1, 8)))
    if seed % 3 == 0:
        waypoints = np.concatenate([waypoints, waypoints[-2::-1]])
    if seed % 4 == 0:
        waypoints[:, 0] = 0.5
    velocities = rng.uniform(0.5, 3, waypoints.shape[1])
    if waypoints.shape[1] == 1:
        waypoints = np.cumsum(np.abs(waypoints) + 0.1, axis=0)
    found = traversal_time(waypoints, velocities)
    assert found == pytest.approx(by_toppra(_corners(waypoints), velocities), rel=3e-4)


paths = st.lists(
    st.tuples(*[st.floats(-3, 3, allow_subnormal=False)] * 2), min_size=3, max_size=8
).map(np.array)


@settings(max_examples=50)
@given(paths)
def test_the_rounded_path_is_near_the_polyline_and_smooth(path: np.ndarray) -> None:
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    path = path[np.append(True, steps > 1e-3)]
    if len(path) < 3 or (np.linalg.norm(np.diff(path, axis=0), axis=1) <= 1e-3).any():
        return
    rounded = RoundedPath(path, ROUNDING)
    s = np.linspace(0, rounded.end, 4001)
    places = rounded.evaluate(s, 0)
    assert np.allclose(places[[0, -1]], path[[0, -1]], atol=1e-9)
    assert distances(places, path).max() <= ROUNDING * (1 + 1e-6)
    # The derivative is the difference quotient, and does not jump.
    quotient = np.diff(places, axis=0) / np.diff(s)[:, None]
    middles = rounded.evaluate((s[1:] + s[:-1]) / 2, 1)
    bend = np.abs(rounded.evaluate(s, 2)).max() * np.diff(s).max()
    assert np.abs(quotient - middles).max() <= bend + 1e-6


def distances(places: np.ndarray, path: np.ndarray) -> np.ndarray:
    """(n,) of places from the nearest point of a polyline."""
    a, b = path[:-1, None], path[1:, None]
    along = b - a
    t = (((places - a) * along).sum(-1) / (along**2).sum(-1)).clip(0, 1)
    found: np.ndarray = np.linalg.norm(a + t[..., None] * along - places, axis=-1).min(axis=0)
    return found
