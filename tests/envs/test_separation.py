"""Distances between shapes of all kinds, against coal."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import coal
import numpy as np
import pytest
import trimesh
from coal_shapes import coal_mesh
from scipy.spatial.transform import Rotation

from envs.collision import mesh, mesh_tree
from envs.collision.fcl_model import CollisionModel
from envs.collision.gjk import hull_distance, moved
from envs.collision.separation import (
    clearances_of_each,
    contacts_array,
    corners,
    separations,
    shapes_of,
)
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.problem import Array
from envs.robots.point import PointRobot

STILL = np.eye(3, 4)
EGG = trimesh.creation.icosphere(subdivisions=2).apply_scale([0.1, 0.06, 0.13])
ROD = trimesh.creation.cylinder(0.02, 0.4, sections=32)  # of slivers


def as_mesh(one: trimesh.Trimesh) -> Mesh:
    return Mesh(one.vertices, one.faces)


SOLIDS: dict[str, tuple[Solid, Any]] = {
    "box": (Box(np.zeros(3), np.array([0.2, 0.1, 0.04])), coal.Box(0.2, 0.1, 0.04)),
    "cylinder": (Cylinder(0.03, 0.3), coal.Cylinder(0.03, 0.3)),
    "capsule": (Capsule(0.03, 0.3), coal.Capsule(0.03, 0.3)),
    "ball": (Sphere(0.05), coal.Sphere(0.05)),
    "egg": (as_mesh(EGG), coal_mesh(EGG.vertices, EGG.faces)),
    "rod": (as_mesh(ROD), coal_mesh(ROD.vertices, ROD.faces)),
}


def by_coal(a: Any, b: Any, pose: Array) -> float:
    at = coal.Transform3s(np.ascontiguousarray(pose[:, :3]), pose[:, 3])
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(a, coal.Transform3s(), b, at, request, result))


@pytest.mark.parametrize("other", SOLIDS)
@pytest.mark.parametrize("one", ["egg", "rod"])
def test_distances_from_meshes_are_never_above_the_truth_and_hardly_below(
    one: str, other: str
) -> None:
    """Far apart and, half of them, by a micrometre to a centimetre."""
    (solid, a), (other_solid, b) = SOLIDS[one], SOLIDS[other]
    shapes = shapes_of([PlacedShape(solid, np.eye(4)), PlacedShape(other_solid, np.eye(4))])
    rng = np.random.default_rng(0)
    touching = 0
    for turn in Rotation.random(250, rng=rng).as_matrix():
        way = rng.normal(size=3)
        pose = np.column_stack([turn, rng.uniform(0.02, 0.5) * way / np.linalg.norm(way)])
        exact = by_coal(a, b, pose)
        if rng.random() < 0.5 and exact > 0:
            pose[:, 3] *= 1 - (exact - 10 ** rng.uniform(-6, -2)) / np.linalg.norm(pose[:, 3])
            exact = by_coal(a, b, pose)
        found = separations(shapes, 0, 1, np.array([[STILL, pose]]), np.inf)[0]
        touching += exact <= 0
        assert found <= max(exact, 0) + 1e-9
        assert found >= exact - 2e-6
        assert separations(shapes, 1, 0, np.array([[pose, STILL]]), np.inf)[0] == pytest.approx(
            found, abs=2e-6
        )
        most = exact / 2
        assert separations(shapes, 0, 1, np.array([[STILL, pose]]), most)[0] >= min(most, found)
    assert touching > 10


def test_where_hulls_are_nearest_there_may_be_no_mesh() -> None:
    """Above a dent, and beside it, of a ball that is its hull else."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    points = np.array(ball.vertices)
    points[0] *= 0.7
    dented, box = Mesh(points, np.asarray(ball.faces)), SOLIDS["box"][0]
    coals = coal_mesh(points, np.asarray(ball.faces)), SOLIDS["box"][1]
    rng, up = np.random.default_rng(1), ball.vertices[0] / np.linalg.norm(ball.vertices[0])
    gains = []
    for other, b in ((box, coals[1]), (dented, coals[0])):
        shapes = shapes_of([PlacedShape(dented, np.eye(4)), PlacedShape(other, np.eye(4))])
        for turn in Rotation.random(100, rng=rng).as_matrix():
            way = up + rng.normal(size=3) * rng.choice([0.02, 0.5])
            pose = np.column_stack([turn, 0.3 * way / np.linalg.norm(way)])
            [found] = separations(shapes, 0, 1, np.array([[STILL, pose]]), np.inf)
            exact = by_coal(coals[0], b, pose)
            assert exact - 2e-6 <= found <= exact + 2e-6
            rows = shapes.rows.copy()
            moved(shapes.rows[1], pose, rows[1])
            hulls = hull_distance(rows[0], corners(shapes, 0), rows[1], corners(shapes, 1), np.inf)
            gains.append(found - hulls)
    assert sum(gain > 1e-4 for gain in gains) > 10
    assert sum(gain < 1e-6 for gain in gains) > 10


