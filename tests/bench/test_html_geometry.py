"""What the HTML report draws: packed arrays, simplified shapes, places of collisions."""

from __future__ import annotations

import base64
import gzip

import numpy as np
import pytest
from html_reports import unpacked
from hypothesis import given
from hypothesis import strategies as st
from turning_cubes import Plane

import envs
from bench.report.html.geometry import (
    POSTURES,
    TOLERANCE,
    Scene,
    compressed,
    packed,
    simplified,
    thinned,
)
from bench.report.postures import RobotShape, along, drawable, triangles_of
from envs import Environment
from envs.collision.shapes import Box
from envs.spaces import Coordinates, Rotations, Space


@given(
    st.lists(st.floats(-1e5, 1e5), max_size=30),
    st.floats(1e-4, 10),
)
def test_numbers_are_packed_to_half_a_step(numbers: list[float], step: float) -> None:
    back = unpacked(packed(np.array(numbers), step), -1)
    assert np.abs(back - numbers).max(initial=0) <= step / 2 * (1 + 1e-6)


def test_small_numbers_take_half_the_room() -> None:
    assert packed(np.array([32767.0]), 1)["type"] == "Int16Array"
    assert packed(np.array([32768.0]), 1)["type"] == "Int32Array"


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e12])
def test_what_no_integer_holds_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="not finite, or too large"):
        packed(np.array([0.0, bad]), 1)


def test_a_text_is_compressed_the_same_way_each_time() -> None:
    assert gzip.decompress(base64.b64decode(compressed("čau"))).decode() == "čau"
    assert compressed("x" * 99) == compressed("x" * 99)


@given(
    st.lists(st.tuples(*[st.floats(-10, 10)] * 3), min_size=1, max_size=40),
    st.floats(1e-3, 3),
)
def test_a_thinned_path_stays_within_the_tolerance(
    points: list[tuple[float, float, float]], tolerance: float
) -> None:
    path = np.array(points)
    kept = thinned(path, tolerance)
    assert np.array_equal(kept[[0, -1]], path[[0, -1]])
    a, b = kept[:-1], kept[1:]
    for point in path[1:-1]:
        step = b - a
        share = ((point - a) * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-300)
        nearest = a + share.clip(0, 1)[:, None] * step
        assert np.linalg.norm(point - nearest, axis=1).min() <= tolerance * (1 + 1e-9)


def test_a_straight_path_is_thinned_to_its_ends() -> None:
    path = np.linspace([0, 0, 0], [1, 2, 3], 100)
    assert np.array_equal(thinned(path, 1e-6), path[[0, -1]])


def test_a_large_surface_is_simplified_and_stays_where_it_was() -> None:
    box = triangles_of([Box(np.zeros(3), np.full(3, 4.0))])
    many = box
    for _ in range(5):  # each triangle into four
        a, b, c = many[:, 0], many[:, 1], many[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        many = np.concatenate([np.stack(part, axis=1) for part in parts])
    few = simplified(many, 2000)
    assert 500 < len(few.faces) <= 2000
    on_surface = np.abs(np.abs(few.vertices).max(axis=1) - 2)
    assert on_surface.max() < 0.3
    assert abs(few.area / 96 - 1) < 0.1


def test_a_small_surface_is_left_as_it_is() -> None:
    box = triangles_of([Box(np.zeros(3), np.ones(3))])
    assert simplified(box, 12).area == pytest.approx(6)
    assert len(simplified(box, 12).faces) == 12


def test_arrays_that_are_no_paths_of_the_environment_are_not_drawn(c3d: Environment) -> None:
    assert drawable(c3d, np.zeros((2, 3)))
    for bad in (np.zeros((2, 4)), np.zeros((0, 3)), np.full((2, 3), np.nan), np.full((2, 3), 1e9)):
        assert not drawable(c3d, bad)


def test_quaternions_of_a_drawn_path_are_rotations() -> None:
    class Free(Plane):
        space = Space([Coordinates([-4] * 3, [4] * 3), Rotations()])
        lower = np.array([-4.0] * 3 + [-1.0] * 4)
        upper = -lower

    upright = np.array([[0, 0, 0, 0, 0, 0, 1.0], [9, 9, 9, 0, 0, 1, 0]])
    assert drawable(Free(), upright), "somewhat out of bounds"
    assert not drawable(Free(), np.zeros((2, 7)))
    assert not drawable(Free(), upright * [[1], [np.nan]])


def test_an_arm_is_drawn_where_it_is_along_the_path() -> None:
    env = envs.make("arm4")
    scene = Scene(env)
    path = np.stack([env.lower / 2, env.upper / 3])
    drawn, links = scene.drawn(path), scene.data()["links"]
    poses = unpacked(drawn["postures"], POSTURES, len(links), 3, 4)
    for number, q in ((0, path[0]), (POSTURES // 2, path.mean(axis=0)), (-1, path[1])):
        posed = [
            unpacked(link["vertices"], -1, 3)[unpacked(link["faces"], -1, 3).astype(int)]
            @ pose[:, :3].T
            + pose[:, 3]
            for link, pose in zip(links, poses[number], strict=True)
        ]
        true = RobotShape(env, env.robot).triangles(q)
        assert np.allclose(np.concatenate(posed).mean(axis=0), true.mean(axis=0), atol=2e-3)
    [curve] = drawn["curves"]
    tip = unpacked(curve, -1, 3)
    assert np.allclose(tip[[0, -1], None], scene.points(path), atol=2e-3)


def test_a_path_is_drawn_to_the_stated_tolerance(c3d: Environment) -> None:
    turns = np.linspace(0, 6 * np.pi, 500)
    path = np.column_stack([9 * np.cos(turns), 9 * np.sin(turns), np.linspace(-9, 9, 500)])
    [packed_curve] = Scene(c3d).drawn(path)["curves"]
    curve = unpacked(packed_curve, -1, 3)
    assert len(curve) < 200
    dense = along(c3d.space, curve, np.linspace(0, 1, 20_000))
    off = np.array([np.linalg.norm(dense - point, axis=1).min() for point in path])
    assert off.max() <= TOLERANCE * 20 * 1.1
