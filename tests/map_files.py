"""Small occupancy grids in all formats, drawn as text: "#" is occupied, "." is free, "?" is not
known; the first row is at the top."""

from __future__ import annotations

import heapq
import math
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

ROOMS = """
####################
#........#.........#
#........#.........#
#........#....##...#
#.............##...#
#........#.........#
#........#.........#
####.#############.#
#........#.........#
#........#.........#
#..................#
#....#...#.........#
####################
"""
"""Two rows of rooms, with doors a cell wide."""

_SHADES = {"#": 0, ".": 254, "?": 205}

YAML = """image: {image}
resolution: 0.1
origin: [-1.0, 2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def rows_of(drawing: str) -> list[str]:
    return drawing.strip().splitlines()


def occupied(drawing: str = ROOMS) -> NDArray[np.bool_]:
    """Which cells (nx, ny) are occupied, y upwards."""
    rows = np.array([list(row) for row in rows_of(drawing)])
    return rows[::-1].T == "#"


def shades(drawing: str = ROOMS) -> NDArray[np.uint8]:
    """The pixels (rows, columns) that `map_saver` of ROS writes."""
    return np.array([[_SHADES[c] for c in row] for row in rows_of(drawing)], dtype=np.uint8)


def write_image(file: Path, drawing: str = ROOMS) -> Path:
    Image.fromarray(shades(drawing)).save(file)
    return file


def write_ros(folder: Path, drawing: str = ROOMS, yaml: str = YAML) -> Path:
    write_image(folder / "map.pgm", drawing)
    (folder / "map.yaml").write_text(yaml.format(image="map.pgm"))
    return folder / "map.yaml"


def octile(drawing: str = ROOMS) -> str:
    """As Moving AI has it."""
    rows = rows_of(drawing.replace("#", "@"))
    return f"type octile\nheight {len(rows)}\nwidth {len(rows[0])}\nmap\n" + "\n".join(rows) + "\n"


def write_octile(folder: Path, drawing: str = ROOMS) -> Path:
    (folder / "rooms.map").write_text(octile(drawing))
    return folder / "rooms.map"


def scenarios(
    *lines: str, map_name: str = "maps/rooms.map", size: tuple[int, int] = (20, 13)
) -> str:
    """A `.scen` of "x y X Y length" each, of cells from the upper left corner."""
    head = ["0", map_name, *map(str, size)]
    return "\n".join(["version 1", *("\t".join([*head, *line.split()]) for line in lines)]) + "\n"


def octile_distance(
    free: NDArray[np.bool_], start: tuple[int, ...], goal: tuple[int, ...]
) -> float:
    """The length of the shortest way from cell to cell of a grid of any dimension, diagonally too
    where it cuts no corner; infinity if there is none. By Dijkstra's algorithm."""
    known = {start: 0.0}
    queue = [(0.0, start)]
    while queue:
        so_far, here = heapq.heappop(queue)
        if here == goal:
            return so_far
        if so_far > known[here]:
            continue
        for step in product((-1, 0, 1), repeat=free.ndim):
            block = product(*({0, s} for s in step))
            cells = [tuple(h + s for h, s in zip(here, corner, strict=True)) for corner in block]
            inside = all(
                0 <= x < n for cell in cells for x, n in zip(cell, free.shape, strict=True)
            )
            if not any(step) or not inside or not all(free[cell] for cell in cells):
                continue
            there = tuple(h + s for h, s in zip(here, step, strict=True))
            length = so_far + math.sqrt(sum(abs(s) for s in step))
            if length < known.get(there, math.inf):
                known[there] = length
                heapq.heappush(queue, (length, there))
    return math.inf


def voxels() -> NDArray[np.bool_]:
    """Cubes (12, 10, 8): two walls, with a hole each."""
    found = np.zeros((12, 10, 8), dtype=np.bool_)
    found[4] = found[8] = True
    found[4, 2:4, 1:3] = found[8, 7:9, 5:7] = False
    return found


def voxel_text(cells: NDArray[np.bool_]) -> str:
    """As Moving AI has it."""
    lines = [f"voxel {' '.join(map(str, cells.shape))}"]
    return "\n".join([*lines, *(" ".join(map(str, cell)) for cell in np.argwhere(cells))]) + "\n"
