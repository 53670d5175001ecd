"""Occupancy grids from files, each format by its reader."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from envs.errors import InputError, suggestion
from envs.files.git_lfs import check_file_is_no_pointer
from envs.files.map_formats.cells import FREE, OCCUPIED, Cells, Reader
from envs.files.map_formats.moving_ai import Scenarios, read_scenarios
from envs.files.paths import exists

_READERS = {
    ".yaml": "ros_map:read",
    ".yml": "ros_map:read",
    ".pgm": "image:read",
    ".png": "image:read",
    ".bmp": "image:read",
    ".npy": "array:read",
    ".map": "moving_ai:read_map",
    ".3dmap": "moving_ai:read_voxels",
}
"""Modules of `map_formats` and their functions, by how files' names end."""

_PROBLEMS = {".scen": ".map", ".3dscen": ".3dmap"}
"""How names of files with problems end, and those of the maps they are on."""


def read_map(file: str, unknown: str = OCCUPIED) -> Cells:
    """Reads an occupancy grid.

    Args:
        file: YAML of ROS, PGM, PNG, BMP, NPY, or Moving AI's `.map` and `.3dmap`.
        unknown: "occupied" or "free", what cells count as of which it is not known.

    Raises:
        InputError: there is no such file, or it holds no map with free and occupied cells.
    """
    if unknown not in (FREE, OCCUPIED):
        raise InputError(
            f"unknown must be {OCCUPIED!r} or {FREE!r}, what cells count as of which it is not "
            f"known, not {unknown!r}"
        )
    path = _existing(file)
    ending = path.suffix.lower()
    if ending not in _READERS:
        raise InputError(f"{file}: no map's name ends so; {suggestion(ending, _READERS)}")
    module, _, function = _READERS[ending].partition(":")
    reader: Reader = getattr(import_module(f"envs.files.map_formats.{module}"), function)
    cells = reader(path, unknown)
    uncertain = f", of which {cells.unknown:.0%} are not known" if cells.unknown else ""
    if cells.occupied.all():
        raise InputError(f"{file}: all cells are occupied{uncertain}; there is no free space")
    if not cells.occupied.any():
        raise InputError(
            f"{file}: no cell is occupied{uncertain}; every straight line would be free"
        )
    return cells


def read_problems(file: str, map_file: str, cells: Cells) -> Scenarios:
    """Reads the problems of Moving AI on a map.

    Raises:
        InputError: there is no such file, or it is not of that map.
    """
    path, of_map = _existing(file), Path(map_file)
    wanted = _PROBLEMS.get(path.suffix.lower())
    if wanted is None or wanted != of_map.suffix.lower():
        raise InputError(
            f"{file}: problems are a .scen of a .map, or a .3dscen of a .3dmap, not of "
            f"{of_map.name}"
        )
    return read_scenarios(path, of_map.name, cells.occupied.shape)


def _existing(file: str) -> Path:
    path = Path(file)
    if "\0" in file or not exists(path.is_file):
        raise InputError(f"no such file: {file}")
    check_file_is_no_pointer(path)
    return path
