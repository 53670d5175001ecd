"""Values on the nodes of regular grids."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.grid import (
    RegularGrid,
    cells_of,
    central_differences,
    distance_beyond,
    node_axes,
    node_counts,
    node_positions,
    trilinear,
)

LOWER, UPPER = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 3.0, 2.5])

PLACES = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4))


def height(q: np.ndarray) -> np.ndarray:
    found: np.ndarray = q @ [1.0, -2.0, 3.0]
    return found


LINEAR = RegularGrid.sampled(height, LOWER, UPPER, 0.3)


@numba.njit
def compiled_value(grid: Any, x: float, y: float, z: float) -> Any:
    return trilinear(grid, x, y, z)


@numba.njit
def compiled_beyond(grid: Any, x: float, y: float, z: float) -> Any:
    return distance_beyond(grid, x, y, z)


@numba.njit
def compiled_slope(grid: Any, x: float, y: float, z: float, slope: Any) -> None:
    central_differences(compiled_value, grid, grid.per_unit, x, y, z, slope)


@settings(deadline=None)  # compiled on the first call
@given(st.lists(st.floats(-4, 4), min_size=3, max_size=3), st.floats(0.1, 0.6))
def test_the_error_keeps_to_its_bound(middle: list[float], spacing: float) -> None:
    def distance(q: np.ndarray) -> np.ndarray:
        away: np.ndarray = np.linalg.norm(q - middle, axis=1)
        return away

    grid = RegularGrid.sampled(distance, LOWER, UPPER, spacing)
    q = np.random.default_rng(0).uniform(LOWER, UPPER, (200, 3))
    assert np.abs(grid.interpolate(q) - distance(q)).max() <= np.sqrt(3) / 2 * spacing + 1e-6


@settings(deadline=None)  # compiled on the first call
@given(PLACES)
def test_linear_functions_are_exact_and_go_on_beyond_the_border(
    place: tuple[float, float, float],
) -> None:
    within = np.clip(place, LOWER, UPPER)
    [expected] = height(within[None])
    assert LINEAR.interpolate(np.array([place])) == pytest.approx([expected], abs=1e-5)
    assert compiled_value(LINEAR, *place) == pytest.approx(expected, abs=1e-5)
    beyond = np.linalg.norm(np.array(place) - within)
    assert compiled_beyond(LINEAR, *place) == pytest.approx(beyond, abs=1e-12)


@settings(deadline=None)  # compiled on the first call
@given(st.integers(2, 6), st.integers(2, 6), st.integers(2, 6), st.integers(0, 2**32 - 1))
def test_python_and_compiled_code_find_the_same(a: int, b: int, c: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(a, b, c)).astype(np.float32)
    grid = RegularGrid.between(values, LOWER, UPPER)
    q = rng.uniform(LOWER - 0.5, UPPER + 0.5, (20, 3))
    found = [compiled_value(grid, *place) for place in q]
    assert found == pytest.approx(grid.interpolate(q), abs=1e-6)
    nodes = node_positions(node_axes(LOWER, UPPER, values.shape)).reshape(-1, 3)
    assert grid.interpolate(nodes) == pytest.approx(values.ravel(), abs=1e-6)
    assert (grid.at_nearest(nodes) == values.ravel()).all()


def test_slopes_of_compiled_code_are_central_differences() -> None:
    slope = np.empty(3)
    compiled_slope(LINEAR, 0.1, 1.0, 2.25, slope)
    assert slope == pytest.approx([1.0, -2.0, 3.0], abs=1e-4)
    compiled_slope(LINEAR, 2.0, 1.0, 2.25, slope)
    assert slope == pytest.approx([0.0, -2.0, 3.0], abs=1e-4)


def test_gradients_of_a_linear_field_are_exact_up_to_the_edge() -> None:
    lower, upper = np.array([0.0, 0.0, -1.0]), np.array([3.0, 1.0, 1.0])
    nodes = node_positions(node_axes(lower, upper, [7, 5, 6]))
    grid = RegularGrid.between(nodes @ [2.0, -3.0, 1.0], lower, upper)
    for q in np.array([[0, 0, -1], [3, 1, 1], [1.3, 0.2, 0.1], [3, 0, 0.9]], float):
        assert grid.gradient(q) == pytest.approx([2, -3, 1])


def test_gradients_in_the_plane_are_those_of_a_saddle() -> None:
    nodes = node_positions(node_axes(np.zeros(2), np.ones(2), [11, 11]))
    grid = RegularGrid.between(nodes[..., 0] * nodes[..., 1], np.zeros(2), np.ones(2))
    assert grid.gradient(np.array([0.33, 0.71])) == pytest.approx([0.71, 0.33])


def test_the_nearest_node_is_the_nearest() -> None:
    values = np.arange(12).reshape(3, 4)
    grid = RegularGrid.between(values, np.array([0.0, -3.0]), np.array([2.0, 3.0]))
    q = np.array([[0.4, -2.1], [1.6, 2.9], [-50.0, 50.0]])
    assert grid.at_nearest(q).tolist() == [0, 11, 3]
    assert grid.nearest(q).tolist() == [[0, 0], [2, 3], [-50, 26]]
    assert grid.upper.tolist() == [2.0, 3.0]


@settings(deadline=None)  # compiled on the first call
@given(st.floats(0.01, 5))
def test_nodes_are_no_farther_apart_than_asked(spacing: float) -> None:
    counts = node_counts(LOWER, UPPER, spacing)
    axes = node_axes(LOWER, UPPER, counts)
    assert [len(axis) for axis in axes] == counts.tolist()
    assert all(np.diff(axis).max() <= spacing * (1 + 1e-9) for axis in axes)
    assert [axis[0] for axis in axes] == LOWER.tolist()
    assert [axis[-1] for axis in axes] == UPPER.tolist()


def test_points_are_in_the_cell_that_begins_below_them() -> None:
    points = np.array([[0.0, 0.0], [0.99, -0.01], [2.5, 1.0]])
    assert cells_of(points, np.zeros(2), 0.5).tolist() == [[0, 0], [1, -1], [5, 2]]
