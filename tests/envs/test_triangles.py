"""Along which way triangles are apart; their distances are tested with those of meshes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.collision.shapes import ROW
from envs.collision.triangles import gap_along, nearest_of_triangles, triangle_to_triangle
from envs.problem import Array


def row_of(corners: Array) -> Array:
    """That of a triangle (3, 3)."""
    row, middle = np.zeros(ROW), corners.mean(axis=0)
    row[:9], row[9:12] = (corners - middle).ravel(), middle
    return row


@given(seed=st.integers(0, 2**32 - 1), flat=st.booleans())
@settings(max_examples=300, deadline=None)
def test_they_are_as_far_apart_along_the_way_as_they_are(seed: int, flat: bool) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(2, 3, 3)) * rng.choice([1e-3, 1.0])
    corners[1] += rng.normal(size=3) * rng.choice([0.1, 1.0, 10.0])
    if flat:
        corners[1, 2] = corners[1].mean(axis=0)
    one, other = map(row_of, corners)
    squared, *way = nearest_of_triangles(one, other)
    found = triangle_to_triangle(one, other)
    assert found == pytest.approx(np.sqrt(squared), abs=1e-7 * max(1.0, found) * 1.01)
    assert found == pytest.approx(triangle_to_triangle(other, one), abs=1e-12)
    if squared > 1e-12:
        assert gap_along(one, other, *way) == pytest.approx(np.sqrt(squared), rel=1e-6)
    for other_way in rng.normal(size=(20, 3)):
        assert gap_along(one, other, *other_way) <= np.sqrt(squared) + 1e-12


def test_along_no_way_nothing_is_told() -> None:
    one = row_of(np.eye(3))
    assert gap_along(one, one + 5.0, 0.0, 0.0, 0.0) == 0.0
