"""Meshes of polygons, and what is read of mesh files, for tests of their formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from envs import InputError
from envs.files.mesh_file import FileMesh, read_mesh
from envs.problem import Array

PRISM = [(0, 0), (4, 0), (4, 4), (3, 4), (3, 1), (1, 1), (1, 4), (0, 4)]
"""A U, whose fans from any corner leave it."""

WALL = [(0, 0), (2, 0), (2, 2), (3, 2), (3, 0), (5, 0), (5, 3), (0, 3)]
"""With a doorway."""


def prism(outline: list[tuple[int, int]]) -> tuple[Array, list[list[int]]]:
    """Vertices and polygons of an outline (x, y), anticlockwise, one high."""
    n = len(outline)
    vertices = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in outline])
    sides = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    return vertices, [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


def read(tmp_path: Path, name: str, content: bytes) -> FileMesh:
    file = tmp_path / name
    file.write_bytes(content)
    return read_mesh(file)


def refusal(tmp_path: Path, name: str, content: bytes) -> str:
    with pytest.raises(InputError) as caught:
        read(tmp_path, name, content)
    assert name in str(caught.value)
    return str(caught.value)


def area(mesh: FileMesh) -> float:
    return float(trimesh.Trimesh(mesh.vertices, mesh.faces).area)


def volume(mesh: FileMesh) -> float:
    return float(trimesh.Trimesh(mesh.vertices, mesh.faces).volume)
