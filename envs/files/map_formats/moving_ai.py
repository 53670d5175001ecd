"""Moving AI's benchmark: maps of squares (`.map`) and voxels (`.3dmap`), and their problems with
the lengths of optimal paths (`.scen`, `.3dscen`).

N. R. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE Transactions on Computational
Intelligence and AI in Games, 2012; D. Brewer and N. R. Sturtevant, "Benchmarks for Pathfinding in
3D Voxel Space", SoCS 2018. Lengths are of paths between the middles of cells, to 8 neighbours (26
of voxels), that cut no corners.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from envs.errors import InputError, brief, input_error_of, reason
from envs.files.map_formats.cells import Cells, check_count, upright
from envs.problem import Array

PASSABLE, BLOCKED = ".GS", "@OTW"
"""Ground, ground and swamp; out of bounds, out of bounds, trees and water."""

_MOST_BYTES = 2**28

_UNIT = "cells"


@dataclass(frozen=True, eq=False)
class Scenarios:
    """Problems on a map.

    Attributes:
        ends: (n, 2, d) the cells of starts and goals, as in `Cells`.
        lengths: (n,) of optimal paths, in cells.
        lines: (n,) where in the file they are.
    """

    ends: NDArray[np.int64]
    lengths: Array
    lines: NDArray[np.int64]


def read_map(file: Path, unknown: str) -> Cells:
    """A `.map` of type octile. Its first row is at the top.

    Raises:
        InputError: it is none.
    """
    lines = _lines(file)
    words = [line.split() for line in lines[:4]]
    if len(words) < 4 or words[0] != ["type", "octile"] or words[3] != ["map"]:
        raise InputError(
            f"{file}: a map of Moving AI begins with the lines 'type octile', 'height H', "
            "'width W' and 'map'"
        )
    height, width = (_of_header(words[n], key, file) for n, key in ((1, "height"), (2, "width")))
    check_count(file, (width, height))
    rows = lines[4:]
    while rows and not rows[-1].strip():
        rows.pop()
    if len(rows) != height:
        raise InputError(f"{file}: it says height {height}, but has {len(rows)} rows")
    for number, row in enumerate(rows, 5):
        if len(row) != width:
            raise InputError(
                f"{file}: line {number} has {len(row)} characters, but it says width {width}"
            )
    codes = np.frombuffer("".join(rows).encode("latin-1"), dtype=np.uint8).reshape(height, width)
    occupied = np.isin(codes, np.frombuffer(BLOCKED.encode(), dtype=np.uint8))
    known = occupied | np.isin(codes, np.frombuffer(PASSABLE.encode(), dtype=np.uint8))
    if not known.all():
        row, column = np.argwhere(~known)[0].tolist()
        raise InputError(
            f"{file}: line {row + 5}, column {column + 1}: no terrain is called "
            f"{rows[row][column]!r}; choose from {PASSABLE} (passable) and {BLOCKED} (not)"
        )
    return Cells(upright(occupied), unit=_UNIT)


def read_voxels(file: Path, unknown: str) -> Cells:
    """A `.3dmap`: a line "voxel W H D", then the x, y and z of each blocked voxel.

    Raises:
        InputError: it is none.
    """
    _check_size(file)
    with input_error_of(f"cannot read {file}", UnicodeDecodeError), file.open("rb") as stream:
        words = stream.readline(200).decode("latin-1").split()
        if len(words) != 4 or words[0] != "voxel":
            raise InputError(f"{file}: a map of voxels begins with the line 'voxel W H D'")
        shape = [_whole(word, f"{file}: line 1") for word in words[1:]]
        check_count(file, shape)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of no lines at all, and of numbers that are not whole
            try:
                blocked = np.loadtxt(
                    stream, dtype=np.int64, ndmin=2, comments=None, encoding="latin-1"
                )
            except (ValueError, UserWarning, DeprecationWarning) as error:
                raise InputError(
                    f"{file}: after line 1 each line must have the x, y and z of a blocked voxel "
                    f"({reason(error)}; row 0 is line 2)"
                ) from None
    if blocked.shape[1] != 3:
        raise InputError(f"{file}: lines have {blocked.shape[1]} numbers, not x, y and z")
    outside = ((blocked < 0) | (blocked >= shape)).any(axis=1)
    if outside.any():
        x, y, z = blocked[np.argmax(outside)].tolist()
        raise InputError(
            f"{file}: voxel {x} {y} {z} is outside of {shape[0]} x {shape[1]} x {shape[2]}"
        )
    occupied = np.zeros(shape, dtype=np.bool_)
    occupied[tuple(blocked.T)] = True
    return Cells(occupied, unit=_UNIT)


def read_scenarios(file: Path, map_name: str, shape: Sequence[int]) -> Scenarios:
    """The problems of a `.scen` or `.3dscen`, version 1, on the map of a name, without its folder,
    and shape (nx, ny) or (nx, ny, nz).

    Raises:
        InputError: it is none, or not of that map.
    """
    lines = _lines(file)
    version = lines[0].split() if lines else []
    if version not in (["version", "1"], ["version", "1.0"]):
        raise InputError(f"{file}: problems of Moving AI begin with the line 'version 1'")
    found = (_in_plane if len(shape) == 2 else _in_space)(lines, file, map_name, shape)
    if not found:
        raise InputError(f"{file} holds no problem")
    numbers, ends, lengths = zip(*found, strict=True)
    made = Scenarios(np.array(ends), np.array(lengths), np.array(numbers))
    outside = ((made.ends < 0) | (made.ends >= np.array(shape))).any(axis=(1, 2))
    if outside.any():
        raise InputError(
            f"{file}: line {made.lines[np.argmax(outside)]}: its start or goal is not on the map"
        )
    return made


_Problem = tuple[int, list[list[int]], float]
"""The line, cells of start and goal, and the optimal length."""


def _in_plane(
    lines: Sequence[str], file: Path, map_name: str, shape: Sequence[int]
) -> list[_Problem]:
    """Of lines of bucket, map, its width and height, x and y of start and goal, and length."""
    found = []
    width, height = shape
    for number, line in enumerate(lines[1:], 2):
        fields = line.split("\t") if "\t" in line else line.split()
        where = f"{file}: line {number}"
        if not line.strip():
            continue
        if len(fields) != 9:
            raise InputError(
                f"{where} has {len(fields)} fields, not the 9 of bucket, map, width, height, "
                "start x and y, goal x and y, and optimal length"
            )
        _check_name(fields[1], map_name, where)
        size = [_whole(field, where) for field in fields[2:4]]
        if size != [width, height]:
            raise InputError(
                f"{where} is of a map of {size[0]} x {size[1]}, not of {width} x {height} as "
                f"{map_name} is; scaled maps are not read"
            )
        x, y, to_x, to_y = (_whole(field, where) for field in fields[4:8])
        ends = [[x, height - 1 - y], [to_x, height - 1 - to_y]]
        found.append((number, ends, _length(fields[8], where)))
    return found


def _in_space(
    lines: Sequence[str], file: Path, map_name: str, shape: Sequence[int]
) -> list[_Problem]:
    """Of a line of the map, and lines of x, y and z of start and goal, length, and that by what a
    heuristic says."""
    if len(lines) < 2:
        return []
    _check_name(lines[1], map_name, f"{file}: line 2")
    found = []
    for number, line in enumerate(lines[2:], 3):
        fields = line.split()
        if not fields:
            continue
        where = f"{file}: line {number}"
        if len(fields) not in (7, 8):
            raise InputError(
                f"{where} has {len(fields)} fields, not start x, y and z, goal x, y and z, optimal "
                "length, and its ratio to a heuristic"
            )
        numbers = [_whole(field, where) for field in fields[:6]]
        found.append((number, [numbers[:3], numbers[3:]], _length(fields[6], where)))
    return found


def _check_name(name: str, map_name: str, where: str) -> None:
    """Refuses problems of another map; folders in names are of other machines."""
    if name.strip().replace("\\", "/").rpartition("/")[2] != map_name:
        raise InputError(f"{where} is of the map {brief(name.strip())}, not of {map_name}")


def _of_header(words: Sequence[str], key: str, file: Path) -> int:
    if len(words) != 2 or words[0] != key:
        raise InputError(f"{file}: its header has no line '{key} N' where it should")
    return _whole(words[1], f"{file}: {key}")


def _whole(text: str, where: str) -> int:
    text = text.strip()
    if not (text.isascii() and text.isdigit() and len(text) <= 9):
        raise InputError(f"{where}: {brief(text)} is no whole number from 0 on")
    return int(text)


def _length(text: str, where: str) -> float:
    try:
        length = float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        length = math.nan
    if not 0 <= length < 1e12:
        raise InputError(f"{where}: {brief(text)} is no length")
    return length


def _lines(file: Path) -> list[str]:
    """Of a text of one byte a character."""
    _check_size(file)
    with input_error_of(f"cannot read {file}"):
        text = file.read_bytes().decode("latin-1")
    return text.replace("\r\n", "\n").split("\n")


def _check_size(file: Path) -> None:
    if file.stat().st_size > _MOST_BYTES:
        raise InputError(f"{file} has more than {_MOST_BYTES} bytes, too many to read")
