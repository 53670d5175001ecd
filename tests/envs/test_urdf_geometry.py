"""Shapes of URDF links: capsules, mirrored meshes, several to a link, and what is drawn taken for
what collides."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import coal
import numpy as np
import pinocchio
import pytest
import trimesh
from bad_urdfs import BALL, collision, joint, link, robot, with_shape

import envs
from envs import InputError
from envs.collision.mesh import queries
from envs.collision.shapes import Box, Capsule, ConvexHull, Mesh, Solid, Sphere
from envs.errors import tell_once
from envs.robots.arm import Part
from envs.robots.urdf import read_urdf

A, B = link("a", ""), link("b")
AB = joint("ab", "a", "b")


def visual(shape: str, origin: str = "") -> str:
    return collision(shape, origin).replace("collision", "visual")


def parts_of(folder: Path, text: str, geometry: str = "collision") -> tuple[Part, ...]:
    (folder / "arm.urdf").write_text(text)
    return read_urdf(folder / "arm.urdf", geometry=geometry)[1]


def solid_of(folder: Path, shape: str) -> Solid:
    return parts_of(folder, with_shape(shape))[-1].placed.solid


def test_a_capsule_is_as_long_as_pinocchio_has_it(tmp_path: Path) -> None:
    """From tip to tip: its length and twice its radius. Its parser has no <capsule> in all versions
    of urdfdom, but takes cylinders for capsules where told."""
    assert solid_of(tmp_path, '<capsule radius="0.05" length="0.3"/>') == Capsule(0.05, 0.3)
    told = '<collision_checking><capsule name="b_0"/></collision_checking>'
    cylinder = collision('<cylinder radius="0.05" length="0.3"/>')
    named = cylinder.replace("<collision>", '<collision name="b_0">')
    file = tmp_path / "arm.urdf"
    file.write_text(robot(A, link("b", told + named), AB))
    kind = pinocchio.GeometryType.COLLISION
    model = pinocchio.buildModelFromUrdf(str(file))
    (theirs,) = pinocchio.buildGeomFromUrdf(model, str(file), kind).geometryObjects
    assert isinstance(theirs.geometry, coal.Capsule)
    theirs.geometry.computeLocalAABB()
    assert theirs.geometry.aabb_local.max_ == pytest.approx([0.05, 0.05, 0.2])
    assert Capsule(0.05, 0.3).triangulate().bounds[1] == pytest.approx([0.05, 0.05, 0.2])
    assert Capsule(0.05, 0.3).bounding_sphere()[1] == pytest.approx(0.2)


def test_several_shapes_of_a_link_are_all_of_it(tmp_path: Path) -> None:
    shapes = (
        collision('<box size="1 2 3"/>', '<origin xyz="1 0 0" rpy="0 0 1.5"/>')
        + visual("<anything/>")
        + collision('<sphere radius="0.1"/>')
        + collision('<capsule radius="0.1" length="0.2"/>', '<origin rpy="1 0 0"/>')
    )
    parts = parts_of(tmp_path, robot(A, link("b", shapes), AB))
    assert [type(part.placed.solid) for part in parts] == [Box, Sphere, Capsule]
    assert {part.link for part in parts} == {"b"}
    expected = trimesh.transformations.euler_matrix(0, 0, 1.5)
    expected[0, 3] = 1
    assert parts[0].placed.pose == pytest.approx(expected, abs=1e-15)


MIRRORS = ["1 1 -1", "-1 1 1", "-2 -1 -0.5", "-1", "-1 -1 1", "1 1 1"]


def _corner(holes: bool) -> trimesh.Trimesh:
    """Off its middle, and not its own mirror image."""
    outline = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]]) / 10
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    corner = trimesh.creation.extrude_triangulation(outline, faces, height=0.4)
    if holes:
        corner.update_faces(corner.face_normals[:, 2] < 0.5)
    return corner


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("scale", MIRRORS)
def test_mirrored_meshes_keep_what_is_inside(scale: str, holes: bool, tmp_path: Path) -> None:
    corner = _corner(holes)
    corner.export(tmp_path / "corner.ply")
    solid = solid_of(tmp_path, f'<mesh filename="corner.ply" scale="{scale}"/>')
    assert isinstance(solid, Mesh)
    factors = np.array([float(word) for word in scale.split()]) * np.ones(3)
    # trimesh turns faces round itself where it scales by a mirror.
    expected = corner.copy().apply_transform(np.diag([*factors, 1]))
    if not holes:
        assert solid.triangulate().volume == pytest.approx(
            _corner(False).volume * abs(factors.prod())
        )
    assert solid.triangulate().face_normals.sum(axis=0) == pytest.approx(
        expected.face_normals.sum(axis=0), abs=1e-6
    )
    inside = np.array([[0.05, 0.05, 0.1], [0.25, 0.05, 0.2], [0.05, 0.15, 0.3]]) * factors
    outside = np.array([[0.2, 0.15, 0.1], [-0.05, 0.05, 0.1], [0.05, 0.05, -0.1]]) * factors
    assert queries(solid).is_inside(inside).all()
    assert not queries(solid).is_inside(outside).any()


DRAWN = robot(
    link("a", ""),
    link("b", BALL + visual('<box size="0.2 0.2 0.4"/>', '<origin xyz="0 0 0.2"/>')),
    link("c", visual('<capsule radius="0.05" length="0.2"/>')),
    link("d", visual('<cylinder radius="0.05" length="0.2"/>')),
    AB,
    joint("bc", "b", "c"),
    joint("cd", "c", "d", "fixed", ""),
)


@pytest.fixture
def told(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    tell_once.cache_clear()
    with caplog.at_level(logging.INFO):
        yield caplog


def test_links_that_are_only_drawn_collide_with_nothing_which_is_said_once(
    tmp_path: Path, told: pytest.LogCaptureFixture
) -> None:
    for _ in range(2):
        assert [part.link for part in parts_of(tmp_path, DRAWN)] == ["b"]
    (record,) = told.records
    assert record.getMessage() == (
        f"{tmp_path / 'arm.urdf'}: links with visual but no collision geometry collide with "
        "nothing, unless with geometry=visual: 'c', 'd'"
    )


def test_nothing_is_said_where_all_links_have_collision_geometry_or_none_at_all(
    tmp_path: Path, told: pytest.LogCaptureFixture
) -> None:
    parts_of(tmp_path, robot(A, link("b", BALL + visual("<x/>")), AB))
    assert not told.records


def test_what_is_drawn_collides_if_asked(tmp_path: Path, told: pytest.LogCaptureFixture) -> None:
    parts = parts_of(tmp_path, DRAWN, "visual")
    assert [part.link for part in parts] == ["b", "c", "d"]
    assert isinstance(parts[0].placed.solid, Box)
    assert parts[0].placed.pose[2, 3] == 0.2
    assert parts[1].placed.solid == Capsule(0.05, 0.2)
    assert not told.records


def test_links_that_are_not_drawn_are_said_where_that_counts(
    tmp_path: Path, told: pytest.LogCaptureFixture
) -> None:
    text = robot(
        A, link("b", visual('<sphere radius="0.1"/>')), link("c"), AB, joint("bc", "b", "c")
    )
    assert [part.link for part in parts_of(tmp_path, text, "visual")] == ["b"]
    (record,) = told.records
    assert "links with collision but no visual geometry collide with nothing" in record.getMessage()
    assert record.getMessage().endswith("unless with geometry=collision: 'c'")


def test_what_does_not_collide_may_be_anything(tmp_path: Path) -> None:
    odd = '<collision><origin xyz="x"/><geometry><capsule/></geometry></collision>'
    text = robot(A, link("b", odd + visual('<sphere radius="0.1"/>')), AB)
    assert len(parts_of(tmp_path, text, "visual")) == 1
    with pytest.raises(InputError, match=r"link 'b': xyz='x' must hold 3 finite numbers"):
        parts_of(tmp_path, text)


def test_the_arm_environment_takes_either_geometry(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(DRAWN)
    geometries = ("", "geometry=collision,", "geometry=visual,")
    entries = [envs.REGISTRY.entry(f"arm:{one}urdf={file}") for one in geometries]
    expected = [f"arm:{one}urdf={file}" for one in ("", "", "geometry=visual,")]
    assert [entry.id for entry in entries] == expected
    by_default, stated, drawn = (entry.make() for entry in entries)
    assert [len(env.robot.shapes) for env in (by_default, stated, drawn)] == [1, 1, 3]
    assert by_default.fingerprint == stated.fingerprint != drawn.fingerprint


def test_another_geometry_is_refused_with_the_nearest(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(DRAWN)
    with pytest.raises(InputError, match=r"unknown geometry 'visuals'; did you mean 'visual'\?"):
        envs.make(f"arm:urdf={file},geometry=visuals")


def test_a_robot_that_is_only_drawn_is_told_how_to_collide(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="or take those it has: geometry=visual"):
        parts_of(tmp_path, robot(A, link("b", visual('<sphere radius="0.1"/>')), AB))
    with pytest.raises(InputError, match="or take those it has: geometry=collision"):
        parts_of(tmp_path, robot(A, link("b", BALL), AB), "visual")


@pytest.mark.parametrize("scale", ["1", "0.1", "-1 2 1"])
def test_the_hull_is_meant_of_a_mesh_that_is_declared_convex(scale: str, tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.1, 0.3, 0.2, sections=16)
    ring.export(tmp_path / "ring.stl")
    declared = f'<mesh filename="ring.stl" scale="{scale}"><drake:declare_convex/></mesh>'
    solid = solid_of(tmp_path, declared)
    assert isinstance(solid, ConvexHull)
    factors = np.array([float(word) for word in scale.split()]) * np.ones(3)
    assert solid.triangulate().volume == pytest.approx(
        ring.convex_hull.volume * abs(factors.prod()), rel=1e-6
    )
    assert type(solid_of(tmp_path, '<mesh filename="ring.stl"/>')) is Mesh


def test_a_flat_mesh_that_is_declared_convex_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nf 1 2 3\nf 2 3 4\n")
    with pytest.raises(InputError, match="link 'b': a hull's points must not all lie in one plane"):
        solid_of(tmp_path, '<mesh filename="flat.obj"><drake:declare_convex/></mesh>')
