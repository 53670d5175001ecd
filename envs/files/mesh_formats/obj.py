"""Wavefront OBJ."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from envs.files.mesh_formats.polygons import Polygons
from envs.files.mesh_formats.soup import Soup, UnreadableError, read_triangles

_FACE = re.compile(rb"^[ \t]*fo?[ \t]", re.MULTILINE)
_POLYGON = re.compile(rb"^[ \t]*fo?(?:[ \t]+[^\s#]+){4}", re.MULTILINE)
_RELATIVE = re.compile(rb"^[ \t]*fo?[ \t][^\n]*[ \t]-", re.MULTILINE)
_FREE_FORM = re.compile(rb"^[ \t]*(surf|curv2?)[ \t]", re.MULTILINE)


def read(path: Path) -> Soup:
    """Faces of any number of corners, also counted back from the last vertex; lines and points are
    passed over. The vertices of a file without faces are all there.

    Raises:
        UnreadableError: it has free-form surfaces, or faces without vertices.
    """
    data = path.read_bytes().replace(b"\r\n", b"\n").replace(b"\\\n", b" ")
    if free := _FREE_FORM.search(data):
        raise UnreadableError(
            f"free-form curves and surfaces ({free[1].decode()}) are not supported; export polygons"
        )
    if _FACE.search(data) is None:  # of which trimesh drops the vertices
        return _polygons(data.decode("utf-8", "replace")).cut()
    relative = _RELATIVE.search(data) is not None
    if not relative and _POLYGON.search(data) is None:
        return read_triangles(path)
    polygons = _polygons(data.decode("utf-8", "replace"))
    if not relative and polygons.are_fans():
        return read_triangles(path)
    return polygons.cut()


def _polygons(text: str) -> Polygons:
    vertices: list[list[str]] = []
    counts: list[int] = []
    corners: list[int] = []
    for line in text.split("\n"):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0] == "v":
            vertices.append(words[1:4])
        elif words[0] in ("f", "fo"):
            counts.append(len(words) - 1)
            for word in words[1:]:
                number = int(word.split("/")[0])
                corners.append(number - 1 if number > 0 else len(vertices) + number)
    if any(len(one) != 3 for one in vertices):
        raise UnreadableError("it has vertices of less than three coordinates")
    return Polygons(
        np.array(vertices, dtype=np.float64).reshape(-1, 3),
        np.array(counts, dtype=np.int64),
        np.array(corners, dtype=np.int64),
    )
