"""Bodies to move: some that problems are known by, made of boxes, and those of mesh files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from types import MappingProxyType

import numpy as np

from envs.collision.shapes import Box, Mesh, PlacedShape
from envs.errors import InputError, suggestion
from envs.files.mesh_file import FORMATS, read_mesh
from envs.problem import Array

_Boxes = Sequence[tuple[Sequence[float], Sequence[float]]]
"""The middle of each and its sides."""

NAMED: Mapping[str, _Boxes] = MappingProxyType(
    {
        "box": [([0, 0, 0], [1, 0.4, 0.2])],
        "l": [([0, -0.425, 0], [1, 0.15, 0.15]), ([-0.425, 0.075, 0], [0.15, 0.85, 0.15])],
        "cross": [
            ([0, 0, 0], [1, 0.15, 0.15]),
            ([0, 0, 0], [0.15, 1, 0.15]),
            ([0, 0, 0], [0.15, 0.15, 1]),
        ],
        # A grand piano from above: the keyboard along x, and the case, narrower at its far end.
        "piano": [
            ([0, -0.4, 0], [1, 0.2, 0.3]),
            ([-0.1, -0.05, 0], [0.8, 0.5, 0.3]),
            ([-0.25, 0.35, 0], [0.5, 0.3, 0.3]),
        ],
    }
)
"""Bodies by name, of boxes in their own frames; the longest side of each is 1."""


def body(name: str, size: float) -> list[PlacedShape]:
    """A named body, or that of a mesh file, about the middle of its bounding box.

    Args:
        name: one of `NAMED`, or a mesh file, whose surface must enclose something.
        size: its longest side, in workspace units; 0 for that of the file, or 1.

    Raises:
        InputError: there is no such body, or the file cannot be used.
    """
    if name in NAMED:
        factor = size or 1.0
        return [
            PlacedShape(Box(np.zeros(3), factor * np.array(sides)), _at(factor * np.array(middle)))
            for middle, sides in NAMED[name]
        ]
    if PurePath(name).suffix.lower() not in FORMATS:
        said = f"no body is called {name!r}; {suggestion(name, NAMED)}"
        raise InputError(f"{said}; or name a mesh file ({', '.join(FORMATS)})")
    read = read_mesh(name)
    if not read.closed:
        raise InputError(
            f"{name} is no body, as its surface is not closed ({read.holes}); mend it (trimesh and "
            "MeshLab can)"
        )
    low, high = read.vertices.min(axis=0), read.vertices.max(axis=0)
    factor = size / float((high - low).max()) if size else 1.0
    return [PlacedShape(Mesh((read.vertices - (low + high) / 2) * factor, read.faces), np.eye(4))]


def _at(place: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose
