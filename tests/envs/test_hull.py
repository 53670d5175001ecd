"""Convex hulls of meshes, and distances from them."""

from __future__ import annotations

import coal
import numpy as np
import pytest
import trimesh
from arms import at
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envs.collision.hull import Hull, hull_of
from envs.collision.mesh import queries
from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.problem import Array

seeds = st.integers(0, 2**32 - 1)


def as_mesh(one: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(one.vertices), np.asarray(one.faces))


def cloud(rng: np.random.Generator, count: int) -> trimesh.Trimesh:
    """The hull of random points."""
    return trimesh.convex.convex_hull(rng.normal(0, 0.1, (count, 3)))


def ell() -> trimesh.Trimesh:
    """An L of two boxes that overlap, as one surface."""
    along_x, along_y = np.eye(4), np.eye(4)
    along_x[0, 3] = along_y[1, 3] = 0.5
    return trimesh.util.concatenate(
        trimesh.creation.box((2, 1, 1), along_x), trimesh.creation.box((1, 2, 1), along_y)
    )


def test_a_convex_mesh_is_the_surface_of_its_hull_and_others_are_not() -> None:
    cube = trimesh.creation.box((1, 2, 3))
    assert hull_of(as_mesh(cube)).is_surface
    cube.invert()
    assert hull_of(as_mesh(cube)).is_surface, "whichever way its faces are wound"
    assert not hull_of(as_mesh(ell())).is_surface
    open_box = Mesh(cube.vertices, cube.faces[2:])
    assert not hull_of(open_box).is_surface, "what goes in through its hole is in its hull"
    doubled = Mesh(cube.vertices, np.concatenate([cube.faces, cube.faces]))
    assert not hull_of(doubled).is_surface


def test_a_dent_that_is_hardly_there_is_no_surface_of_a_hull() -> None:
    """The hull is nearer by the dent's depth, which is more than distances may be off."""
    plate = trimesh.creation.box((1, 1, 0.1)).subdivide()
    top = int(np.argmin(np.linalg.norm(plate.vertices - [0, 0, 0.05], axis=1)))
    vertices = np.array(plate.vertices)
    vertices[top, 2] -= 1e-4
    assert not hull_of(Mesh(vertices, plate.faces)).is_surface


@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_a_hull_holds_its_mesh(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = as_mesh(cloud(rng, int(rng.integers(4, 200))))
    assert beyond(hull_of(mesh), mesh.vertices) == 0


def test_one_of_very_many_corners_has_fewer_and_a_radius() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.2)
    found = hull_of(as_mesh(ball))
    assert len(ball.vertices) > 2000
    assert len(found.corners) <= 128
    assert 0 < found.radius < 0.01
    assert beyond(found, np.asarray(ball.vertices)) == 0


def test_flat_meshes_have_the_box_about_them() -> None:
    flat = Mesh(np.array([[0, 0, 1], [2, 0, 1], [0, 3, 1.0]]), np.array([[0, 1, 2]]))
    found = hull_of(flat)
    assert not found.is_surface
    assert sorted(map(tuple, found.corners.tolist()))[0] == (0, 0, 1)
    assert sorted(map(tuple, found.corners.tolist()))[-1] == (2, 3, 1)


def beyond(hull: Hull, points: Array) -> int:
    """How many points lie farther than the radius from the hull of the corners."""
    core = trimesh.convex.convex_hull(hull.corners)
    outside = points[(core.face_normals @ points.T > _offsets(core)).any(axis=0)]
    far = queries(as_mesh(core)).distance(outside) if len(outside) else np.zeros(0)
    return int((far > hull.radius + 1e-9).sum())


def _offsets(core: trimesh.Trimesh) -> Array:
    corners = core.triangles[:, 0]
    return np.einsum("ni,ni->n", core.face_normals, corners)[:, None]


def test_distances_from_convex_meshes_are_those_of_coal() -> None:
    """Of hulls from hulls, boxes, cylinders, capsules: never above, below by at most 1e-6."""
    rng = np.random.default_rng(0)
    apart = 0
    for trial in range(400):
        one = cloud(rng, 40)
        other, exact = _other(rng, trial % 5)
        pose, there = _pose(rng), _pose(rng)
        shapes = shapes_of([PlacedShape(as_mesh(one), np.eye(4)), PlacedShape(other, np.eye(4))])
        found = separations(shapes, 0, 1, np.array([[pose[:3], there[:3]]]), np.inf)[0]
        result = coal.DistanceResult()
        truth = coal.distance(
            *(_convex(one), coal.Transform3s(pose[:3, :3], pose[:3, 3])),
            *(exact, coal.Transform3s(there[:3, :3], there[:3, 3])),
            *(coal.DistanceRequest(), result),
        )
        if truth <= 0:
            continue
        apart += 1
        assert truth - 2e-6 <= found <= truth + 1e-9
    assert apart > 200


def _other(rng: np.random.Generator, kind: int) -> tuple[Solid, coal.CollisionGeometry]:
    if kind == 0:
        mesh = cloud(rng, 60)
        return as_mesh(mesh), _convex(mesh)
    if kind == 1:
        return Box([0, 0, 0], [0.1, 0.2, 0.3]), coal.Box(0.1, 0.2, 0.3)
    if kind == 2:
        return Cylinder(0.1, 0.3), coal.Cylinder(0.1, 0.3)
    if kind == 3:
        return Capsule(0.1, 0.3), coal.Capsule(0.1, 0.3)
    return Sphere(0.1), coal.Sphere(0.1)


def _convex(mesh: trimesh.Trimesh) -> coal.Convex:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addVertices(np.asarray(mesh.vertices))
    model.addTriangles(np.asarray(mesh.faces))
    model.endModel()
    model.buildConvexRepresentation(False)
    return model.convex


def _pose(rng: np.random.Generator) -> Array:
    pose = at(*rng.uniform(-0.4, 0.4, 3))
    pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    return pose


@pytest.mark.parametrize("gap", [0.2, 0.001])
def test_what_stands_in_the_bend_of_an_l_is_as_far_as_its_surface(gap: float) -> None:
    """Within the hull, and apart from the mesh."""
    shapes = shapes_of(
        [PlacedShape(as_mesh(ell()), np.eye(4)), PlacedShape(Box([0, 0, 0], [0.1] * 3), np.eye(4))]
    )
    there = at(0.5 + gap + 0.05, 0.5 + gap + 0.05, 0)
    found = separations(shapes, 0, 1, np.array([[np.eye(4)[:3], there[:3]]]), np.inf)[0]
    assert found == pytest.approx(gap, abs=1e-6)
