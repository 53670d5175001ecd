"""Collada files: the same meshes as in other formats, placed as Assimp (through coal) has them."""

from __future__ import annotations

import re
from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh
from bad_urdfs import with_shape
from dae_files import (
    INPUTS,
    dae,
    geometry,
    indices,
    instance,
    node,
    numbers,
    polygons,
    polylist,
    triangles,
)
from mesh_files import PRISM, prism, read, refusal, volume
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import envs
from envs import InputError
from envs.files.mesh_file import FileMesh, read_mesh
from envs.problem import Array
from envs.robots.urdf import read_urdf

VERTICES, FACES = prism(PRISM)
U = geometry(VERTICES, polylist(FACES))
ROOF = geometry(
    np.array([[0, 0, 1], [4, 0, 1], [4, 4, 1], [0, 4, 1], [2, 2, 3.0]]),
    triangles([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [2, 1, 0], [3, 2, 0]]),
    "roof",
)
"""A pyramid of volume 32 / 3 over the square that the U lies in."""


def by_assimp(file: Path) -> Array:
    """The vertices (n, 3) that coal's loader, which is Assimp's, finds, each once and in order."""
    found = coal.MeshLoader().load(str(file), np.ones(3)).vertices()
    return np.unique(np.round(np.array(found), 4), axis=0)


def in_order(mesh: FileMesh) -> Array:
    return np.unique(np.round(mesh.vertices, 4) + 0.0, axis=0)


def surface(mesh: FileMesh) -> Array:
    """Its triangles (m, 9), in an order that does not depend on how they are written."""
    corners = mesh.vertices[mesh.faces]
    first = np.lexsort(np.moveaxis(corners, 2, 0)[::-1], axis=1)[:, 0]
    turned = np.take_along_axis(corners, (first[:, None] + [0, 1, 2])[..., None] % 3, axis=1)
    return np.array(sorted(map(tuple, turned.reshape(-1, 9).tolist())))


@pytest.mark.parametrize("other", ["stl", "obj", "ply"])
def test_the_same_mesh_is_the_same_as_in_another_format(other: str, tmp_path: Path) -> None:
    """trimesh says Y_UP in whatever it writes."""
    egg = trimesh.creation.icosphere(subdivisions=2).apply_scale([0.25, 0.5, 1.0])
    egg.vertices = egg.vertices.astype(np.float32)
    for ending in ("dae", other):
        egg.export(tmp_path / f"egg.{ending}")
    ours, theirs = read_mesh(tmp_path / "egg.dae"), read_mesh(tmp_path / f"egg.{other}")
    assert surface(ours) == pytest.approx(surface(theirs), abs=1e-7)
    assert (ours.closed, ours.outward) == (theirs.closed, theirs.outward) == (True, True)


@pytest.mark.parametrize("axis", ["X_UP", "Y_UP", "Z_UP", ""])
def test_the_up_axis_is_not_applied_as_in_assimps_users(axis: str, tmp_path: Path) -> None:
    asset = f"<up_axis>{axis}</up_axis>" if axis else ""
    made = read(tmp_path, "u.dae", dae(U, asset=asset))
    assert in_order(made) == pytest.approx(np.unique(VERTICES, axis=0))
    assert in_order(made) == pytest.approx(by_assimp(tmp_path / "u.dae"))
    assert [("is not applied" in note) for note in made.notes] == [True] * (axis != "Z_UP")


@pytest.mark.parametrize("unit", [0.01, 0.0254, 1.0])
def test_the_unit_is_applied(unit: float, tmp_path: Path) -> None:
    asset = f'<unit name="any" meter="{unit}"/><up_axis>Z_UP</up_axis>'
    made = read(
        tmp_path, "u.dae", dae(U, node("<translate>1 0 0</translate>" + instance()), asset=asset)
    )
    low, high = made.vertices.min(axis=0), made.vertices.max(axis=0)
    assert low == pytest.approx([unit, 0, 0])
    assert high == pytest.approx([5 * unit, 4 * unit, unit])


def random_transform(rng: np.random.Generator) -> str:
    """Of all kinds, also mirrors."""
    kind = rng.integers(4)
    if kind == 0:
        return f"<translate>{numbers(rng.uniform(-2, 2, 3))}</translate>"
    if kind == 1:
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        return f"<rotate>{numbers([*axis, rng.uniform(-180, 180)])}</rotate>"
    if kind == 2:
        return f"<scale>{numbers(rng.choice([-1, 1], 3) * rng.uniform(0.5, 1.5, 3))}</scale>"
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.uniform(-2, 2, 3)
    return f"<matrix>{numbers(pose.ravel())}</matrix>"


