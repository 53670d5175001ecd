"""Clearances that are looked up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.collision.distance_fields import ClearanceGrid

LOWER, UPPER = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 3.0, 2.5])


@given(st.lists(st.floats(-4, 4), min_size=3, max_size=3), st.floats(0.1, 0.6))
def test_the_error_keeps_to_its_bound(middle: list[float], spacing: float) -> None:
    def distance(q: np.ndarray) -> np.ndarray:
        away: np.ndarray = np.linalg.norm(q - middle, axis=1)
        return away

    grid = ClearanceGrid.sampled(distance, LOWER, UPPER, spacing)
    q = np.random.default_rng(0).uniform(LOWER, UPPER, (200, 3))
    assert np.abs(grid(q) - distance(q)).max() <= np.sqrt(3) / 2 * spacing + 1e-6


def test_linear_functions_are_exact_and_go_on_beyond_the_border() -> None:
    def height(q: np.ndarray) -> np.ndarray:
        return q @ [1.0, -2.0, 3.0]

    grid = ClearanceGrid.sampled(height, LOWER, UPPER, 0.3)
    q = np.random.default_rng(0).uniform(LOWER, UPPER, (200, 3))
    assert grid(q) == pytest.approx(height(q), abs=1e-5)
    beyond = np.array([[2.0, 1.0, 2.2]])
    assert grid(beyond) == pytest.approx(height(np.array([[1.0, 1.0, 2.2]])), abs=1e-5)
