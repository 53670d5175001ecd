"""Scenes of solid obstacles from small YAML files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from envs.collision.shapes import LARGEST, SIZED, Mesh, PlacedShape, Solid
from envs.errors import InputError, brief, input_error_of, suggestion
from envs.files.mesh_file import read_mesh
from envs.files.paths import exists, safe_join
from envs.problem import Array


def read_scene(file: Path) -> list[PlacedShape]:
    """Reads obstacles from a file such as

        obstacles:
          - box: [0.6, 1.2, 0.05]    # full sides
            position: [0.5, 0, 0.2]  # of its middle; [0, 0, 0] unless given
          - sphere: 0.1              # radius
            position: [0.3, -0.4, 0.6]
          - cylinder: [0.05, 0.4]    # radius and length, along its own z
          - capsule: [0.05, 0.4]     # the same, with half a ball on either end of the length
            rpy: [0, 1.5708, 0]      # roll, pitch, yaw as in URDF; [0, 0, 0] unless given
          - mesh: shelf.stl          # from this file's folder or the one above; watertight
            scale: 0.001             # 1 unless given

    Lengths are in metres, angles in radians, positions in the frame of the arm's base; none is
    more than `LARGEST`, and the file has at most 256 KiB.

    Returns:
        The obstacles in the file's order.

    Raises:
        InputError: there is no such file, or it is not such a file.
    """
    try:
        return [
            _obstacle(number, entry, file.parent)
            for number, entry in enumerate(_entries(file), start=1)
        ]
    except InputError as error:
        raise InputError(f"{file}: {error}") from error


class _Loader(yaml.SafeLoader):
    """Refuses a key given twice, of which YAML's own loader drops the first in silence, and merged
    mappings (<<), a few lines of which can stand for more entries than memory holds."""

    def compose_mapping_node(self, anchor: dict[Any, yaml.Node]) -> yaml.MappingNode:
        node = super().compose_mapping_node(anchor)
        where = f"in the mapping at line {node.start_mark.line + 1}"
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise InputError(f"{key.value!r} is given twice {where}")
            if key.tag == _MERGE:
                raise InputError(f"'<<' {where} is not supported; write the keys out")
            seen.add(key.value)
        return node


_MERGE = "tag:yaml.org,2002:merge"

_ODD_SCALARS = (
    *(ValueError, TypeError, AttributeError, LookupError),
    *(ArithmeticError, RecursionError),
)
"""What PyYAML raises besides its own, on scalars that are not what their tags say and on depth."""

_MOST_BYTES = 2**18
"""Of a scene, thousands of obstacles; PyYAML reads some tens of kilobytes a second."""


def _entries(file: Path) -> list[Any]:
    if not exists(file.is_file):
        raise InputError("no such file")
    try:
        with input_error_of("cannot be read"):
            size = file.stat().st_size
            if size > _MOST_BYTES:
                raise InputError(f"has {size} bytes; scenes of at most {_MOST_BYTES} are read")
            content = yaml.load(file.read_bytes(), _Loader)
    except InputError:
        raise
    except (yaml.YAMLError, *_ODD_SCALARS) as error:
        raise InputError(f"not YAML, mend it: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise InputError("must be a mapping with the key 'obstacles'")
    for key in content:
        if key != "obstacles":
            raise InputError(f"unknown key {brief(key)}; {suggestion(brief(key), ['obstacles'])}")
    obstacles = content.get("obstacles")
    if not isinstance(obstacles, list) or not obstacles:
        raise InputError("'obstacles' must be a list of at least one obstacle")
    return obstacles


def _obstacle(number: int, entry: Any, folder: Path) -> PlacedShape:
    try:
        if not isinstance(entry, dict):
            raise InputError(f"must be a mapping such as 'sphere: 0.1', not {brief(entry)}")
        _check_keys(entry)
        return PlacedShape(_solid(entry, folder), _pose(entry))
    except ValueError as error:  # InputError, or a shape's own
        raise InputError(f"obstacle {number}: {error}") from error


def _check_keys(entry: dict[Any, Any]) -> None:
    shapes = (*SIZED, "mesh")
    keys = (*shapes, "scale", "position", "rpy")
    for key in entry:
        if key not in keys:
            raise InputError(f"unknown key {brief(key)}; {suggestion(brief(key), keys)}")
    named = [key for key in shapes if key in entry]
    if len(named) != 1:
        given = " and ".join(named) or "none"
        raise InputError(f"must have one of {', '.join(shapes)}, not {given}")
    if "scale" in entry and "mesh" not in entry:
        raise InputError("only a mesh may have a scale")


def _solid(entry: dict[Any, Any], folder: Path) -> Solid:
    if "mesh" in entry:
        return _mesh(entry, folder)
    [kind] = [key for key in SIZED if key in entry]
    count = sum(SIZED[kind].sizes.values())
    if count == 1:
        return SIZED[kind].of_sizes([_size(entry[kind], kind)])
    return SIZED[kind].of_sizes(_sizes(entry, kind, count))


def _mesh(entry: dict[Any, Any], folder: Path) -> Mesh:
    name = entry["mesh"]
    if not isinstance(name, str):
        raise InputError(f"mesh must name a file, not {brief(name)}")
    scale = _size(entry.get("scale", 1), "scale")
    read = read_mesh(safe_join(folder, name))
    if not read.closed:
        raise InputError(
            f"{folder / name} is not watertight, so it has no inside: {read.holes}; close its holes"
        )
    return Mesh(read.vertices * scale, read.faces)


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
