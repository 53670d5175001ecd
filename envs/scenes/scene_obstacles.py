"""The obstacles of scene files: what stands for a solid, and where it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from envs.collision.shapes import LARGEST, SIZED, ConvexHull, Mesh, PlacedShape, Solid
from envs.errors import InputError, brief, suggestion
from envs.files.mesh_file import read_mesh, read_points
from envs.files.paths import safe_join
from envs.problem import Array


def obstacle_of(entry: Any, folder: Path) -> tuple[str, PlacedShape]:
    """The name, "" for none, and the solid of an entry as `read_scene` has it.

    Args:
        entry: as YAML has it.
        folder: where files that it names are sought.

    Raises:
        ValueError: it is no such entry; an `InputError`, or a shape's own.
    """
    if not isinstance(entry, dict):
        raise InputError(f"must be a mapping such as 'sphere: 0.1', not {brief(entry)}")
    _check_keys(entry)
    return _name(entry), PlacedShape(_solid(entry, folder), _pose(entry))


def _check_keys(entry: dict[Any, Any]) -> None:
    shapes = (*SIZED, *_OF_POINTS)
    keys = (*shapes, "scale", "position", "rpy", "name")
    for key in entry:
        if key not in keys:
            raise InputError(f"unknown key {brief(key)}; {suggestion(key, keys)}")
    named = [key for key in shapes if key in entry]
    if len(named) != 1:
        given = " and ".join(named) or "none"
        raise InputError(f"must have one of {', '.join(shapes)}, not {given}")
    if "scale" in entry and named[0] not in _OF_POINTS:
        raise InputError(f"only a {' or a '.join(_OF_POINTS)} may have a scale")


def _name(entry: dict[Any, Any]) -> str:
    name = entry.get("name", "")
    if "name" in entry and not (isinstance(name, str) and name.strip() and name.isprintable()):
        raise InputError(f"name must be a word such as 'shelf', not {brief(name)}")
    return str(name)


def _solid(entry: dict[Any, Any], folder: Path) -> Solid:
    for kind, read in _OF_POINTS.items():
        if kind in entry:
            return read(entry[kind], _size(entry.get("scale", 1), "scale"), folder)
    [kind] = [key for key in SIZED if key in entry]
    count = sum(SIZED[kind].sizes.values())
    if count == 1:
        return SIZED[kind].of_sizes([_size(entry[kind], kind)])
    return SIZED[kind].of_sizes(_sizes(entry, kind, count))


def _mesh(name: Any, scale: float, folder: Path) -> Mesh:
    if not isinstance(name, str):
        raise InputError(f"mesh must name a file, not {brief(name)}")
    read = read_mesh(safe_join(folder, name))
    if not read.closed:
        raise InputError(
            f"{folder / name} is not watertight, so it has no inside: {read.holes}; close its holes"
        )
    return Mesh(read.vertices * scale, read.faces)


def _hull(points: Any, scale: float, folder: Path) -> ConvexHull:
    if isinstance(points, str):
        return ConvexHull.of_points(read_points(safe_join(folder, points)) * scale)
    if not isinstance(points, list):
        raise InputError(f"hull must name a file or list points, not {brief(points)}")
    numbers = [_numbers(point, "a point of a hull", 3) for point in points]
    return ConvexHull.of_points(np.array(numbers).reshape(-1, 3) * scale)


_OF_POINTS: Mapping[str, Callable[[Any, float, Path], Solid]] = {"mesh": _mesh, "hull": _hull}
"""Shapes that are made of points, by the keys that name them; they may have a scale."""


def _pose(entry: dict[Any, Any]) -> Array:
    still = [0, 0, 0]
    rpy = _numbers(entry.get("rpy", still), "rpy", 3)
    pose = np.eye(4)
    # Lower case: about fixed axes, x first, as URDF has it.
    pose[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    pose[:3, 3] = _numbers(entry.get("position", still), "position", 3)
    return pose


def _sizes(entry: dict[Any, Any], key: str, count: int) -> list[float]:
    return [_size(value, key) for value in _numbers(entry[key], key, count)]


def _numbers(values: Any, key: str, count: int) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise InputError(f"{key} must be a list of {count} numbers, not {brief(values)}")
    return [_number(value, key) for value in values]


def _size(value: Any, key: str) -> float:
    size = _number(value, key)
    if size <= 0:
        raise InputError(f"{key} must be above 0, not {size:g}")
    return size


def _number(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{key} wants a number such as 0.5 or 1.0e-3, not {brief(value)}")
    if not abs(value) <= LARGEST:
        raise InputError(
            f"{key} must be finite and at most {LARGEST:g} in size, not {brief(value)}"
        )
    return float(value)
