"""Distances to the cells of occupancy grids, and the boxes that cover them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from envs.collision.occupancy import CellDistances, covering_boxes
from envs.problem import Array

SHAPES = [(17, 9), (64, 64), (1, 5), (8, 7, 11), (3, 1, 2), (2, 2, 2)]


def grid(shape: tuple[int, ...], share: float, seed: int) -> NDArray[np.bool_]:
    """Random cells, of which some are occupied and some are not."""
    cells = np.random.default_rng(seed).random(shape) < share
    cells.reshape(-1)[:2] = [True, False]
    return cells


def by_every_cell(points: Array, cells: NDArray[np.bool_]) -> Array:
    """Distances (n,) from points (n, d) to the nearest marked cell: by looking at each."""
    lower = np.argwhere(cells)
    gaps = np.maximum(lower - points[:, None], points[:, None] - lower - 1).clip(min=0)
    found: Array = np.linalg.norm(gaps, axis=2).min(axis=1)
    return found


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.02, 0.4, 0.95])
def test_distances_are_those_to_the_nearest_cell(shape: tuple[int, ...], share: float) -> None:
    occupied = grid(shape, share, 1)
    points = np.random.default_rng(2).uniform(-4, np.array(shape) + 4, (500, len(shape)))
    outside, within = by_every_cell(points, occupied), by_every_cell(points, ~occupied)
    expected = np.where(outside > 0, outside, -within)
    assert CellDistances(occupied)(points) == pytest.approx(expected, abs=1e-12)


def test_where_cells_meet_there_is_no_room() -> None:
    """Neither along a side of two, nor where two meet at a corner."""
    diagonal = np.eye(4, dtype=np.bool_)
    at = CellDistances(diagonal)
    assert at(np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])).tolist() == [0, 0, 0]
    beside = at(np.array([[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0 - 1e-9]]))
    assert (beside <= 1e-9).all()


def test_a_plane_has_no_height() -> None:
    cells = np.zeros((40, 3), dtype=np.bool_)
    cells[0, 0] = True
    assert CellDistances(cells)(np.array([[31.0, 0.5]]))[0] == 30


def test_a_point_that_is_no_number_has_no_distance() -> None:
    found = CellDistances(grid((5, 5), 0.5, 0))(np.array([[np.nan, 1], [1, np.nan], [9, 9]]))
    assert np.isnan(found).tolist() == [True, True, False]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.05, 0.5, 0.9])
def test_boxes_cover_the_cells_and_no_others(shape: tuple[int, ...], share: float) -> None:
    cells = grid(shape, share, 3)
    covered = np.zeros_like(cells)
    for begin, end in covering_boxes(cells):
        assert (begin < end).all()
        covered[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))] = True
    assert (covered == cells).all()


def test_boxes_are_few() -> None:
    frame = np.ones((300, 200), dtype=np.bool_)
    frame[1:-1, 1:-1] = False
    assert len(covering_boxes(frame)) == 4
    house = np.ones((30, 40, 50), dtype=np.bool_)
    house[1:-1, 1:-1, 1:-1] = False
    assert len(covering_boxes(house)) <= 6
