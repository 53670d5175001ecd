"""Queries of meshes against mathematics and FCL, and the closing of holes."""

from __future__ import annotations

import pickle

import fcl
import numpy as np
import pytest
import trimesh

from envs.collision.mesh import MeshQueries, cap_holes
from envs.collision.shapes import Mesh


def made(mesh: trimesh.Trimesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces)


def without(mesh: trimesh.Trimesh, axis: int, beyond: float) -> Mesh:
    """A mesh without its faces beyond a plane."""
    keep = mesh.triangles_center[:, axis] < beyond
    return Mesh(mesh.vertices, mesh.faces[keep])


BOX = trimesh.creation.box((2.0, 4.0, 6.0)).subdivide().subdivide().subdivide()


def test_distances_to_a_box_by_hand() -> None:
    queries = MeshQueries(made(BOX))
    points = np.array([[0, 0, 0], [3, 0, 0], [1, 5, 0], [4, 6, 3], [0.9, 0, 0]], dtype=float)
    assert queries.distance(points) == pytest.approx([1, 2, 3, 5, 0.1])
    assert queries.is_inside(points).tolist() == [True, False, False, False, True]
    assert queries.encloses(points[:2]) == pytest.approx([1, 0], abs=1e-2)


def test_a_surface_wound_inward_encloses_as_well() -> None:
    inward = Mesh(BOX.vertices, BOX.faces[:, ::-1])
    queries = MeshQueries(inward)
    points = np.array([[0.0, 0, 0], [3.0, 0, 0]])
    assert queries.encloses(points) == pytest.approx([1, 0], abs=1e-2)
    assert queries.is_inside(points).tolist() == [True, False]


def test_distances_agree_with_fcl_near_and_far() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4).apply_scale((3, 2, 1))
    near, _ = trimesh.sample.sample_surface(mesh, 300, seed=1)
    rng = np.random.default_rng(0)
    points = np.concatenate([near + rng.normal(0, 0.01, near.shape), rng.uniform(-4, 4, (300, 3))])
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.faces))
    model.addSubModel(mesh.vertices, mesh.faces)
    model.endModel()
    body = fcl.CollisionObject(model, fcl.Transform())
    radius = 1e-6
    wanted = []
    for point in points:
        ball = fcl.CollisionObject(fcl.Sphere(radius), fcl.Transform(np.eye(3), point))
        wanted.append(fcl.distance(ball, body, fcl.DistanceRequest(), fcl.DistanceResult()))
    found = MeshQueries(made(mesh)).distance(points) - radius
    assert found == pytest.approx(np.array(wanted), abs=1e-9)


def test_queries_survive_pickling() -> None:
    queries = MeshQueries(made(BOX))
    points = np.random.default_rng(0).uniform(-4, 4, (50, 3))
    again = pickle.loads(pickle.dumps(queries))
    assert (again.distance(points) == queries.distance(points)).all()


def test_a_closed_mesh_needs_no_lid() -> None:
    mesh = made(BOX)
    assert cap_holes(mesh) is None


@pytest.mark.slow
@pytest.mark.parametrize("inward", [False, True])
def test_a_lid_closes_a_box_without_a_top(inward: bool) -> None:
    open_box = without(BOX, axis=2, beyond=2.9)
    if inward:
        open_box = Mesh(open_box.vertices, open_box.faces[:, ::-1])
    lid = cap_holes(open_box)
    assert lid is not None
    assert lid.vertices[:, 2].min() > 1.5, "it is at the top, if a little hollow"
    assert np.abs(lid.vertices[:, :2]).max(axis=0) == pytest.approx([1, 2], abs=0.06)
    closed = MeshQueries(open_box.joined(lid))
    rng = np.random.default_rng(0)
    inside = rng.uniform((-0.9, -1.9, -2.9), (0.9, 1.9, 1.0), (200, 3))
    outside = rng.uniform((-0.9, -1.9, 3.2), (0.9, 1.9, 5.0), (200, 3))
    queries = MeshQueries(open_box)
    assert queries.is_inside(inside).all()
    assert not queries.is_inside(outside).any()
    # No straight way out misses both.
    t = np.linspace(0, 1, 400)[:, None, None]
    ways = inside + t * (outside - inside)
    nearest = closed.distance(ways.reshape(-1, 3)).reshape(400, 200).min(axis=0)
    assert nearest.max() < 0.02


def test_two_holes_have_two_lids() -> None:
    both = without(BOX, axis=2, beyond=2.9)
    keep = BOX.triangles_center[:, 2] > -2.9
    keep &= BOX.triangles_center[:, 2] < 2.9
    both = Mesh(BOX.vertices, BOX.faces[keep])
    lid = cap_holes(both)
    assert lid is not None
    pieces = trimesh.Trimesh(lid.vertices, lid.faces).split(only_watertight=False)
    assert len(pieces) == 2


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (np.eye(3), [[0, 1, 3]]),
        (np.eye(3), [[0, 1, -1]]),
        (np.eye(3), np.zeros((0, 3))),
        (np.eye(3), [[0, 1]]),
        (np.full((3, 3), np.nan), [[0, 1, 2]]),
    ],
)
def test_meshes_that_make_no_sense(vertices: np.ndarray, faces: object) -> None:
    with pytest.raises(ValueError, match="mesh"):
        Mesh(vertices, faces)  # type: ignore[arg-type]
