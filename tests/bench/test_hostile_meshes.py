"""Meshes that nobody should load, through the command line: one line, and nothing else is opened,
changed or made."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh
from bad_meshes import BAD
from conftest import Refused

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def refusal(refused: Refused, file: Path) -> str:
    return refused(
        *("run", "--env", f"mesh:file={file}", "--planners", "rrtconnect"),
        *("--problems", 1, "--out", "run"),
    )


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    content, said = BAD[name]
    file = tmp_path / name
    file.write_bytes(content)
    assert said in refusal(refused, file)
    assert file.read_bytes() == content


def binary_ply(vertices: int, faces: int, body: bytes = b"abcd") -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + body


def glb(json: bytes, length: int) -> bytes:
    return struct.pack("<4sIIII", b"glTF", 2, length, len(json), 0x4E4F534A) + json


OUTSIDE = (
    b'{"asset":{"version":"2.0"},"buffers":[{"uri":"../../secret.bin","byteLength":36}],'
    b'"bufferViews":[{"buffer":0,"byteLength":36}],'
    b'"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],'
    b'"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],'
    b'"scenes":[{"nodes":[0]}],"scene":0}'
)


def binary_face(*corners: int) -> bytes:
    """A triangle's vertices, and a face of these corners."""
    return struct.pack("<9fB3i", 0, 0, 0, 1, 0, 0, 0, 1, 0, 3, *corners)


HOSTILE: dict[str, bytes] = {
    "a corner nowhere.ply": binary_ply(3, 1, binary_face(0, 1, 9)),
    "a negative corner.ply": binary_ply(3, 1, binary_face(0, 1, -1)),
    "four billion vertices.ply": binary_ply(2**32 - 1, 1),
    "four billion faces.ply": binary_ply(3, 2**32 - 1),
    "a number of 5000 digits.ply": binary_ply(int("9" * 4000), 1),
    "negative.ply": binary_ply(-3, -1),
    "four billion triangles.stl": bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50),
    "cut off.stl": bytes(80) + struct.pack("<I", 3) + bytes(70),
    "four billion.off": b"OFF\n4294967295 4294967295 0\n0 0 0\n",
    "huge.obj": b"v 1e308 0 0\nv 0 1e308 0\nv 0 0 1e308\nf 1 2 3\n",
    "no index.obj": b"v 0 0 0\nf 1 2 99999999999999999999\n",
    "overlong.glb": glb(b"{}  ", 2**32 - 1),
    "elsewhere.glb": glb(OUTSIDE + b" " * (-len(OUTSIDE) % 4), 1000),
    "nested.glb": glb(b"[" * 40_000, 40_020),
    "null.ply": bytes(4096),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_meshes_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    file = tmp_path / name
    file.write_bytes(HOSTILE[name])
    said = refusal(refused, file)
    assert name in said
    assert len(said) < 1200
    assert file.read_bytes() == HOSTILE[name]


def test_10_gb_are_not_read(tmp_path: Path, refused: Refused) -> None:
    file = tmp_path / "mesh.obj"
    file.touch()
    os.truncate(file, 10 * 2**30)  # takes no room on disk
    assert "meshes of at most" in refusal(refused, file)


@pytest.mark.parametrize("name", ["../secret.bin", "beside.bin", "pipe"])
def test_numbers_in_other_files_are_not_read(name: str, tmp_path: Path, refused: Refused) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    for other in (tmp_path / "secret.bin", inside / "beside.bin"):
        other.write_bytes(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))
    os.mkfifo(inside / "pipe")
    file = inside / "mesh.glb"
    json = OUTSIDE.replace(b"../../secret.bin", name.encode())
    file.write_bytes(glb(json + b" " * (-len(json) % 4), 1000))
    assert f"wants another file, '{name}'" in refusal(refused, file)


def pipe(file: Path) -> None:
    os.mkfifo(file)


def folder(file: Path) -> None:
    file.mkdir()


def endless(file: Path) -> None:
    file.symlink_to("/dev/zero")


def loop(file: Path) -> None:
    file.symlink_to(file)


@pytest.mark.parametrize("make", [pipe, folder, endless, loop])
def test_what_is_no_file_is_not_waited_for(
    make: Callable[[Path], None], tmp_path: Path, refused: Refused
) -> None:
    make(tmp_path / "mesh.ply")
    assert "no such file" in refusal(refused, tmp_path / "mesh.ply")


@pytest.mark.parametrize("name", ["x\0.ply", "a" * 5000 + ".ply", "../" * 500 + "nothing.ply"])
def test_odd_names_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    assert "no such file" in refusal(refused, tmp_path / name)


def test_materials_in_other_files_are_not_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor is it an error to name some: the shape is all that counts."""
    from envs.files.mesh_file import read_mesh

    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl a\nmap_Kd ../secret.png\n")
    (inside / "beside.mtl").write_text("newmtl a\nmap_Kd http://localhost:9/x.png\n")
    file = inside / "mesh.obj"
    file.write_text(f"mtllib ../secret.mtl\nmtllib beside.mtl\nusemtl a\n{TRIANGLE}")
    opened: list[object] = []

    def get(self: object, name: object) -> bytes:
        opened.append(name)
        return b""

    monkeypatch.setattr(trimesh.resolvers.FilePathResolver, "get", get)
    assert len(read_mesh(file).faces) == 1
    assert not opened
