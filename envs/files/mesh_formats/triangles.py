"""Files of triangles, by trimesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from envs.files.mesh_formats.soup import EMPTY, Soup


class _Alone(dict[str, bytes]):
    """Where trimesh looks for files that a mesh names: none of them is opened."""

    def __missing__(self, name: str) -> bytes:
        raise ValueError(f"it wants another file, {name!r}; put what is needed into it")


def read_triangles(path: Path) -> Soup:
    """Reads what trimesh takes for triangles."""
    mesh = trimesh.load_mesh(path, resolver=_Alone(), process=False, skip_materials=True)
    if len(mesh.faces) == 0:
        return EMPTY
    return Soup(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, np.int64))