@pytest.mark.parametrize("seed", range(12))
def test_nodes_and_instances_are_placed_as_assimp_does(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)

    def moves() -> str:
        return "".join(random_transform(rng) for _ in range(rng.integers(0, 4)))

    library = node(moves() + instance("roof") + node(moves() + instance()), "lib")
    nodes = (
        node(moves() + instance())
        + node(moves() + '<instance_node url="#lib"/>' + node(moves() + instance("roof")))
        + node(moves())
    )
    content = dae(U + ROOF, node(moves() + nodes), library)
    made = read(tmp_path, "all.dae", content)
    theirs = by_assimp(tmp_path / "all.dae")
    for some, others in ((made.vertices, theirs), (theirs, made.vertices)):
        assert KDTree(others).query(some)[0].max() < 2e-4


def test_mirrors_leave_faces_outward(tmp_path: Path) -> None:
    mirrored = node("<scale>1 1 -2</scale>" + instance("roof"))
    made = read(tmp_path, "roof.dae", dae(ROOF, mirrored))
    assert volume(made) == pytest.approx(2 * 32 / 3)


def test_geometries_are_taken_as_one_and_instances_as_often_as_they_are(tmp_path: Path) -> None:
    nodes = node(instance() + instance("roof")) + node("<translate>9 0 0</translate>" + instance())
    made = read(tmp_path, "all.dae", dae(U + ROOF, nodes))
    assert volume(made) == pytest.approx(2 * 10 + 32 / 3)
    assert len(read(tmp_path, "one.dae", dae(U + ROOF)).faces) == 28, "what has no instance is not"


