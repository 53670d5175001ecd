"""What networks are told of coordinates that wrap, and the space in which they compute."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from turning_cubes import LIMIT, OnePart, Plane

import envs
from envs import Environment
from envs.spaces import Coordinates, Space
from planners.learning.circles import NO_CIRCLES, Circles
from planners.learning.normalizer import Normalizer, obstacle_point_cloud, unsupported_space

CIRCLES = Circles((0, 2), 0.8)
"""Of three coordinates the first and the last."""


def points(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.4, 0.4, (n, 3))


def test_a_turn_further_the_numbers_are_the_same() -> None:
    x = points(50)
    numbers = CIRCLES.embedded(x)
    assert numbers.shape == (50, CIRCLES.embedded_size(3)) == (50, 5)
    for axis, same in enumerate((True, False, True)):
        turned = x + 0.8 * np.eye(3)[axis]
        assert (np.abs(CIRCLES.embedded(turned) - numbers).max() < 1e-12) == same
    ends = np.array([[-0.4, 0.1, 0.0], [0.4, 0.1, 0.0]])
    assert np.ptp(CIRCLES.embedded(ends), axis=0) == pytest.approx(np.zeros(5), abs=1e-12)


def test_near_each_other_they_are_as_far_apart_as_the_coordinates() -> None:
    x, y = points(50), points(50, 1)
    near = x + 1e-3 * (y - x)
    apart = np.linalg.norm(CIRCLES.embedded(near) - CIRCLES.embedded(x), axis=1)
    assert apart == pytest.approx(np.linalg.norm(near - x, axis=1), rel=1e-4)


def test_slopes_are_those_of_finite_differences() -> None:
    x, h = points(50), 1e-6
    numbers, slopes = (part.numpy() for part in CIRCLES.embedded_with_slopes(torch.from_numpy(x)))
    assert numbers == pytest.approx(CIRCLES.embedded(x), abs=1e-15)
    told = CIRCLES.told(3)
    assert told == [0, 1, 2, 0, 2]
    for axis in range(3):
        step = h * np.eye(3)[axis]
        rise = (CIRCLES.embedded(x + step) - CIRCLES.embedded(x - step)) / (2 * h)
        assert rise == pytest.approx(np.where(np.equal(told, axis), slopes, 0.0), abs=1e-8)


def test_differences_go_the_short_way() -> None:
    step = torch.tensor([[0.7, 0.7, -0.5], [-0.3, -2.0, 1.65]], dtype=torch.float64)
    wanted = torch.tensor([[-0.1, 0.7, 0.3], [-0.3, -2.0, 0.05]], dtype=torch.float64)
    assert torch.allclose(CIRCLES.shortest(step), wanted, atol=1e-12)
    assert (step[0] == torch.tensor([0.7, 0.7, -0.5], dtype=torch.float64)).all(), "not changed"


def test_where_nothing_wraps_all_is_as_it_was() -> None:
    x = points(5)
    assert NO_CIRCLES.embedded(x) is x
    step = torch.from_numpy(x)
    assert NO_CIRCLES.shortest(step) is step
    numbers, slopes = NO_CIRCLES.embedded_with_slopes(step)
    assert torch.equal(numbers, step)
    assert (slopes == 1).all()


def test_the_networks_space_of_one_that_wraps() -> None:
    env = OnePart()
    scale = Normalizer.of(env)
    assert scale.extent == 2 * LIMIT
    assert scale.circles == Circles((2,), 2 * math.pi / (2 * LIMIT))
    q = np.array([[1.0, -2.0, 3.0]])
    turned = scale.normalize(q) + [0, 0, 3 * scale.circles.period]
    assert scale.denormalize(turned) == pytest.approx(q)
    bounds = (scale.normalize(corner) for corner in (env.lower, env.upper))
    lower, upper = scale.circles.limits(*bounds)
    assert lower.tolist() == [-0.5, -0.5, -np.inf]
    assert upper.tolist() == [0.5, 0.5, np.inf]


def test_that_of_a_plain_space_has_no_circles(c3d: Environment) -> None:
    scale = Normalizer.of(c3d)
    assert scale.circles is NO_CIRCLES
    lower, upper = np.full((2, 3), [[-0.5], [0.5]])
    assert [end.tolist() for end in NO_CIRCLES.limits(lower, upper)] == [[-0.5] * 3, [0.5] * 3]


@pytest.mark.parametrize(
    ("space", "reason"),
    [
        (Space([Coordinates([0, 0], [1, 2])]), None),
        (OnePart.space, None),
        (Plane.space, "in parts"),
        (Space([Coordinates([0], [1]), Coordinates([0], [1])]), "in parts"),
        (envs.make("rigid").space, "rotations"),
    ],
    ids=str,
)
def test_spaces_that_they_do_not_compute_in(space: Space, reason: str | None) -> None:
    found = unsupported_space(space)
    assert found is None if reason is None else reason in str(found) and str(space) in str(found)


def test_obstacles_of_a_robot_that_is_no_point_are_scaled_by_how_far_it_comes(
    c3d: Environment,
) -> None:
    arm = envs.make("arm4")
    assert np.abs(obstacle_point_cloud(arm)).max() == pytest.approx(1.2 / arm.extent, rel=0.01)
    assert np.abs(obstacle_point_cloud(c3d)).max() <= 0.5