def test_shapes_placed_elsewhere_are_where_they_are_placed() -> None:
    """A mesh, a box with a centre of its own, and one of either that is turned."""
    egg, box = as_mesh(EGG), Box(np.array([0.5, 0, 0]), np.full(3, 0.2))
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", np.pi / 2).as_matrix()
    turned[:3, 3] = 1, 0, 0
    shapes = shapes_of(
        [PlacedShape(egg, turned), PlacedShape(box, np.eye(4)), PlacedShape(box, turned)]
    )
    apart = [separations(shapes, 0, j, np.array([[STILL, STILL]]), np.inf)[0] for j in (1, 2)]
    assert apart[0] == pytest.approx(1 - EGG.bounds[1, 1] - 0.6, abs=1e-4)
    assert apart[1] == pytest.approx(0.4 - EGG.bounds[1, 0], abs=1e-4)
    ball = shapes_of([PlacedShape(Sphere(0.1), np.eye(4))])
    here, no_pairs, least = np.eye(3, 4)[None].copy(), np.zeros((0, 2), dtype=np.int64), np.empty(1)
    here[0, 0, 3] = 0.2
    clearances_of_each(ball, here, shapes, no_pairs, contacts_array(None), np.inf, 0.0, least)
    assert least == pytest.approx(0.1)
    clearances_of_each(ball, here, shapes, no_pairs, contacts_array(None), 0.05, 0.0, least)
    assert least == 0.05


def test_flat_triangles_and_single_ones_have_distances() -> None:
    """One that is a segment, one that is a point, and one alone."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0, 3, 0], [0.2, 0.2, 0.0]])
    for faces, expected in (([[0, 1, 2]], 0.5), ([[3, 3, 3]], 9.5**0.5), ([[0, 1, 4]], 0.5)):
        shapes = shapes_of(
            [
                PlacedShape(Mesh(points, np.array(faces)), np.eye(4)),
                PlacedShape(Mesh(points - [0, 0, 0.5], np.array([[2, 2, 2]])), np.eye(4)),
                PlacedShape(Sphere(0.0), np.eye(4)),
            ]
        )
        at = np.column_stack([np.eye(3), [0.5, 0, -0.5]])
        for j, pose in ((1, STILL), (2, at)):
            found = separations(shapes, 0, j, np.array([[STILL, pose]]), np.inf)[0]
            assert found == pytest.approx(expected, abs=2e-6)


def test_many_equal_triangles_make_a_tree() -> None:
    """With nothing to tell them apart by."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    pile = Mesh(np.tile(corners, (1000, 1)), np.arange(3000).reshape(-1, 3))
    shapes = shapes_of([PlacedShape(pile, np.eye(4)), PlacedShape(Sphere(0.1), np.eye(4))])
    at = np.column_stack([np.eye(3), [0.2, 0.2, 2]])
    assert separations(shapes, 0, 1, np.array([[STILL, at]]), np.inf)[0] == pytest.approx(
        1.9, abs=1e-6
    )


def test_any_number_of_meshes_is_prepared_once_and_let_go_with_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []

    class Counted(mesh.MeshQueries):
        def __init__(self, one: Mesh) -> None:
            made.append(weakref.ref(self))
            super().__init__(one)

    monkeypatch.setattr(mesh, "MeshQueries", Counted)
    gc.collect()
    known = len(mesh._known), len(mesh_tree._known)
    meshes = [Mesh(EGG.vertices * (2 + n / 100), EGG.faces) for n in range(20)]
    equal = Mesh(meshes[0].vertices, meshes[0].faces)
    for _ in range(3):
        for one in (*meshes, equal):
            mesh.queries(one).is_inside(np.zeros((1, 3)))
            shapes_of([PlacedShape(one, np.eye(4))])
    assert len(made) == 20
    assert len(mesh_tree._known) == known[1] + 20
    del meshes, one, equal
    gc.collect()
    assert (len(mesh._known), len(mesh_tree._known)) == known
    assert not any(ref() for ref in made)


def test_valid_means_apart_by_our_own_distance_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """FCL's word alone is not enough."""
    monkeypatch.setattr(CollisionModel, "_touches", lambda self, body: False)
    model = CollisionModel(PointRobot(0.1), [as_mesh(EGG), PlacedShape(Sphere(0.1), np.eye(4))])
    assert not model.is_valid(np.zeros(3))
    assert model.is_valid(np.ones(3))
