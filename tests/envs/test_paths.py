"""Certified checks of many paths at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from envs import Environment
from envs.collision.continuous import paths_are_free
from envs.collision.distance_fields import signed_distance_to_boxes
from envs.collision.shapes import Box
from envs.problem import Array
from envs.spaces import Coordinates, Space

BOX = Box(np.zeros(3), np.full(3, 2.0))
R3 = Space([Coordinates([-10] * 3, [10] * 3)])


def clearance(q: Array) -> Array:
    return signed_distance_to_boxes(q, [BOX])


def free(*paths: list[list[float]], tolerance: float = 1e-3) -> list[bool]:
    arrays = [np.array(path) for path in paths]
    return list(paths_are_free(clearance, 1.0, arrays, tolerance, R3))


def test_hand_made_paths() -> None:
    beside = [[-3.0, 1.1, 0], [3, 1.1, 0]]
    through = [[-3.0, 0.9, 0], [3, 0.9, 0]]
    around = [[-3.0, 0, 0], [-3, 2, 0], [3, 2, 0], [3, 0, 0]]
    assert free(beside, through, around, through) == [True, False, True, False]


@pytest.mark.parametrize(("gap", "expected"), [(1.1e-3, True), (0.4e-3, False), (-1e-6, False)])
def test_grazing_at_the_tolerance(gap: float, expected: bool) -> None:
    assert free([[-3.0, 1 + gap, 0], [3, 1 + gap, 0]]) == [expected]


def test_a_corner_is_not_tunnelled_through() -> None:
    assert free([[0.999, 5.0, 0], [0.999, -5, 0]]) == [False]
    assert free([[0.9, 1.2, 0], [1.2, 0.9, 0]]) == [True]
    assert free([[0.9, 1.05, 0], [1.05, 0.9, 0]]) == [False]


def test_nothing_and_a_point() -> None:
    assert free() == []
    assert free([[2.0, 0, 0]], [[0.0, 0, 0]]) == [True, False]


def test_a_point_that_moves_faster_than_its_configuration_needs_more_room() -> None:
    path = np.array([[-0.1, 1.05, 0], [0.1, 1.05, 0]])
    calls: list[int] = []

    def counted(q: Array) -> Array:
        calls.append(len(q))
        return clearance(q)

    for rate in (0.4, 4.0):
        calls.clear()
        assert paths_are_free(counted, rate, [path], 1e-3, R3).all()
        assert (len(calls) > 1) == (rate > 1)


def test_it_agrees_with_fcl_on_random_paths(c3d: Environment) -> None:
    rng = np.random.default_rng(1)
    paths = [
        np.clip(rng.uniform(-9, 9, 3) + np.cumsum(rng.normal(0, 1, (6, 3)), axis=0), -10, 10)
        for _ in range(300)
    ]
    ours = c3d.paths_are_free(paths, 3e-3)
    strict, loose = c3d.collision_model(6e-3), c3d.collision_model(1e-3)
    for path, is_free in zip(paths, ours, strict=True):
        segments = list(pairwise(path))
        if is_free:
            assert all(loose.segment_is_free(a, b) for a, b in segments)
        else:
            assert not all(strict.segment_is_free(a, b) for a, b in segments)
    assert 30 < ours.sum() < 270
