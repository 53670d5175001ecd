"""Triangle meshes from files, checked and cleaned."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import igl
import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.grouping import unique_rows

from envs.collision.enclosure import Surface
from envs.collision.shapes import Mesh
from envs.collision.shells import Shells
from envs.errors import InputError
from envs.files.git_lfs import check_file_is_no_pointer
from envs.files.mesh_formats import dae, glb, obj, off, ply, stl
from envs.files.mesh_formats.soup import MOST_FACES, Soup
from envs.files.paths import exists
from envs.problem import Array

_READERS = {
    ".obj": obj.read,
    ".ply": ply.read,
    ".off": off.read,
    ".stl": stl.read,
    ".glb": glb.read,
    ".dae": dae.read,
}

FORMATS = tuple(_READERS)

_MOST_BYTES = 2**30  # text of about MOST_FACES

_SAME = 1e-8
"""In the mesh's unit, or at most 1e-5 of its extent: vertices that are nearer are one."""


@dataclass(frozen=True, eq=False)
class FileMesh:
    """A mesh in its file's own unit and frame; of Collada, which says its unit, in metres.

    Attributes:
        vertices: (n, 3), no two alike.
        faces: (m, 3), indices of vertices, none degenerate.
        dropped: degenerate faces that the file had besides.
        closed: whether each of its faces parts two cells of space, as of a watertight mesh.
        outward: whether its largest part is wound outward, or as often inward as outward; means
            nothing unless closed.
        holes: why it is not closed, in words; "" if it is.
        notes: what else whoever uses it should know, in words.
    """

    vertices: Array
    faces: NDArray[np.int64]
    dropped: int
    closed: bool
    outward: bool
    holes: str = ""
    notes: tuple[str, ...] = ()


def read_mesh(file: str | Path) -> FileMesh:
    """Reads an OBJ, PLY, OFF, STL, GLB or Collada file; all its meshes are taken as one.

    Vertices at the same place become one, and degenerate faces (no area) are dropped and counted.
    Faces of a connected part that are not wound alike are turned as most of its area is.

    Raises:
        InputError: there is no such file, or it holds no usable mesh.
    """
    soup = _read(file)
    if len(soup.faces) == 0:
        raise InputError(f"{file} holds no faces; a cloud of points has to be meshed first")
    if len(soup.faces) > MOST_FACES:
        raise InputError(f"{file} has {len(soup.faces)} faces, more than {MOST_FACES}: simplify it")
    return cleaned(soup, file)


def read_surface(file: str | Path) -> Soup:
    """Reads the triangles of a file that `read_mesh` takes as they are, for pictures.

    Raises:
        InputError: there is no such file, or it cannot be read.
    """
    return _read(file)


def read_points(file: str | Path) -> Array:
    """Reads the points (n, 3) of a file that `read_mesh` takes: those that its faces use or, of one
    without faces (OBJ, PLY, OFF), all of them.

    Raises:
        InputError: there is no such file, or it cannot be read.
    """
    soup = _read(file)
    return soup.vertices[np.unique(soup.faces)] if len(soup.faces) else soup.vertices


def _read(file: str | Path) -> Soup:
    path = Path(file)
    if path.suffix.lower() not in FORMATS:
        raise InputError(
            f"{file}: meshes are read from {', '.join(FORMATS)} files; convert it to .stl or .obj, "
            "minding its unit and up axis"
        )
    if not exists(path.is_file):
        raise InputError(f"no such file: {file}")
    check_file_is_no_pointer(path)
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{file} is empty")
    if size > _MOST_BYTES:
        raise InputError(f"{file} has {size} bytes; meshes of at most {_MOST_BYTES} are read")
    return _parsed(path)


def _parsed(path: Path) -> Soup:
    try:
        soup = _READERS[path.suffix.lower()](path)
        soup.check()
    except MemoryError as error:
        raise InputError(f"{path} is too large for this machine's memory") from error
    except Exception as error:  # parsers raise whatever they stumble on
        reason = str(error).split("\n")[0] or type(error).__name__
        raise InputError(f"{path} cannot be read as a mesh: {reason}") from error
    return soup


def cleaned(soup: Soup, file: str | Path) -> FileMesh:
    """The mesh of triangles that are usable, see `Soup.check`; `file` is what messages call it.

    Raises:
        InputError: none of them has an area.
    """
    vertices, faces = _merged(soup.vertices, soup.faces, file)
    mesh = trimesh.Trimesh(vertices / _unit(vertices), faces, process=False)
    mesh.update_faces(mesh.nondegenerate_faces())
    faces = np.array(mesh.faces, dtype=np.int64)
    if len(faces) == 0:
        raise InputError(f"{file} holds degenerate faces only")
    if not mesh.is_winding_consistent:
        faces = _wound_alike(faces, mesh.area_faces)
    used, renumbered = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], renumbered.reshape(-1, 3).astype(np.int64)
    surface = Surface(Mesh(vertices, faces))
    shells = surface.shells
    closed = shells.closed and surface.known
    return FileMesh(
        vertices,
        faces,
        len(soup.faces) - len(faces),
        closed=closed,
        outward=shells.largest_is_outward(vertices),
        holes="" if closed else _holes(shells, vertices),
        notes=soup.notes,
    )


def _unit(vertices: Array) -> float:
    """What `_SAME` is in, for vertices (n, 3)."""
    return min(float(np.ptp(vertices, axis=0).max()) * 1e-5 / _SAME, 1.0)


def _merged(
    vertices: Array, faces: NDArray[np.int64], file: str | Path
) -> tuple[Array, NDArray[np.int64]]:
    """The vertices that faces use, each place once, and the faces of these."""
    used, renumbered = np.unique(faces, return_inverse=True)
    vertices = vertices[used]
    if float(np.ptp(vertices, axis=0).max()) == 0:
        raise InputError(f"{file} has no extent: all its vertices are at one place")
    step = _SAME * _unit(vertices)
    low = vertices.min(axis=0) if np.abs(vertices).max() > 2.0**62 * step else 0.0
    places = np.round((vertices - low) / step).astype(np.int64)
    first, same = unique_rows(places, keep_order=True)  # type: ignore[no-untyped-call]
    return vertices[first], same[renumbered].reshape(-1, 3)


def _holes(shells: Shells, vertices: Array) -> str:
    if len(shells.open_edges) == 0:
        return "faces lie on one another in part, or have one side only"
    x, y, z = vertices[shells.open_edges[0]].mean(axis=0)
    return f"{len(shells.open_edges)} edges have one face, as at {x:.5g} {y:.5g} {z:.5g}"


def _wound_alike(faces: NDArray[np.int64], area: Array) -> NDArray[np.int64]:
    """Faces (m, 3) with each connected part's wound as the most of its area (m,) is: what is inside
    is told from winding numbers, which faces that are turned round spoil."""
    turned, part = igl.bfs_orient(faces)
    changed = (turned != faces).any(axis=1)
    mostly = np.bincount(part, area * changed) > np.bincount(part, area) / 2
    alike: NDArray[np.int64] = np.where((changed ^ mostly[part])[:, None], faces[:, ::-1], faces)
    return alike
