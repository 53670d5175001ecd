"""The Stanford bunny."""

from __future__ import annotations

import os
from pathlib import Path

from envs.files.fetched import fetch
from envs.files.mesh_file import read_mesh
from envs.files.paths import cache_folder
from envs.scenes.mesh_world import MeshWorld

URL = (
    "https://raw.githubusercontent.com/mikedh/trimesh/"
    "ec0cef4a74a21f78fd0a52490c036911a6df3190/models"
)
SHA256 = "8faa052bb08cf1625eec97b6508baceee11eec9cf28f83f6a9d4547ab15d7761"
_PLACE = Path("bunny") / "bunny.ply"


class Bunny(MeshWorld):
    """A point robot about the Stanford bunny, a solid whose holes at the bottom are closed.

    The mesh (Stanford 3D Scanning Repository, the reconstruction with 16,301 faces) is read from
    the folder that `BENCH_DATA` names, else from the user's cache, else it is fetched once.

    Args:
        robot_radius: in the mesh's unit, metres; 0 for `mesh_world.DEFAULT_RADIUS`.

    Raises:
        InputError: the mesh is not at hand and cannot be fetched, or an argument is out of range.
    """

    min_clearance = 0.4
    kind_of_problems = "bunny"

    def __init__(self, robot_radius: float = 0.0) -> None:
        read = read_mesh(bunny_file())
        self._build(read, "solid", robot_radius, 0.0, "bunny")


def bunny_file() -> Path:
    """Where the mesh is.

    Raises:
        InputError: it is not at hand and cannot be fetched.
    """
    data = os.environ.get("BENCH_DATA")
    if data and (Path(data) / _PLACE).is_file():
        return Path(data) / _PLACE
    folder = cache_folder() / "meshes"
    instead = f", or at {_PLACE} in a folder that BENCH_DATA names"
    fetch(folder, URL, {_PLACE.name: SHA256}, instead)
    return folder / _PLACE.name
