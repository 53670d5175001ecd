"""What readers return, and the reader of files that trimesh takes for triangles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array

MOST_FACES = 5_000_000
"""More are refused: collision checking would want tens of GB."""

_FARTHEST = 1e12
"""Of a vertex's coordinates, whose squares and scaled ones shall not overflow."""

_COARSE = 1e-4
"""Of the extent, between neighbouring coordinates: half of it is the judge's tolerance in a cube of
side 20 that the mesh fills."""


class UnreadableError(ValueError):
    """A file does not hold what it should, or something that is not supported. One line."""


@dataclass(frozen=True, eq=False)
class Soup:
    """A mesh as its file has it.

    Attributes:
        vertices: (n, 3).
        faces: (m, 3), indices of vertices.
        notes: what its user should know, in words.
    """

    vertices: Array
    faces: NDArray[np.int64]
    notes: tuple[str, ...] = ()

    def check(self) -> None:
        """Raises UnreadableError unless its numbers are usable."""
        check_finite(self.vertices)
        check_corners(self.faces, self.vertices)


EMPTY = Soup(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


def joined(soups: list[Soup]) -> Soup:
    """All as one."""
    if not soups:
        return EMPTY
    before = np.cumsum([0, *(len(s.vertices) for s in soups[:-1])])
    return Soup(
        np.concatenate([s.vertices for s in soups]),
        np.concatenate([s.faces + n for s, n in zip(soups, before, strict=True)]),
        tuple(dict.fromkeys(note for s in soups for note in s.notes)),
    )


def moved(soup: Soup, pose: Array) -> Soup:
    """A mesh after a pose (4, 4); where that mirrors it, its faces are turned round."""
    if (pose == np.eye(4)).all():
        return soup
    faces = soup.faces[:, ::-1] if np.linalg.det(pose[:3, :3]) < 0 else soup.faces
    return Soup(soup.vertices @ pose[:3, :3].T + pose[:3, 3], faces, soup.notes)


def vertices_of_flat_faces(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """The vertices (k, 3) that renderers have of faces (m, 3) without normals of their own: each
    place once for each way that a face looks there."""
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    normals = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    # Faces in one plane shall have the same, and -0 is not 0 to whoever looks for the same rows.
    rounded = np.round(normals, 4).repeat(3, axis=0) + 0.0
    rows = np.unique(np.column_stack([corners.reshape(-1, 3), rounded]), axis=0)
    found: Array = rows[:, :3]
    return found


def check_finite(vertices: Array) -> None:
    """Raises UnreadableError unless all coordinates (n, 3) are numbers to reckon with."""
    if not (np.abs(vertices) <= _FARTHEST).all():
        raise UnreadableError(f"it has vertices that are NaN or infinite, or beyond {_FARTHEST:g}")


def check_corners(corners: NDArray[np.int64], vertices: Array) -> None:
    """Raises UnreadableError unless indices (any shape) are those of vertices (n, 3)."""
    if corners.size and not (corners.min() >= 0 and corners.max() < len(vertices)):
        raise UnreadableError("it has faces whose vertices are not there")


def is_coarse(vertices: Array) -> bool:
    """Whether coordinates (n, 3) of 32 bits are too far apart for the extent that they have."""
    most, extent = _size(vertices)
    return bool(np.isfinite(most) and _step(most) > _COARSE * extent > 0)


def check_not_coarse(vertices: Array) -> None:
    """Raises UnreadableError if coordinates (n, 3) that are stored in 32 bits are too coarse."""
    if is_coarse(vertices):
        most, extent = _size(vertices)
        raise UnreadableError(
            f"its coordinates of up to {most:.6g} are stored in 32 bits, where neighbours are "
            f"{_step(most):.2g} apart, too coarse for an extent of {extent:.3g}; move it to the "
            "origin before it is written, or write 64 bits or text"
        )


def _size(vertices: Array) -> tuple[float, float]:
    """The largest coordinate and the extent."""
    if len(vertices) == 0:
        return 0.0, 0.0
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    with np.errstate(invalid="ignore"):
        return float(np.abs([low, high]).max()), float((high - low).max())


def _step(value: float) -> float:
    return float(np.spacing(np.float32(min(value, float(np.finfo(np.float32).max) / 2))))


class _Alone(dict[str, bytes]):
    """Where trimesh looks for files that a mesh names: none of them is opened."""

    def __missing__(self, name: str) -> bytes:
        raise ValueError(f"it wants another file, {name!r}; put what is needed into it")


def read_triangles(path: Path) -> Soup:
    """Reads what trimesh takes for triangles."""
    import trimesh  # half a second, which readers of other formats can save

    mesh = trimesh.load_mesh(path, resolver=_Alone(), process=False, skip_materials=True)
    if len(mesh.faces) == 0:
        return EMPTY
    return Soup(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, np.int64))
