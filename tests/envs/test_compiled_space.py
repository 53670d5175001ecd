"""Spaces in compiled code are those in Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from envs.compiled import njit_cached
from envs.compiled_space import distance, draw, go, space_arrays, uniform
from envs.spaces import Coordinates, Rotations, Space

CIRCLE = Coordinates([-1, -np.pi, 0], [1, np.pi, 2 * np.pi], wraps=[False, True, True], weight=0.7)
SPACES = {
    "R^4": Space([Coordinates([-1, 0, 5, 2], [1, 9, 6, 2])]),
    "circles": Space([CIRCLE]),
    "SE(2)": Space([Coordinates([0, 0], [4, 4]), Coordinates([-np.pi], [np.pi], [True], 0.5)]),
    "SE(3)": Space([Coordinates([0] * 3, [4] * 3), Rotations(2.0)]),
}


@njit_cached
def some(space: Any, state: Any, q: Any) -> None:
    for n in range(len(q)):
        draw(space, state, q[n])


@pytest.mark.parametrize("name", SPACES)
def test_distances_and_ways_are_the_spaces(name: str) -> None:
    space = SPACES[name]
    arrays, rng = space_arrays(space), np.random.default_rng(2)
    a, b = space.sample(rng, 200), space.sample(rng, 200)
    a[:3, -4:] *= -1 if name == "SE(3)" else 1  # the same rotations
    there = np.empty(space.size)
    for p, q, t in zip(a, b, rng.uniform(0, 1, 200), strict=True):
        [wanted] = space.distance(p[None], q[None])
        assert distance(arrays, p, q) == pytest.approx(wanted, abs=1e-9)
        go(arrays, p, q, t, there)
        assert space.distance(there[None], space.between(p, q, t)[None]) == pytest.approx(
            0, abs=1e-7
        )
        assert space.contains(there)


@pytest.mark.parametrize("name", SPACES)
def test_draws_are_uniform_in_the_space(name: str) -> None:
    space = SPACES[name]
    q = np.empty((20_000, space.size))
    some(space_arrays(space), np.array([3], dtype=np.uint64), q)
    assert space.contains(q).all()
    wanted = space.sample(np.random.default_rng(0), len(q))
    for of in (lambda x: x.mean(axis=0), lambda x: x.std(axis=0)):
        assert of(q) == pytest.approx(of(wanted), abs=0.05 * (space.upper - space.lower).max())
    others = np.empty_like(q[:5])
    some(space_arrays(space), np.array([3], dtype=np.uint64), others)
    assert (others == q[:5]).all(), "by the seed"


def test_random_numbers_are_those_of_splitmix64() -> None:
    """Of seed 1234567, as its authors' program prints them."""
    state = np.array([1234567], dtype=np.uint64)
    wanted = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    assert [uniform(state) for _ in wanted] == [(n >> 11) / 2**53 for n in wanted]
