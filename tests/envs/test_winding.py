"""Winding numbers, compiled: against what is known, and against libigl."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.collision.open_edges import cells_beside, is_beside, open_edges
from envs.collision.shapes import Mesh
from envs.collision.winding import (
    EVERYWHERE,
    is_on_the_right_side,
    sides_of,
    stays_on_the_right_side,
    winding_number,
)
from envs.problem import Array

NOWHERE = np.inf, np.inf


def as_mesh(made: trimesh.Trimesh) -> Mesh:
    return Mesh(made.vertices, made.faces)


def soup(seed: int, count: int) -> Mesh:
    """Triangles anywhere, large and small, some of no area."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3)) * rng.choice(
        [1e-3, 0.1, 1.0], size=(count, 1, 1)
    )
    corners[rng.random(count) < 0.05, 2] = corners[0, 1]
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def numbers(mesh: Mesh, points: Array, error: float) -> Array:
    """Winding numbers and what they may be off by, (n, 2)."""
    sides = sides_of([mesh], [np.array([NOWHERE, NOWHERE])], 1.0, [])
    return np.array([winding_number(sides, 0, *point, error) for point in points])


def test_a_corner_of_space_takes_an_eighth_of_the_sphere() -> None:
    far = 1e9 * np.eye(3)
    for turned, sign in ((far, 1), (far[::-1], -1)):
        [(found, off)] = numbers(Mesh(turned, np.array([[0, 1, 2]])), np.zeros((1, 3)), 0.0)
        assert off == 0
        assert found == pytest.approx(sign / 8, abs=1e-6)


@pytest.mark.parametrize("error", [0.0, 1e-4, 1e-2])
def test_of_closed_surfaces_it_is_how_often_they_go_round(error: float) -> None:
    outer, inner = trimesh.creation.icosphere(3, 2.0), trimesh.creation.icosphere(2, 1.0)
    cavity = inner.copy()
    cavity.invert()
    points = np.array([[0.0, 0.1, 0.2], [0.0, 1.5, 0.0], [2.5, 0.0, 0.0], [40.0, 1.0, 0.0]])
    for more, wanted in ((inner, [2, 1, 0, 0]), (cavity, [0, 1, 0, 0])):
        found = numbers(as_mesh(trimesh.util.concatenate([outer, more])), points, error)
        assert (np.abs(found[:, 0] - wanted) <= found[:, 1] + 1e-9).all()
        assert found[:, 0] == pytest.approx(np.array(wanted), abs=0.05)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1, 2, 3, 7, 40, 400]), st.floats(1e-6, 1.0))
def test_numbers_are_off_by_no_more_than_is_said(seed: int, count: int, error: float) -> None:
    mesh = soup(seed, count)
    points = np.random.default_rng(seed + 1).normal(size=(20, 3)) * 2
    exact, rough = numbers(mesh, points, 0.0), numbers(mesh, points, error)
    assert (exact[:, 1] == 0).all()
    assert (np.abs(rough[:, 0] - exact[:, 0]) <= rough[:, 1] + 1e-9).all()
    tree = igl.FastWindingNumberBVH()
    tree.init(np.array(mesh.vertices), np.array(mesh.faces))
    assert exact[:, 0] == pytest.approx(tree.winding_number(points), abs=0.05)


def test_far_away_a_few_nodes_tell() -> None:
    """The moments count: without them a patch far off is a hundred times as uncertain."""
    patch = as_mesh(trimesh.creation.icosphere(4).slice_plane([0, 0, 0], [0, 0, 1]))
    points = np.random.default_rng(0).normal(size=(50, 3))
    points *= 20 / np.linalg.norm(points, axis=1, keepdims=True)
    exact = numbers(patch, points, 0.0)
    rough = numbers(patch, points, 1.0)
    assert (rough[:, 1] > 0).all()
    assert np.abs(rough[:, 0] - exact[:, 0]).max() < 2e-6 < np.abs(exact[:, 0]).min()


