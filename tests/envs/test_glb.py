"""Binary glTF files as the specification means them, and what of it is refused."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from envs import InputError
from envs.files.mesh_file import FileMesh, read_mesh
from envs.files.mesh_formats.glb import read as read_glb


def read(tmp_path: Path, name: str, content: bytes) -> FileMesh:
    file = tmp_path / name
    file.write_bytes(content)
    return read_mesh(file)


def glb(
    content: dict[str, Any], *arrays: np.ndarray, more: list[dict[str, Any]] | None = None
) -> bytes:
    """A file with an accessor for each array, changed as `more` says, and what else is given."""
    binary, views, accessors = b"", [], []
    for array, changed in zip(arrays, more or [{}] * len(arrays), strict=True):
        data = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        views[-1].update(changed.get("view", {}))
        kind = {"f4": 5126, "i2": 5122, "u2": 5123, "u4": 5125, "i1": 5120, "u1": 5121}
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": kind[array.dtype.str[1:]],
                "count": len(array),
                "type": "VEC3" if array.ndim == 2 else "SCALAR",
                **changed.get("accessor", {}),
            }
        )
        binary += data + b"\0" * (-len(data) % 4)
    whole = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        **content,
    }
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    return head + chunks + struct.pack("<II", len(binary), 0x004E4942) + binary


CUBE = trimesh.creation.box((2, 2, 2))
CORNERS, FACES = CUBE.vertices.astype("<f4"), CUBE.faces.astype("<u2").reshape(-1)


def test_normalised_integers(tmp_path: Path) -> None:
    """By the specification 32767 stands for 1, and so does -32768 for -1."""
    corners = np.where(CORNERS > 0, 32767, -32768).astype("<i2")
    more: list[dict[str, Any]] = [{"accessor": {"normalized": True}}, {}]
    required = {"extensionsRequired": ["KHR_mesh_quantization", "KHR_materials_unlit"]}
    nodes = {"nodes": [{"mesh": 0, "scale": [4, 1, 1]}]}
    made = read(tmp_path, "a.glb", glb({**required, **nodes}, corners, FACES, more=more))
    assert np.ptp(made.vertices, axis=0).tolist() == [8, 2, 2]
    plain = read(tmp_path, "b.glb", glb(required, np.sign(CORNERS).astype("<i1"), FACES))
    assert np.ptp(plain.vertices, axis=0).tolist() == [2, 2, 2]


def test_sparse_values(tmp_path: Path) -> None:
    """Of an array that is there, and of none, which is all zeros."""
    at, values = np.arange(8, dtype="<u2"), CORNERS * 3
    sparse = {
        "count": 8,
        "indices": {"bufferView": 2, "componentType": 5123},
        "values": {"bufferView": 3},
    }
    more: list[dict[str, Any]] = [{"accessor": {"sparse": sparse}}, {}, {}, {}]
    content = glb({}, CORNERS, FACES, at, values, more=more)
    assert np.ptp(read(tmp_path, "a.glb", content).vertices, axis=0).tolist() == [6, 6, 6]
    bare = {"componentType": 5126, "count": 8, "type": "VEC3", "sparse": sparse}
    data = json.loads(content[20 : 20 + struct.unpack_from("<I", content, 12)[0]])
    data["accessors"][0] = bare
    content = glb({"accessors": data["accessors"]}, CORNERS, FACES, at, values)
    assert np.ptp(read(tmp_path, "b.glb", content).vertices, axis=0).tolist() == [6, 6, 6]


def test_strides(tmp_path: Path) -> None:
    with_normals = np.hstack([CORNERS, np.ones_like(CORNERS)])
    more: list[dict[str, Any]] = [{"view": {"byteStride": 24}}, {}]
    made = read(tmp_path, "a.glb", glb({}, with_normals, FACES, more=more))
    assert made.closed
    assert np.ptp(made.vertices, axis=0).tolist() == [2, 2, 2]


def test_nodes_turn_mirror_and_shear(tmp_path: Path) -> None:
    shear = np.eye(4)
    shear[0, 1], shear[:3, 3] = 0.5, (10, 0, 0)
    half = float(np.sqrt(0.5))
    nodes = [
        {"children": [1, 2], "translation": [0, 0, 5], "rotation": [0, 0, half, half]},
        {"mesh": 0, "scale": [-1, 2, 1], "camera": 0},
        {"mesh": 0, "matrix": shear.T.ravel().tolist()},
        {"mesh": 0, "translation": [99, 0, 0]},
    ]
    made = read(tmp_path, "a.glb", glb({"nodes": nodes}, CORNERS, FACES))
    assert (len(made.faces), made.closed, made.outward) == (24, True, True)
    assert trimesh.Trimesh(made.vertices, made.faces).volume == pytest.approx(16 + 8)
    assert made.vertices.min(axis=0) == pytest.approx([-2, -1, 4])
    assert made.vertices.max(axis=0) == pytest.approx([2, 11.5, 6])


def test_strips_fans_points_and_lines(tmp_path: Path) -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype="<f4")
    order = np.array([0, 1, 3, 2], dtype="<u1")
    primitives = [
        {"attributes": {"POSITION": 0}, "mode": 6},
        {"attributes": {"POSITION": 0}, "indices": 1, "mode": 5},
        {"attributes": {"POSITION": 0}, "mode": 0},
        {"attributes": {"POSITION": 0}, "indices": 1, "mode": 1},
    ]
    file = tmp_path / "a.glb"
    file.write_bytes(glb({"meshes": [{"primitives": primitives}]}, corners, order))
    made = read_glb(file)
    assert len(made.faces) == 4
    triangles = made.vertices[made.faces]
    up = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2]
    assert up == pytest.approx(1), "all alike"


MORPHED = {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}], "weights": [0, 0.5]}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "draco": (
        {"extensionsRequired": ["KHR_draco_mesh_compression"]},
        "requires the glTF extension 'KHR_draco_mesh_compression', which is not supported",
    ),
    "unheard of": (
        {"extensionsRequired": ["ACME_shape"]},
        "requires the glTF extension 'ACME_shape'",
    ),
    "instancing": (
        {"nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}}]},
        "EXT_mesh_gpu_instancing, which is not supported",
    ),
    "skin": ({"nodes": [{"mesh": 0, "skin": 0}]}, "a skin poses its mesh"),
    "morph": ({"meshes": [MORPHED]}, "morph targets shape its mesh"),
    "values from an extension": (
        {"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}] * 2},
        "an array without values",
    ),
    "cycle": (
        {"nodes": [{"mesh": 0, "children": [1]}, {"children": [0]}]},
        "node 0 is reached twice",
    ),
    "beyond": (
        {"bufferViews": [{"buffer": 0, "byteLength": 10**9}, {"buffer": 0, "byteLength": 72}]},
        "leaves its buffer",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_supported_is_named(name: str, tmp_path: Path) -> None:
    content, said = REFUSED[name]
    arrays = CORNERS, FACES
    if name == "beyond":
        content["accessors"] = [
            {"bufferView": 0, "componentType": 5126, "count": 10**7, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ]
    with pytest.raises(InputError, match=re.escape(said)):
        read(tmp_path, "a.glb", glb(content, *arrays))


@pytest.mark.slow
def test_many_instances_are_refused_before_they_are_made(tmp_path: Path) -> None:
    """A file of 1 MB that would be billions of faces."""
    count = 12_000
    corners = np.random.default_rng(0).random((60_000, 3)).astype("<f4")
    nodes = [{"mesh": 0} for _ in range(count)]
    scene = [{"nodes": list(range(count))}]
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
    file = tmp_path / "many.glb"
    file.write_bytes(glb({"nodes": nodes, "scenes": scene, "meshes": meshes}, corners))
    assert file.stat().st_size < 1.2e6
    code = (
        "import resource, sys\nfrom envs.files.mesh_file import read_mesh\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try:\n    read_mesh(sys.argv[1])\nexcept Exception as error:\n    print(error)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, check=True
    )
    said, used = done.stdout.splitlines()
    assert "more than 5000000 faces: simplify it" in said
    assert int(used) < 100_000 * (1024 if sys.platform == "darwin" else 1), "kilobytes"
