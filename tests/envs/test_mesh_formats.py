"""Mesh files as they are meant: polygons, strips, extensions and numbers of every kind."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from dae_files import dae, geometry, polygons, polylist
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_files import PRISM, WALL, area, prism, read, refusal, volume

from envs import InputError
from envs.files.mesh_file import read_mesh
from envs.files.mesh_formats.polygons import Polygons, strips_to_triangles
from envs.problem import Array


def as_obj(vertices: Array, faces: list[list[int]]) -> bytes:
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in vertices]
    lines += ["f " + " ".join(f"{i + 1}/7/{i + 1}" for i in face) for face in faces]
    return "\n".join(lines).encode()


def as_relative_obj(vertices: Array, faces: list[list[int]]) -> bytes:
    """Each face after vertices of its own, counted back; lines that go on, and no last line end."""
    lines = ["o a", "g b"]
    for face in faces:
        lines += ["v " + " ".join(map(repr, map(float, vertices[i]))) for i in face]
        lines.append("f " + " \\\n ".join(str(k - len(face)) for k in range(len(face))))
        lines.append("l -1 -2")
    return "\r\n".join(lines).encode()


def as_off(vertices: Array, faces: list[list[int]]) -> bytes:
    lines = ["OFF # a comment", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(repr, map(float, v))) for v in vertices]
    lines += [" ".join(map(str, [len(f), *f])) for f in faces]
    return "\n".join(lines).encode()


def as_coloured_off(vertices: Array, faces: list[list[int]]) -> bytes:
    """Faces over several lines, colours behind them and behind vertices."""
    lines = [f"COFF {len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(repr, map(float, v))) + " 255 0 0 255" for v in vertices]
    for face in faces:
        lines += [f"{len(face)} {face[0]}", *map(str, face[1:-1]), f"{face[-1]} 0.1 0.2 0.3"]
    return "\n".join(lines).encode()


def ply_head(
    form: str, counts: tuple[int, ...], element: str = "face", float_: str = "double"
) -> bytes:
    return (
        f"ply\nformat {form} 1.0\ncomment a\nobj_info b\nelement vertex {counts[0]}\n"
        f"property {float_} x\nproperty {float_} y\nproperty {float_} z\nproperty uchar red\n"
        f"element {element} {counts[1]}\nproperty list uchar int vertex_indices\n"
        "property uchar flags\nend_header\n"
    ).encode()


def as_ascii_ply(vertices: Array, faces: list[list[int]]) -> bytes:
    lines = [" ".join(map(repr, map(float, v))) + " 9" for v in vertices]
    lines += [" ".join(map(str, [len(f), *f])) + " 1" for f in faces]
    return ply_head("ascii", (len(vertices), len(faces))) + "\n".join(lines).encode()


def as_binary_ply(vertices: Array, faces: list[list[int]], order: str = "<") -> bytes:
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    body = b"".join(struct.pack(order + "3dB", *v, 9) for v in vertices)
    body += b"".join(struct.pack(f"{order}B{len(f)}iB", len(f), *f, 1) for f in faces)
    return ply_head(form, (len(vertices), len(faces))) + body


def as_big_endian_ply(vertices: Array, faces: list[list[int]]) -> bytes:
    return as_binary_ply(vertices, faces, ">")


def as_dae(vertices: Array, faces: list[list[int]]) -> bytes:
    return dae(geometry(vertices, polylist(faces)))


def as_polygons_of_dae(vertices: Array, faces: list[list[int]]) -> bytes:
    return dae(geometry(vertices, polygons(faces)))


WRITERS = {
    "a.obj": as_obj,
    "relative.obj": as_relative_obj,
    "a.off": as_off,
    "coloured.off": as_coloured_off,
    "text.ply": as_ascii_ply,
    "binary.ply": as_binary_ply,
    "big.ply": as_big_endian_ply,
    "a.dae": as_dae,
    "polygons.dae": as_polygons_of_dae,
}


@pytest.mark.parametrize("name", WRITERS)
def test_polygons_are_not_left(name: str, tmp_path: Path) -> None:
    made = read(tmp_path, name, WRITERS[name](*prism(PRISM)))
    assert (made.closed, made.outward, made.dropped) == (True, True, 0)
    assert len(made.faces) == 2 * 6 + 2 * 8
    assert volume(made) == pytest.approx(10)
    assert area(made) == pytest.approx(2 * 10 + 22)


@pytest.mark.parametrize("name", WRITERS)
def test_a_doorway_stays_open(name: str, tmp_path: Path) -> None:
    wall = np.array([(x, 0.0, z) for x, z in WALL])
    made = read(tmp_path, name, WRITERS[name](wall, [list(range(8))]))
    assert area(made) == pytest.approx(13)
    middles = trimesh.Trimesh(made.vertices, made.faces).triangles_center
    assert not ((middles[:, 0] > 2) & (middles[:, 0] < 3) & (middles[:, 2] < 2)).any()


@pytest.mark.parametrize("name", WRITERS)
def test_corners_in_the_middle_of_sides_are_kept(name: str, tmp_path: Path) -> None:
    """Else the faces on the other side of the side would have no neighbour there."""
    vertices, faces = prism([(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)])
    made = read(tmp_path, name, WRITERS[name](vertices, faces))
    assert made.closed
    assert volume(made) == pytest.approx(4)


@pytest.mark.parametrize("name", ["a.obj", "a.off", "text.ply"])
def test_what_trimesh_reads_rightly_is_read_alike(name: str, tmp_path: Path) -> None:
    """To the order of faces, on which fingerprints depend."""
    vertices, faces = prism([(0, 0), (3, 0), (4, 2), (2, 4), (0, 3)])
    made = read(tmp_path, name, WRITERS[name](vertices, [*faces[2:], [1, 6, 5], [5, 6, 7]]))
    other = trimesh.load_mesh(tmp_path / name, process=False)
    assert (made.vertices[made.faces] == other.vertices[other.faces]).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(4, 12), st.integers(0, 2**32 - 1))
def test_stars_are_covered_once(corners: int, seed: int) -> None:
    """In any plane, begun at any corner."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    gaps = np.diff([*angle, angle[0] + 2 * np.pi])
    if gaps.max() > 3 or gaps.min() < 1e-3:
        return
    radius = rng.uniform(0.2, 1, corners)
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    points = flat @ turn.T + rng.normal(0, 10, 3)
    found = Polygons(points, np.array([corners]), np.arange(corners)).cut()
    triangles = found.vertices[found.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    along = normals @ turn[:, 2]
    wanted = (radius * np.roll(radius, -1) * np.sin(gaps)).sum() / 2
    assert len(found.faces) == corners - 2
    assert along.min() > -1e-9
    assert along.sum() == pytest.approx(wanted)


def test_polygons_that_are_not_flat_are_said(tmp_path: Path) -> None:
    bent = np.array([(0, 0, 0), (1, 0, 0.2), (1, 1, 0), (0, 1, 0.2)], dtype=float)
    made = read(tmp_path, "bent.obj", as_relative_obj(bent, [[0, 1, 2, 3]]))
    assert "1 polygons that are not flat are cut into triangles" in made.notes


@pytest.mark.parametrize("name", WRITERS)
def test_polygons_that_cross_themselves_are_refused(name: str, tmp_path: Path) -> None:
    bow = np.array([(0, 0, 0), (2, 1, 0), (2, 0, 0), (0, 2, 0)], dtype=float)
    assert "crosses itself" in refusal(tmp_path, name, WRITERS[name](bow, [[0, 1, 2, 3]]))


def test_free_forms_are_refused(tmp_path: Path) -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ncstype bspline\nsurf 0 1 0 1 1 2 3\n"
    assert "free-form curves and surfaces (surf)" in refusal(tmp_path, "nurbs.obj", content)


@pytest.mark.parametrize("content", [b"OFF BINARY\n\0\0", b"4OFF\n1 1 0\n", b"nOFF\n4\n1 1 0\n"])
def test_other_kinds_of_off_are_refused(content: bytes, tmp_path: Path) -> None:
    assert "is not supported" in refusal(tmp_path, "a.off", content)


@pytest.mark.parametrize("cut", [0.3, 0.7, 0.95])
@pytest.mark.parametrize("name", [n for n in WRITERS if not n.endswith("obj")])
def test_files_that_are_cut_short_are_refused(name: str, cut: float, tmp_path: Path) -> None:
    content = WRITERS[name](*prism(PRISM))
    assert "cannot be read as a mesh" in refusal(tmp_path, name, content[: int(len(content) * cut)])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_strips_of_triangles(form: str, tmp_path: Path) -> None:
    """A closed band of eight, and its ends, as two more."""
    vertices = np.array(
        [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1), (0, 1, 0), (0, 1, 1)]
    )
    strips = [0, 1, 2, 3, 4, 5, 6, 7, 0, 1, -1, 0, 2, 6, 4, -1, 1, 7, 3, 5]
    head = ply_head(form, (8, 1), element="tristrips", float_="float")
    if form == "ascii":
        body = "\n".join(f"{x} {y} {z} 1" for x, y, z in vertices)
        body += f"\n{len(strips)} {' '.join(map(str, strips))} 0\n"
        content = head + body.encode()
    else:
        order = "<" if "little" in form else ">"
        content = head + b"".join(struct.pack(order + "3fB", *v, 1) for v in vertices)
        content += struct.pack(f"{order}B{len(strips)}iB", len(strips), *strips, 0)
    made = read(tmp_path, "strips.ply", content)
    assert (len(made.faces), made.closed) == (12, True)
    assert abs(volume(made)) == pytest.approx(1)