def test_strips_fans_and_lines(tmp_path: Path) -> None:
    """A tetrahedron as a strip of two triangles and a fan of two, with a line beside it."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    inside = (
        f"<tristrips>{INPUTS}<p>{indices([0, 2, 1, 3])}</p></tristrips>"
        f"<trifans>{INPUTS}<p>{indices([0, 1, 3, 2])}</p></trifans>"
        f"<lines>{INPUTS}<p>{indices([0, 1])}</p></lines>"
    )
    made = read(tmp_path, "a.dae", dae(geometry(corners, inside)))
    assert (made.closed, len(made.faces)) == (True, 4)
    assert volume(made) == pytest.approx(1 / 6)


def test_strides_offsets_and_nameless_columns(tmp_path: Path) -> None:
    columns = np.column_stack([np.full(len(VERTICES), 7.0), VERTICES]).ravel().tolist()
    padded = (
        '<source id="g-positions"><float_array>9 9 ' + numbers(columns) + "</float_array>"
        f'<technique_common><accessor count="{len(VERTICES)}" stride="4" offset="2">'
        '<param type="float"/><param name="X"/><param name="Y"/><param name="Z"/>'
        "</accessor></technique_common></source>"
    )
    content = re.sub(rb'<source id="g-positions">.*?</source>', padded.encode(), dae(U))
    assert volume(read(tmp_path, "a.dae", content)) == pytest.approx(10)


def test_other_versions_and_files_without_a_namespace(tmp_path: Path) -> None:
    for namespace in (b"http://www.collada.org/2008/03/COLLADASchema", b""):
        content = dae(U).replace(b"http://www.collada.org/2005/11/COLLADASchema", namespace)
        content = content.replace(b'xmlns=""', b"")
        assert volume(read(tmp_path, "a.dae", content)) == pytest.approx(10)


def test_all_digits_count(tmp_path: Path) -> None:
    far = VERTICES * 1e-2 + [500000.123, 4649776.22, 100.5]
    made = read(tmp_path, "far.dae", dae(geometry(far, polygons(FACES))))
    assert (len(made.vertices), made.closed) == (16, True)


DOUBLING = "".join(
    f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
    for i in range(40)
) + node(instance(), "n40")
ENTITIES = (
    b'<!DOCTYPE a [<!ENTITY e0 "0 0 0 0 0 0 0 0 0 0 ">'
    + b"".join(b'<!ENTITY e%d "%s">' % (i + 1, b"&e%d;" % i * 10) for i in range(12))
    + b"]>"
)

REFUSED: dict[str, tuple[bytes, str]] = {
    "not closed": (b"<COLLADA>", "not well-formed XML"),
    "another root": (b"<robot/>", "no <COLLADA> but <'robot'>"),
    "empty": (b"<COLLADA/>", "which scene"),
    "no such scene": (dae(U).replace(b"#s", b"#t"), "no visual_scene 't'"),
    "no such geometry": (dae(U, node(instance("x"))), "no geometry 'x'"),
    "another file": (
        dae(U, node('<instance_node url="b.dae#x"/>')),
        "wants another file, 'b.dae#x'",
    ),
    "a skin": (dae(U, node('<instance_controller url="#c"/>')), "export it posed"),
    "look at": (dae(U, node("<lookat>0 0 0 1 1 1 0 0 1</lookat>" + instance())), "use <matrix>"),
    "short matrix": (dae(U, node("<matrix>1 0 0</matrix>" + instance())), "must hold 16 numbers"),
    "word in a matrix": (dae(U, node("<scale>a b c</scale>" + instance())), "could not convert"),
    "spline": (dae('<geometry id="g"><spline/></geometry>'), "a geometry of <spline>"),
    "no geometry at all": (dae(U, node("")), "holds no faces"),
    "holes": (
        dae(U.replace("</polylist>", "<ph><p>0 0</p><h>1 0</h></ph></polylist>")),
        "polygons with holes",
    ),
    "unknown primitive": (dae(U.replace("polylist", "trimesh")), "a <'trimesh'>, which is not"),
    "counts": (dae(U.replace("<vcount>8 ", "<vcount>7 ")), "corners, not as it says"),
    "negative counts": (dae(U.replace("<vcount>8 8", "<vcount>17 -1")), "not as it says"),
    "half a corner": (dae(U.replace("</p>", " 1</p>")), "indices of corners of 2 each"),
    "a corner nowhere": (dae(U.replace("<p>7", "<p>99")), "faces whose vertices are not there"),
    "a negative corner": (dae(U.replace("<p>7", "<p>-1")), "faces whose vertices are not there"),
    "fraction": (dae(U.replace("<p>7", "<p>1.5")), "cannot be read"),
    "NaN": (dae(U.replace("4.0", "nan")), "NaN or infinite"),
    "short array": (
        dae(U.replace('count="16" stride', 'count="17" stride')),
        "shorter than it says",
    ),
    "huge count": (dae(U.replace('count="16" stride', f'count="{10**18}" stride')), "shorter"),
    "huge stride": (dae(U.replace('stride="3"', f'stride="{10**18}"')), "shorter"),
    "no positions": (dae(U.replace('source="#g-positions"', 'source="#x"')), "without positions"),
    "no vertices": (dae(U.replace('"#g-vertices"', '"#x"')), "have no vertices 'x'"),
    "zero unit": (dae(U, asset='<unit meter="0"/>'), "its unit is 0.0 metres"),
    "NaN unit": (dae(U, asset='<unit meter="nan"/>'), "its unit is nan metres"),
    "word as unit": (dae(U, asset='<unit meter="inch"/>'), "could not convert"),
    "itself": (
        dae(U, node('<instance_node url="#a"/>'), node('<instance_node url="#a"/>', "a")),
        "for themselves",
    ),
    "doubling": (dae(U, node('<instance_node url="#n0"/>'), DOUBLING), "stand for more than"),
    "many faces": (
        dae(
            geometry(np.eye(3), triangles([[0, 1, 2]] * 3000)),
            node('<instance_node url="#n25"/>' * 20),
            DOUBLING,
        ),
        "has more than 5000000 faces",
    ),
    "entities": (
        dae(U)
        .replace(b"<COLLADA", ENTITIES + b"<COLLADA", 1)
        .replace(b"<vcount>8", b"<vcount>&e12;"),
        "not well-formed XML",
    ),
    "entity of a file": (
        dae(U)
        .replace(b"<COLLADA", b'<!DOCTYPE a [<!ENTITY e SYSTEM "/etc/passwd">]><COLLADA', 1)
        .replace(b"<vcount>8", b"<vcount>&e;"),
        "not well-formed XML",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, said = REFUSED[name]
    message = refusal(tmp_path, "a.dae", content)
    assert said in message
    assert "\n" not in message


def test_deep_nodes_are_read(tmp_path: Path) -> None:
    deep = "<node><translate>0.01 0 0</translate>" * 3000 + instance() + "</node>" * 3000
    made = read(tmp_path, "deep.dae", dae(U, deep))
    assert made.vertices.min(axis=0) == pytest.approx([30, 0, 0])


SEGMENT = trimesh.creation.box((0.06, 0.06, 0.3))


def test_a_link_of_dae_is_that_of_stl(tmp_path: Path) -> None:
    solids = []
    for ending in ("dae", "DAE", "stl"):
        (tmp_path / f"seg.{ending}").write_bytes(SEGMENT.export(file_type=ending.lower()))
        (tmp_path / "arm.urdf").write_text(with_shape(f'<mesh filename="seg.{ending}"/>'))
        solids.append(read_urdf(tmp_path / "arm.urdf")[1][-1].placed.solid)
    for solid in solids:
        assert solid.triangulate().bounds == pytest.approx(SEGMENT.bounds, abs=1e-7)
        assert solid.triangulate().volume == pytest.approx(SEGMENT.volume, rel=1e-6)


@pytest.mark.slow
def test_a_room_of_dae_is_a_world(tmp_path: Path) -> None:
    (tmp_path / "u.dae").write_bytes(dae(U))
    env = envs.make(f"mesh:file={tmp_path / 'u.dae'},robot_radius=0.1")
    assert len(env.sample_problems(3, 0)) == 3


def test_the_upper_case_ending_is_the_same(tmp_path: Path) -> None:
    assert volume(read(tmp_path, "u.DAE", dae(U))) == pytest.approx(10)
    with pytest.raises(InputError, match=r"read from .*\.dae"):
        read_mesh(tmp_path / "u.zae")
