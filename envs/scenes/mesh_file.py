"""Triangle meshes from files, checked and cleaned."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray

from envs.errors import InputError
from envs.presence import is_there
from envs.problem import Array

logger = logging.getLogger(__name__)

FORMATS = (".obj", ".ply", ".off", ".stl", ".glb")

_FARTHEST = 1e12  # of a vertex's coordinates, whose squares and scaled ones shall not overflow

_MOST_BYTES = 2**30  # text of about MOST_FACES

MOST_FACES = 5_000_000
"""More are refused: collision checking would want tens of GB."""


@dataclass(frozen=True, eq=False)
class FileMesh:
    """A mesh in its file's own unit and frame.

    Attributes:
        vertices: (n, 3), no two alike.
        faces: (m, 3), indices of vertices, none degenerate.
        dropped: degenerate faces that the file had besides.
        closed: whether it is watertight, its faces wound alike.
        outward: whether its faces are wound outward; means nothing unless closed.
    """

    vertices: Array
    faces: NDArray[np.int64]
    dropped: int
    closed: bool
    outward: bool


def read_mesh(file: str | Path) -> FileMesh:
    """Reads an OBJ, PLY, OFF, STL or GLB file; all its meshes are taken as one.

    Vertices at the same place become one, and degenerate faces (no area) are dropped and counted.
    Faces of a connected part that are not wound alike are turned as most of its area is.

    Raises:
        InputError: there is no such file, or it holds no usable mesh.
    """
    path = Path(file)
    if path.suffix.lower() not in FORMATS:
        raise InputError(
            f"{file}: meshes are read from {', '.join(FORMATS)} files; convert it to .stl or .obj, "
            "minding its unit and up axis"
        )
    if not is_there(path.is_file):
        raise InputError(f"no such file: {file}")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{file} is empty")
    if size > _MOST_BYTES:
        raise InputError(f"{file} has {size} bytes; meshes of at most {_MOST_BYTES} are read")
    mesh = _parsed(path)
    if len(mesh.faces) == 0:
        raise InputError(f"{file} holds no faces; a cloud of points has to be meshed first")
    if len(mesh.faces) > MOST_FACES:
        raise InputError(f"{file} has {len(mesh.faces)} faces, more than {MOST_FACES}: simplify it")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise InputError(f"{file} has faces whose vertices are not there")
    if not (np.abs(mesh.vertices) <= _FARTHEST).all():
        raise InputError(f"{file} has vertices that are NaN or infinite, or beyond {_FARTHEST:g}")
    return _cleaned(mesh, file)


class _Alone(dict[str, bytes]):
    """Where trimesh looks for files that a mesh names: none of them is opened."""

    def __missing__(self, name: str) -> bytes:
        raise ValueError(f"it wants another file, {name!r}; put what is needed into it")


def _parsed(path: Path) -> trimesh.Trimesh:
    try:
        return trimesh.load_mesh(path, resolver=_Alone(), process=False, skip_materials=True)
    except MemoryError as error:
        raise InputError(f"{path} is too large for this machine's memory") from error
    except Exception as error:  # the parsers of other formats raise whatever they stumble on
        reason = str(error).split("\n")[0] or type(error).__name__
        raise InputError(f"{path} cannot be read as a mesh: {reason}") from error


def _cleaned(mesh: trimesh.Trimesh, file: str | Path) -> FileMesh:
    before = len(mesh.faces)
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    if float(np.ptp(mesh.vertices, axis=0).max()) == 0:
        raise InputError(f"{file} has no extent: all its vertices are at one place")
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) == 0:
        raise InputError(f"{file} holds degenerate faces only")
    if not mesh.is_winding_consistent:
        faces = _wound_alike(np.array(mesh.faces, dtype=np.int64), mesh.area_faces)
        mesh = trimesh.Trimesh(mesh.vertices, faces, process=False)
    return FileMesh(
        np.asarray(mesh.vertices, dtype=np.float64),
        np.asarray(mesh.faces, dtype=np.int64),
        before - len(mesh.faces),
        closed=bool(mesh.is_watertight and mesh.is_winding_consistent),
        outward=bool(np.linalg.det(mesh.triangles).sum() > 0),  # six times the volume
    )


def _wound_alike(faces: NDArray[np.int64], area: Array) -> NDArray[np.int64]:
    """Faces (m, 3) with each connected part's wound as the most of its area (m,) is: what is inside
    is told from winding numbers, which faces that are turned round spoil."""
    turned, part = igl.bfs_orient(faces)
    changed = (turned != faces).any(axis=1)
    mostly = np.bincount(part, area * changed) > np.bincount(part, area) / 2
    alike: NDArray[np.int64] = np.where((changed ^ mostly[part])[:, None], faces[:, ::-1], faces)
    return alike