def test_strips_turn_every_other_triangle() -> None:
    found = strips_to_triangles(np.array([0, 1, 2, 3, -1, 4, 5, 6, 7, -1, 8, 9, -1]))
    assert found.tolist() == [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]
    assert strips_to_triangles(np.array([1], dtype=np.int64)).shape == (0, 3)


FAR = np.array([500000.123, 4649776.22, 100.5])


@pytest.mark.parametrize("name", ["a.obj", "a.off", "text.ply", "binary.ply"])
def test_places_far_from_the_origin_stay_apart(name: str, tmp_path: Path) -> None:
    vertices, faces = prism(PRISM)
    made = read(tmp_path, name, WRITERS[name](vertices * 1e-2 + FAR, faces))
    assert (len(made.vertices), made.closed) == (16, True)
    assert np.ptp(made.vertices, axis=0) == pytest.approx([0.04, 0.04, 0.01], rel=1e-6)


def test_text_has_more_digits_than_its_type(tmp_path: Path) -> None:
    vertices, faces = prism(PRISM)
    content = as_ascii_ply(vertices * 0.1 + FAR, faces).replace(
        b"property double", b"property float"
    )
    made = read(tmp_path, "float.ply", content)
    assert (len(made.vertices), made.closed) == (16, True)
    assert volume(made) == pytest.approx(0.01, rel=1e-4)


@pytest.mark.parametrize("ending", ["stl", "ply", "glb"])
def test_32_bits_that_are_too_coarse_are_refused(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"far.{ending}"
    trimesh.creation.icosphere(radius=2).apply_translation(FAR).export(file)
    with pytest.raises(InputError, match=r"stored in 32 bits, where neighbours are 0\.5 apart"):
        read_mesh(file)


@pytest.mark.parametrize("ending", ["obj", "off", "stl", "glb", "dae"])
@pytest.mark.parametrize("size", [1e-7, 1e5])
def test_sizes_do_not_matter(ending: str, size: float, tmp_path: Path) -> None:
    file = tmp_path / f"ball.{ending}"
    ball = trimesh.creation.icosphere(subdivisions=2, radius=size)
    file.write_bytes(
        WRITERS[f"a.{ending}"](ball.vertices, ball.faces.tolist())
        if ending in ("obj", "off")
        else trimesh.exchange.export.export_mesh(ball, None, file_type=ending)
    )
    made = read_mesh(file)
    assert (len(made.vertices), len(made.faces), made.closed) == (162, 320, True)
