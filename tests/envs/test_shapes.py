"""What every kind of shape answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import fcl
import numpy as np
import pytest
import trimesh
from arms import at
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.collision.fcl_model import CollisionModel
from envs.collision.mesh import Containment
from envs.collision.primitive_sdf import nearest, scene_arrays
from envs.collision.shapes import (
    BOX,
    CYLINDER,
    MESH,
    POINT,
    SIZED,
    Box,
    Capsule,
    ConvexHull,
    Cylinder,
    Mesh,
    PlacedShape,
    SizedSolid,
    Solid,
    Sphere,
    Spheres,
    surface_points,
)
from envs.problem import Array
from envs.robots.point import PointRobot

_BLOCK = trimesh.creation.box((0.4, 0.6, 0.8))

SOLIDS: dict[str, Solid] = {
    "sphere": Sphere(0.3),
    "cylinder": Cylinder(0.2, 1.0),
    "capsule": Capsule(0.2, 1.0),
    "box": Box(np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.6, 0.8])),
    "mesh": Mesh(_BLOCK.vertices, _BLOCK.faces),
    "hull": ConvexHull.of_points(_BLOCK.vertices),
}

each_solid = pytest.mark.parametrize("solid", SOLIDS.values(), ids=SOLIDS)


def test_all_kinds_are_here() -> None:
    assert {solid.kind for solid in SOLIDS.values()} == {*SIZED, "mesh", "hull"}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("sphere", ["sphere", 0.3]),
        ("cylinder", ["cylinder", 0.2, 1.0]),
        ("capsule", ["capsule", 0.2, 1.0]),
        ("box", ["box", [0.1, -0.2, 0.3], [0.4, 0.6, 0.8]]),
        ("mesh", ["mesh", Mesh(_BLOCK.vertices, _BLOCK.faces).digest]),
    ],
)
def test_definitions_are_what_fingerprints_were_made_of(name: str, expected: list[Any]) -> None:
    assert SOLIDS[name].definition() == expected
    placed = PlacedShape(SOLIDS[name], at(1, 2, 3))
    assert placed.definition()[:-1] == expected
    assert placed.definition()[-1] == [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]]


@pytest.mark.parametrize(
    ("name", "center", "size", "radius", "core"),
    [
        ("sphere", [1, 2, 3], [0, 0, 0], 0.3, POINT),
        ("cylinder", [1, 2, 3], [0.2, 0.5, 0], 0, CYLINDER),
        ("capsule", [1, 2, 3], [0, 0, 0.5], 0.2, BOX),
        ("box", [1.2, 2.1, 3.3], [0.2, 0.3, 0.4], 0, BOX),
    ],
)
def test_rows_of_sized_solids(
    name: str, center: list[float], size: list[float], radius: float, core: float
) -> None:
    pose = at(1, 2, 3, 0, 0, np.pi / 2)
    row = SOLIDS[name].distance_row(pose)
    assert row[:9].reshape(3, 3) == pytest.approx(pose[:3, :3].T)
    assert row[9:12] == pytest.approx(center)
    assert row[12:15] == pytest.approx(size)
    assert row[15] == pytest.approx(np.linalg.norm(size) + radius)
    assert row[16:].tolist() == [core, radius]


def test_the_row_of_a_mesh_has_a_sphere_that_holds_it() -> None:
    row = SOLIDS["mesh"].distance_row(at(1, 2, 3))
    assert row[9:12] == pytest.approx([1, 2, 3])
    assert row[15] == pytest.approx(np.linalg.norm([0.2, 0.3, 0.4]))
    assert row[15] >= np.linalg.norm([0.2, 0.3, 0.4])
    assert row[16] == MESH


@each_solid
def test_surface_piece_points_and_bounding_sphere_agree(solid: Solid) -> None:
    surface = solid.triangulate()
    assert surface.is_watertight
    center, radius = solid.bounding_sphere()
    assert np.linalg.norm(surface.vertices - center, axis=1).max() <= radius + 1e-12
    points = solid.piece_points()
    assert points.shape == (1, 3)
    assert trimesh.proximity.signed_distance(surface, points)[0] >= -1e-9


@each_solid
@settings(max_examples=20, deadline=None)
@given(shift=st.tuples(*[st.floats(-5, 5)] * 3), rpy=st.tuples(*[st.floats(-3, 3)] * 3))
def test_fcl_has_it_where_its_surface_is(
    solid: Solid, shift: tuple[float, float, float], rpy: tuple[float, float, float]
) -> None:
    placed = PlacedShape(solid, at(*shift, *rpy))
    turn = placed.pose[:3, :3]
    middle = placed.pose[:3, 3] + (0 if solid.offset is None else turn @ solid.offset)
    body = fcl.CollisionObject(solid.fcl_geometry(), fcl.Transform(turn, middle))
    for vertex in placed.triangulate().vertices[:5]:
        probe = fcl.CollisionObject(fcl.Sphere(1e-3), fcl.Transform(vertex))
        assert fcl.collide(body, probe) > 0
    assert placed.piece_points() == pytest.approx(solid.piece_points() @ turn.T + shift, abs=1e-12)


@each_solid
def test_not_placed_it_is_where_its_frame_is_the_workspaces(solid: Solid) -> None:
    assert solid.solid is solid
    assert (solid.pose == np.eye(4)).all()
    with pytest.raises(ValueError, match="read-only"):
        solid.pose[0, 0] = 2
    placed = PlacedShape(solid, np.eye(4))
    assert (placed.triangulate().vertices == solid.triangulate().vertices).all()
    robot, q = PointRobot(0.1), np.array([0.9, 0.2, 0.4])
    clearances = [CollisionModel(robot, [one]).clearance(q) for one in (solid, placed)]
    assert clearances[0] == pytest.approx(clearances[1], abs=1e-6)


@dataclass(frozen=True)
class Cube(SizedSolid):
    """A kind of shape that nobody else knows."""

    kind: ClassVar[str] = "cube"
    sizes: ClassVar[Mapping[str, int]] = {"side": 1}

    side: float

    def _box(self) -> Box:
        return Box(np.zeros(3), np.full(3, self.side))

    def definition(self) -> list[Any]:
        return [self.kind, self.side]

    def bounding_sphere(self) -> tuple[Array, float]:
        return self._box().bounding_sphere()

    def sphere_cover(self, slack: float) -> Spheres:
        return self._box().sphere_cover(slack)

    def distance_row(self, pose: Array) -> Array:
        return self._box().distance_row(pose)

    def triangulate(self) -> trimesh.Trimesh:
        return self._box().triangulate()

    def fcl_geometry(self) -> Any:
        return self._box().fcl_geometry()


def test_a_new_kind_of_shape_is_one_class() -> None:
    cube = PlacedShape(Cube(2.0), at(3, 0, 0))
    model = CollisionModel(PointRobot(0.5), [cube])
    assert model.clearance(np.zeros(3)) == pytest.approx(1.5, abs=1e-6)
    assert not model.is_valid(np.array([2.0, 0, 0]))
    assert not Containment(PointRobot(0.5), [cube]).possible
    scene = scene_arrays([cube], np.zeros(3), np.ones(3))
    assert nearest(scene, 0.0, 0.0, 0.0, np.inf)[0] == pytest.approx(2.0)
    points = surface_points([cube], 50, seed=0)
    assert np.abs(points - [3, 0, 0]).max(axis=1) == pytest.approx(np.ones(50))
