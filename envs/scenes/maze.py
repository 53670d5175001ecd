"""Mazes: corridors between thin walls, in the plane or in space.

Straight lines lead into walls, and what is near as the crow flies is far by the only way there is:
fields of arrival times have most occasion here for wrong minima.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from envs.errors import InputError
from envs.scenes import HALF_SIDE
from envs.scenes.cell_world import CellWorld
from envs.seeding import stream
from envs.speed_model import SpeedModel

_PLANE, _SPACE = 2, 3
_ROOMS = {_PLANE: 8, _SPACE: 4}
_MOST_ROOMS = {_PLANE: 60, _SPACE: 16}
"""Along each side."""

_SLOWEST, _DETOUR = 0.1, 2
"""The speed falls linearly to a tenth of the highest, as in `c3d`, which is in the middle of
corridors alone. At contact it is such that to cross a wall takes twice as long as the longest way
between two rooms at the highest speed: no way of least time leads through walls."""


class Maze(CellWorld):
    """A point robot in a square or a cube of side 20, centred at the origin, of rooms on a lattice.

    A random walk that turns back where it is caught, depth first, opens the walls between rooms
    until each is reached by exactly one way; then some more walls are opened. Walls are thin by
    the corridors between them.

    Args:
        scene: the seed of the maze, >= 0.
        dimension: 2 for the plane, 3 for space.
        rooms: along each side; 0 for 8 in the plane, 4 in space.
        loops: the share of the walls left by the walk that is opened, from 0 to 1.
        corridor: how many times wider a corridor is than a wall is thick, at least 2.
        robot_radius: of the disc or ball about the configuration.

    Raises:
        InputError: an argument is out of range.
    """

    kind_of_problems = "maze"
    advice = "the robot has too little room; make it smaller (robot_radius), or ask for fewer rooms"

    def __init__(
        self,
        scene: int = 0,
        dimension: int = 2,
        rooms: int = 0,
        loops: float = 0.0,
        corridor: int = 5,
        robot_radius: float = 0.01,
    ) -> None:
        if dimension not in _ROOMS:
            raise InputError(f"maze: dimension must be 2 or 3, not {dimension}")
        rooms = rooms or _ROOMS[dimension]
        _check("scene", scene, 0, 2**32 - 1)
        _check("rooms", rooms, 2, _MOST_ROOMS[dimension])
        _check("loops", loops, 0, 1)
        _check("corridor", corridor, 2, 20)
        rng = stream("maze", scene, dimension)
        doors = walk(dimension, rooms, rng)
        solid = walls(
            dimension, rooms, corridor, [*doors, *_more(dimension, rooms, doors, loops, rng)]
        )
        side = 2 * HALF_SIDE / len(solid)
        if not 0 <= 2 * robot_radius < corridor * side:
            raise InputError(
                f"maze: robot_radius must be from 0 to less than half of a corridor's width, "
                f"{corridor * side / 2:g}, not {robot_radius:g}"
            )
        reach, longest = corridor * side / 2, (corridor + 1) * side * longest_way(rooms, doors)
        speeds = SpeedModel(_SLOWEST * reach, reach, contact=side / (_DETOUR * longest))
        super().__init__("maze", solid, side, np.full(dimension, -HALF_SIDE), robot_radius, speeds)
        self._scene = scene

    @property
    def scene_seeds(self) -> tuple[int, ...]:
        return (self._scene,)

    def definition(self) -> dict[str, Any]:
        return {"class": "Maze", "version": 1, "scene": self._scene, **self.cells_definition()}


def _check(name: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise InputError(f"maze: {name} must be between {least:g} and {most:g}, not {value:g}")


_Room = tuple[int, ...]
_Door = tuple[_Room, int]
"""A wall between two rooms: the one with the lower number, and the axis across."""


def walk(dimension: int, rooms: int, rng: np.random.Generator) -> list[_Door]:
    """The walls that a walk through all rooms opens, `rooms` along each side."""
    here: _Room = tuple(int(k) for k in rng.integers(rooms, size=dimension))
    seen, way, doors = {here}, [here], []
    while way:
        here = way[-1]
        ahead = [
            (axis, there)
            for axis in range(dimension)
            for step in (-1, 1)
            if 0 <= here[axis] + step < rooms
            and (there := (*here[:axis], here[axis] + step, *here[axis + 1 :])) not in seen
        ]
        if not ahead:
            way.pop()
            continue
        axis, there = ahead[rng.integers(len(ahead))]
        doors.append((min(here, there), axis))
        seen.add(there)
        way.append(there)
    return doors


def _more(
    dimension: int, rooms: int, doors: list[_Door], loops: float, rng: np.random.Generator
) -> list[_Door]:
    """A share of the walls that are no doors yet."""
    known = set(doors)
    left = [
        (room, axis)
        for room in product(range(rooms), repeat=dimension)
        for axis in range(dimension)
        if room[axis] + 1 < rooms and (room, axis) not in known
    ]
    return [left[n] for n in rng.permutation(len(left))[: round(loops * len(left))]]


def longest_way(rooms: int, doors: Sequence[_Door]) -> int:
    """From how many rooms to the next the longest way leads between two rooms that doors join as a
    tree: from the room that is farthest from any to the one that is farthest from it."""
    low, axes = np.array([room for room, _ in doors]), np.array([axis for _, axis in doors])
    high = low + np.eye(low.shape[1], dtype=np.int64)[axes]
    shape = (rooms,) * low.shape[1]
    one, other = (np.ravel_multi_index(tuple(ends.T), shape) for ends in (low, high))
    joined = coo_array((np.ones(len(doors)), (one, other)), shape=(rooms ** low.shape[1],) * 2)
    end = 0
    for _ in range(2):
        away = dijkstra(joined.tocsr(), directed=False, indices=end, unweighted=True)
        end = int(away.argmax())
    return int(away[end])


def walls(dimension: int, rooms: int, corridor: int, doors: Iterable[_Door]) -> NDArray[np.bool_]:
    """The solid cells of a maze, (n,) * dimension of bool: walls are a cell thick, rooms `corridor`
    cells wide and `rooms` along each side."""
    pitch = corridor + 1
    solid = np.ones((rooms * pitch + 1,) * dimension, dtype=np.bool_)
    for room in product(range(rooms), repeat=dimension):
        solid[_cells(room, pitch)] = False
    for room, axis in doors:
        opening = list(_cells(room, pitch))
        opening[axis] = slice(opening[axis].stop, opening[axis].stop + 1)
        solid[tuple(opening)] = False
    return solid


def _cells(room: _Room, pitch: int) -> tuple[slice, ...]:
    """Those of a room."""
    return tuple(slice(k * pitch + 1, (k + 1) * pitch) for k in room)
