"""Mesh files."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import trimesh
from dae_files import dae, geometry, instance, node, polygons, polylist, triangles
from fuzzing import flipped, fuzzed
from hypothesis import strategies as st
from mesh_files import PRISM, prism
from mutations import contents

from envs.files.assimp_mesh import read_as_assimp
from envs.files.mesh_file import FileMesh, read_mesh
from envs.problem import Array

VERTICES, FACES = prism(PRISM)

COLLADA = (
    dae(
        geometry(VERTICES, polylist(FACES)),
        node("<translate>1 0 0</translate><rotate>0 0 1 30</rotate>" + instance())
        + node("<scale>1 2 -1</scale>" + node('<instance_node url="#n"/>')),
        node("<matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix>" + instance(), "n"),
        '<unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis>',
    ).decode(),
    dae(geometry(VERTICES, polygons(FACES[:2]) + triangles([[0, 1, 2], [3, 4, 5]]))).decode(),
)


def test_collada_meshes(tmp_path: Path) -> None:
    file = tmp_path / "mesh.dae"

    def parse(content: bytes) -> tuple[FileMesh, Array]:
        file.write_bytes(content or b" ")
        return read_as_assimp(file)

    def check(read: tuple[FileMesh, Array]) -> None:
        mesh, center = read
        assert np.isfinite(center).all()
        assert len(mesh.faces) > 0
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)

    fuzzed("Collada meshes", contents(COLLADA), parse, check)


PYRAMID = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\n"

TEXTS = {
    ".obj": PYRAMID + "f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3/1 4/2/1 5//1\nf -2 -5 -1\n",
    ".off": "OFF\n5 5 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n"
    "4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n",
    ".ply": "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
    "property double z\nelement face 5\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n",
    ".stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\n"
    "endloop\nendfacet\nendsolid a\n",
}


def check_mesh(mesh: FileMesh) -> None:
    assert len(mesh.faces) > 0
    assert np.isfinite(mesh.vertices).all()
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)
    assert mesh.closed == (mesh.holes == "")


def reader(folder: Path) -> Callable[[tuple[str, bytes]], FileMesh]:
    def parse(given: tuple[str, bytes]) -> FileMesh:
        ending, content = given
        file = folder / f"own{ending}"
        file.write_bytes(content or b" ")
        return read_mesh(file)

    return parse


def test_meshes_of_text(tmp_path: Path) -> None:
    likely, unlikely = zip(
        *(
            [kind.map(partial(named, ending)) for kind in contents([text])]
            for ending, text in TEXTS.items()
        ),
        strict=True,
    )
    fuzzed("meshes of text", [st.one_of(likely), st.one_of(unlikely)], reader(tmp_path), check_mesh)


def named(ending: str, content: bytes) -> tuple[str, bytes]:
    return ending, content


def test_meshes_of_bytes(tmp_path: Path) -> None:
    made = trimesh.creation.box((1, 2, 3))
    samples = []
    for ending in (".stl", ".ply", ".glb"):
        made.export(tmp_path / f"made{ending}")
        samples.append((ending, (tmp_path / f"made{ending}").read_bytes()))

    def changed(seed: bytes) -> tuple[str, bytes]:
        ending, content = random.Random(seed).choice(samples)
        return ending, flipped(seed[::-1], content)

    inputs = [st.binary(min_size=8, max_size=8).map(changed)]
    fuzzed("meshes of bytes", inputs, reader(tmp_path), check_mesh)
