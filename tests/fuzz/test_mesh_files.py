"""Mesh files of text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from dae_files import dae, geometry, instance, node, polygons, polylist, triangles
from fuzzing import fuzzed
from mesh_files import PRISM, prism
from mutations import contents

from envs.files.assimp_mesh import read_as_assimp
from envs.files.mesh_file import FileMesh
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
