"""Batched distances against known answers and against FCL."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import envs
from envs import Environment
from envs.collision.distance_fields import signed_distance_to_boxes
from envs.collision.shapes import Box, Sphere

UNIT = Box([0, 0, 0], [2, 2, 2])


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ([3, 0, 0], 2),  # before a face
        ([3, 3, 0], 2 * 2**0.5),  # off an edge
        ([3, -3, 3], 2 * 3**0.5),  # off a corner
        ([0, 0, 0], -1),  # at the centre
        ([0.9, 0, 0.2], -0.1),  # just inside a face
        ([1, 0.3, -0.5], 0),  # on the surface
    ],
)
def test_distance_to_a_box(point: list[float], distance: float) -> None:
    found = signed_distance_to_boxes(np.array([point], float), [UNIT])
    assert found == pytest.approx([distance], abs=1e-12)


def test_a_union_is_as_near_as_its_nearest_box() -> None:
    boxes = [UNIT, Box([10, 0, 0], [2, 2, 2])]
    found = signed_distance_to_boxes(np.array([[4.0, 0, 0], [8.0, 0, 0]]), boxes)
    assert found == pytest.approx([3, 1])


def test_no_boxes_are_infinitely_far() -> None:
    assert np.isposinf(signed_distance_to_boxes(np.zeros((1, 3)), [])).all()


NUMBERS = st.floats(-20, 20) | st.sampled_from([-np.inf, np.inf, np.nan, -0.0, 1.0])
BOXES = st.lists(
    st.tuples(*[st.floats(-9, 9)] * 3, *[st.floats(0.01, 5)] * 3).map(
        lambda of: Box(list(of[:3]), list(of[3:]))
    ),
    min_size=1,
    max_size=4,
)


@given(st.lists(st.tuples(*[NUMBERS] * 3), min_size=1, max_size=20), BOXES)
def test_distances_are_those_of_the_formula_to_the_last_bit(
    points: list[tuple[float, float, float]], boxes: list[Box]
) -> None:
    """Problems are drawn by them: another rounding would draw others."""
    found = signed_distance_to_boxes(np.array(points), boxes)
    off = [np.abs(np.array(points) - box.center) - box.sides / 2 for box in boxes]
    with np.errstate(invalid="ignore"):
        outside = [np.maximum(d, 0.0) for d in off]
        squared = [o[:, 0] * o[:, 0] + o[:, 1] * o[:, 1] + o[:, 2] * o[:, 2] for o in outside]
        each = [
            np.sqrt(s) + np.minimum(d.max(axis=1), 0.0) for s, d in zip(squared, off, strict=True)
        ]
    np.testing.assert_array_equal(found, np.min(each, axis=0))


def test_clearance_is_measured_from_the_robots_surface() -> None:
    q = np.random.default_rng(0).uniform(-10, 10, (1000, 3))
    thin, thick = envs.make("c3d:robot_radius=0"), envs.make("c3d:robot_radius=0.5")
    assert thick.clearance(q) == pytest.approx(thin.clearance(q) - 0.5)


@pytest.mark.parametrize("radius", [0, 0.01, 0.5])
def test_clearance_agrees_with_fcl(radius: float) -> None:
    env = envs.make(f"c3d:robot_radius={radius}")
    model = env.collision_model()
    q = np.random.default_rng(1).uniform(-10, 10, (5000, 3))
    batched = env.clearance(q)
    exact = np.array([model.clearance(p) for p in q])
    free = batched > 0
    assert exact[free] == pytest.approx(batched[free], abs=1e-9)
    assert (exact[~free] <= 0).all()
    assert [model.is_valid(p) for p in q] == free.tolist()


def test_inside_a_box_is_a_collision_without_touching_a_face(c3d: Environment) -> None:
    model = c3d.collision_model()
    for box in c3d.obstacles:
        assert not model.is_valid(box.center)
        assert model.clearance(box.center) < 0
        assert not model.segment_is_free(box.center, box.center + 1e-3)
    assert (c3d.clearance(np.array([box.center for box in c3d.obstacles])) < -0.9).all()


def test_speed_of_c3d(c3d: Environment) -> None:
    q = np.random.default_rng(2).uniform(-10, 10, (1000, 3))
    assert c3d.speed(q) == pytest.approx(np.clip(c3d.clearance(q), 0.2, 2) / 2)


@given(st.integers(0, 2**32 - 1))
def test_boxes_stay_inside_the_cube(scene: int) -> None:
    env = envs.make(f"c3d:scene={scene}")
    assert len(env.obstacles) == 10
    for box in env.obstacles:
        assert ((box.sides >= 2) & (box.sides <= 6)).all()
        assert (np.abs(box.center) + box.sides / 2 <= 10 + 1e-9).all()


def test_shapes_refuse_nonsense() -> None:
    with pytest.raises(ValueError, match="positive"):
        Box([0, 0, 0], [1, -1, 1])
    with pytest.raises(ValueError, match="NaN"):
        Box([0, np.nan, 0], [1, 1, 1])
    with pytest.raises(ValueError, match="radius"):
        Sphere(-1)


@pytest.mark.parametrize("shape", [(3,), (2, 2), (2, 3, 1)])
def test_clearance_refuses_other_shapes(c3d: Environment, shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="must be"):
        c3d.clearance(np.zeros(shape))
