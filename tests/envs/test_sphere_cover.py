"""Spheres that cover solids."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from envs import InputError
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, Spheres
from envs.problem import Array

SLACK = 0.005
SIZE = st.floats(0.01, 0.6)
SIDES = st.tuples(SIZE, SIZE, SIZE)


def points_of(solid: Solid, n: int = 2000) -> Array:
    """Points (n, 3) of a solid's surface and, but of meshes, of its inside; corners as well."""
    rng = np.random.default_rng(0)
    if isinstance(solid, Mesh):
        found, _ = trimesh.sample.sample_surface(solid.triangulate(), n, seed=0)
        return np.concatenate([found, solid.vertices])
    share = np.where(rng.random(n) < 0.7, 1, rng.random(n))[:, None]  # 1 on the surface
    if isinstance(solid, Box):
        cube = rng.uniform(-1, 1, (n, 3))
        cube /= np.abs(cube).max(axis=1)[:, None]
        corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
        inside: Array = np.concatenate([share * cube, corners]) * solid.sides / 2 + solid.center
        return inside
    way = rng.normal(size=(n, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    if isinstance(solid, Sphere):
        return share * solid.radius * way
    if isinstance(solid, Capsule):
        along = (
            np.sign(way[:, 2:]) * [0, 0, solid.length / 2] * rng.uniform(0, 2, (n, 1)).clip(0, 1)
        )
        return share * solid.radius * way + along
    # The sphere blown up to a cylinder: rims have points of their own.
    side = np.maximum(np.linalg.norm(way[:, :2], axis=1), 1e-9)[:, None]
    way = way / np.maximum(side, np.abs(way[:, 2:]))
    rims = np.column_stack([way[:, :2] / np.linalg.norm(way[:, :2], axis=1)[:, None], share])
    rims[:, 2] = np.sign(way[:, 2])
    return np.concatenate([share * way, rims]) * [solid.radius, solid.radius, solid.length / 2]


def outside(spheres: Spheres, points: Array) -> Array:
    """By how much points (n, 3) lie outside of all spheres, (n,); negative within one."""
    away = np.linalg.norm(points[:, None] - spheres.centers[None], axis=2)
    found: Array = (away - spheres.radii).min(axis=1)
    return found


def assert_held(solid: Solid, slack: float = SLACK) -> Spheres:
    spheres, points = solid.sphere_cover(slack), points_of(solid)
    assert spheres.centers.shape == (len(spheres.radii), 3)
    for block in np.array_split(points, 8):
        assert outside(spheres, block).max() <= 1e-9
    center, radius = solid.bounding_sphere()
    assert np.linalg.norm(points - center, axis=1).max() <= radius + 1e-9
    return spheres


def test_a_sphere_covers_itself() -> None:
    spheres = assert_held(Sphere(0.3))
    assert (spheres.centers == 0).all()
    assert spheres.radii.tolist() == [0.3]
    assert Sphere(0.3).bounding_sphere()[1] == 0.3


@given(SIZE, SIZE)
@settings(max_examples=50, deadline=None)
def test_cylinders_are_covered_and_their_sides_kept_to_the_slack(
    radius: float, length: float
) -> None:
    spheres = assert_held(Cylinder(radius, length))
    assert (spheres.centers[:, :2] == 0).all()
    assert spheres.radii.max() <= radius + SLACK + 1e-12
    ends = (np.abs(spheres.centers[:, 2]) + spheres.radii).max()
    assert ends <= length / 2 + radius + SLACK, "no farther than a sphere is wide"


@given(SIZE, SIZE)
@settings(max_examples=50, deadline=None)
def test_capsules_are_covered_and_kept_to_the_slack(radius: float, length: float) -> None:
    spheres = assert_held(Capsule(radius, length))
    assert (spheres.centers[:, :2] == 0).all()
    assert spheres.radii.max() <= radius + SLACK + 1e-12
    ends = (np.abs(spheres.centers[:, 2]) + spheres.radii).max()
    assert ends <= length / 2 + radius + SLACK + 1e-12


def test_a_tighter_cover_of_a_cylinder_has_more_spheres() -> None:
    counts = [len(Cylinder(0.05, 1.0).sphere_cover(slack).radii) for slack in (0.02, 0.005, 0.001)]
    assert counts == sorted(set(counts))


@given(SIDES, SIDES)
@settings(max_examples=50, deadline=None)
def test_boxes_are_covered(
    center: tuple[float, float, float], sides: tuple[float, float, float]
) -> None:
    assert_held(Box(np.array(center), np.array(sides)))


@given(SIDES)
@settings(max_examples=50, deadline=None)
def test_spheres_reach_out_of_the_largest_sides_of_a_box_by_little(
    sides: tuple[float, float, float],
) -> None:
    spheres = Box(np.zeros(3), np.array(sides)).sphere_cover(SLACK)
    thin = int(np.argmin(sides))
    out = (np.abs(spheres.centers[:, thin]) + spheres.radii).max() - sides[thin] / 2
    assert out <= max(SLACK, sides[thin] / 8) + 1e-9


def hull(rng: np.random.Generator, sides: tuple[float, float, float]) -> Mesh:
    """Of random points, with long thin triangles."""
    mesh = trimesh.convex.convex_hull(rng.uniform(-0.5, 0.5, (12, 3)) * sides + sides)
    return Mesh(mesh.vertices, mesh.faces)


@given(SIDES, st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_surfaces_of_meshes_are_covered(sides: tuple[float, float, float], seed: int) -> None:
    solid = hull(np.random.default_rng(seed), sides)
    spheres = assert_held(solid)
    cell = max(4 * SLACK, np.ptp(solid.vertices, axis=0).max() / 12)
    assert spheres.radii.max() <= 2.1 * cell, "cells and what hangs over of their triangles"


def test_large_triangles_fine_ones_and_open_surfaces_are_covered() -> None:
    block = trimesh.creation.box((1.0, 0.02, 0.3))
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    sheet = Mesh(np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    for solid in (Mesh(block.vertices, block.faces), Mesh(ball.vertices, ball.faces), sheet):
        assert_held(solid)


def test_vertices_that_no_face_names_do_not_matter() -> None:
    vertices = np.array([[0.0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0.5, 0.5, 0.5]])
    spheres = Mesh(vertices, np.array([[0, 1, 2]])).sphere_cover(SLACK)
    assert outside(spheres, vertices[:3]).max() <= 1e-9
    assert outside(spheres, vertices[3:])[0] > 0.3


@pytest.mark.parametrize(
    "solid",
    [Cylinder(1e-9, 1e6), Capsule(1e-9, 1e6), Box(np.zeros(3), np.array([1e6, 300.0, 1e-3]))],
)
def test_what_would_take_too_many_is_refused(solid: Solid) -> None:
    with pytest.raises(InputError, match=r"would take .* is its size in metres\?"):
        solid.sphere_cover(SLACK)