def test_points_are_on_the_right_side_in_one_of_two_ranges_of_each_surface() -> None:
    outer, inner = (as_mesh(trimesh.creation.icosphere(3, r)) for r in (2.0, 1.0))
    ranges = [np.array([(0.5, np.inf), NOWHERE]), np.array([(-0.5, 0.5), (1.5, 2.5)])]
    sides = sides_of([outer, inner], ranges, 1.0, [])
    assert is_on_the_right_side(sides, 1.5, 0.0, 0.0)
    assert not is_on_the_right_side(sides, 0.5, 0.0, 0.0)
    assert not is_on_the_right_side(sides, 2.5, 0.0, 0.0)
    twice = sides_of([outer], [np.array([(-0.1, 0.1), (0.9, 1.1)])], 1.0, [])
    for x in (0.0, 1.5, 3.0):
        assert is_on_the_right_side(twice, x, 0.0, 0.0)
    assert is_on_the_right_side(EVERYWHERE, 0.0, 0.0, 0.0)


def test_at_the_end_of_a_range_nothing_is_proved() -> None:
    """Where half of everything is taken up, to the last digit, no number of questions tells."""
    disc = Mesh(
        np.array([[-1e6, -1e6, 0], [1e6, -1e6, 0], [0, 1e6, 0]], dtype=float), np.array([[0, 1, 2]])
    )
    [(found, _)] = numbers(disc, np.array([[0.0, 0.0, -1.0]]), 0.0)
    sides = sides_of([disc], [np.array([(found, np.inf), (-np.inf, found)])], 1.0, [])
    assert not is_on_the_right_side(sides, 0.0, 0.0, -1.0)
    assert is_on_the_right_side(sides, 0.0, 0.0, 1.0)


def test_closed_surfaces_have_no_open_edges_however_they_are_written() -> None:
    box = trimesh.creation.box((2, 2, 2))
    apart = Mesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    for mesh in (as_mesh(box), apart):
        assert len(open_edges(mesh)) == 0
        assert not cells_beside([mesh], 0.5).beside.any()


def test_edges_are_open_about_what_is_missing_or_turned() -> None:
    box = trimesh.creation.box((2, 2, 2))
    top = np.flatnonzero(box.face_normals[:, 2] > 0.5)
    lidless = Mesh(box.vertices, np.delete(box.faces, top, axis=0))
    edges = open_edges(lidless)
    assert len(edges) == 4
    assert edges[:, :, 2] == pytest.approx(np.ones((4, 2)))
    turned = box.faces.copy()
    turned[top] = turned[top, ::-1]
    assert len(open_edges(Mesh(box.vertices, turned))) == 4
    twice = Mesh(box.vertices, np.concatenate([lidless.faces, lidless.faces[:, ::-1]]))
    assert len(open_edges(twice)) == 0, "what is written both ways is no side of anything"


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.6))
def test_cells_hold_all_that_is_near_open_edges(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    mesh = soup(seed, 3)
    cells = cells_beside([mesh], reach)
    ends = open_edges(mesh)
    t = rng.random((len(ends), 40, 1))
    on = (1 - t) * ends[:, None, 0] + t * ends[:, None, 1]
    aside = rng.normal(size=on.shape)
    aside *= (rng.random(t.shape) * reach) / np.linalg.norm(aside, axis=-1, keepdims=True)
    for point in (on + aside).reshape(-1, 3):
        assert is_beside(cells, *point)
    assert not is_beside(cells, *(np.abs(ends).max(axis=(0, 1)) + 4 * reach))


def test_motions_are_asked_about_beside_open_edges_and_at_their_ends() -> None:
    """Through a lidless box, in and out again: at its rim it is known where one is."""
    box = trimesh.creation.box((2, 2, 2))
    top = np.flatnonzero(box.face_normals[:, 2] > 0.5)
    lidless = Mesh(box.vertices, np.delete(box.faces, top, axis=0))
    sides = sides_of([lidless], [np.array([(-0.6, 0.6), NOWHERE])], 0.3, [])
    outside, within = np.array([0.9, 0.0, 1.8]), np.array([0.9, 0.0, -0.5])
    assert not stays_on_the_right_side(sides, outside, within)
    over = np.array([-0.9, 0.0, 1.8])
    assert stays_on_the_right_side(sides, outside, over)
    beyond = np.array([0.9, 0.0, 1.1])
    assert stays_on_the_right_side(sides, outside, beyond)
