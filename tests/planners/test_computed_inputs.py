"""Features of clearances."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planners.fields.computed_inputs import (
    PER_CLEARANCE,
    write_clearance_features,
    write_feature_slopes,
)


@numba.njit
def features(clearance: float, slope: Any, scale: float, rows: Any, first: int) -> None:
    root, bounded = write_clearance_features(clearance, rows, first)
    write_feature_slopes(clearance, root, bounded, slope, scale, rows, first)


def rows_of(clearance: float, slope: list[float], scale: float = 1.0) -> np.ndarray:
    rows = np.full((1 + len(slope), 1 + PER_CLEARANCE), np.nan)
    features(clearance, np.array(slope), scale, rows, 1)
    assert np.isnan(rows[:, 0]).all(), "what is before them is left alone"
    return rows[:, 1:]


def test_at_contact_and_in_the_open() -> None:
    at_contact, _ = rows_of(0.0, [0.0])
    assert at_contact == pytest.approx([-math.log(0.05) / 2, 0.0, 1.0])
    in_the_open, slopes = rows_of(1.5, [1.0])
    slowness = -math.log(0.5 * (1.5 + math.sqrt(2.26))) / 2
    assert in_the_open == pytest.approx([slowness, math.tanh(3.0), 0.0])
    assert slopes[2] == 0.0, "beyond d_max nothing is near"


@settings(deadline=None)  # compiled on the first call
@given(st.floats(-0.5, 0.95), st.lists(st.floats(-2, 2), min_size=1, max_size=6), st.floats(0.1, 9))
def test_slopes_are_those_of_finite_differences(
    clearance: float, slope: list[float], scale: float
) -> None:
    rows = rows_of(clearance, slope, scale)
    h = 1e-5
    above, below = rows_of(clearance + h, [0.0])[0], rows_of(clearance - h, [0.0])[0]
    by_clearance = (above - below) / (2 * h)
    expected = scale * np.outer(slope, by_clearance)
    assert rows[1:] == pytest.approx(expected, rel=1e-5, abs=1e-6)
