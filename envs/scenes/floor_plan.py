"""Houses on a lattice: rooms along a hall, doors, windows, stairs and furniture.

Boxes are (n, 2, 3) of int, their lowest and highest corners in cells; axes are x along the hall,
y across it and z up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from envs.scenes.furniture import ROOMS, Boxes, Piece
from envs.seeding import stream

CELL = 0.12
"""Side of a cell in metres, on average."""

_HEIGHT, _SLAB, _DOOR_HIGH = 22, 3, 17
_BEARING, _PARTITION, _OUTER = 2, 1, 2  # thickness of walls
_STEPS, _TREAD, _STAIRS_WIDE = 12, 2, 9
_TRIES = 60  # to place a piece


DOOR = 8 * CELL
"""The width of doors in metres, where nobody asks for another."""

NARROWEST, WIDEST = 4 * CELL, 12 * CELL
"""Doors."""


@dataclass
class Room:
    """`low` and `high` (3,) corners, and the `kind`, of which there are those of `ROOMS` and
    "hall"."""

    kind: str
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    taken: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Rectangles (x, y from, x, y to) of the floor that furniture has to leave alone."""


@dataclass
class Plan:
    """A house: free space is the union of `spaces` without the `solids`.

    Attributes:
        rooms: with the halls.
        spaces, solids: boxes; spaces are rooms, doorways, windows' recesses and stairwells, solids
            furniture and steps.
        panes: boxes just about the window panes.
    """

    rooms: list[Room]
    spaces: Boxes
    solids: Boxes
    panes: Boxes


def make_plan(scene: int, door: float = DOOR) -> Plan:
    """The house of a scene: on one level with nine rooms where `scene` is even, on two levels
    joined by stairs with ten where it is odd. Doors are so many metres wide, to the nearest cell;
    all else is the same but where furniture leaves them alone."""
    builder = _Builder(stream("house", scene), 1 + scene % 2, round(door / CELL))
    return builder.build()


class _Builder:
    def __init__(self, rng: np.random.Generator, levels: int, door: int) -> None:
        self._rng = rng
        self._levels = levels
        self._door_wide = door
        self._rooms: list[Room] = []
        self._spaces: list[tuple[int, ...]] = []
        self._solids: list[Boxes] = []
        self._panes: list[tuple[int, ...]] = []
        one = levels == 1
        self._hall = int(rng.integers(15, 18) if one else rng.integers(24, 27))
        self._strips = [int(rng.integers(32, 38)) for _ in range(2)]  # depth of rooms
        self._per_strip = 4 if one else 2
        self._length = int(rng.integers(128, 140) if one else rng.integers(74, 84))

    def build(self) -> Plan:
        for level in range(self._levels):
            self._storey(level * (_HEIGHT + _SLAB))
        if self._levels > 1:
            self._stairs()
        for room in self._rooms:
            for piece in ROOMS.get(room.kind, ()):
                self._place(room, piece)
        spaces = [*self._spaces, *((*room.low, *room.high) for room in self._rooms)]
        return Plan(self._rooms, _array(spaces), np.concatenate(self._solids), _array(self._panes))

    def _storey(self, z: int) -> None:
        hall_y = self._strips[0] + _BEARING
        hall = self._room("hall", (0, hall_y, z), (self._length, hall_y + self._hall, z + _HEIGHT))
        kinds = self._rng.permutation(np.tile(list(ROOMS), 2))
        for strip, y in enumerate((0, hall_y + self._hall + _BEARING)):
            cuts = self._cuts()
            row: list[Room] = []
            for x, end in pairwise(cuts):
                kind = str(kinds[len(row) + strip * self._per_strip])
                high = (end - _PARTITION, y + self._strips[strip], z + _HEIGHT)
                row.append(self._room(kind, (x, y, z), high))
            for room in row:
                self._door(room, hall, axis=1)
                self._window(room, outward=1 if strip else -1)
            for index in self._rng.permutation(len(row) - 1)[: len(row) // 2]:
                self._door(row[index], row[index + 1], axis=0)

    def _cuts(self) -> list[int]:
        """Where the rooms of a strip begin, and where the last would end with its wall."""
        shares = self._rng.uniform(0.8, 1.25, self._per_strip)
        whole = self._length + _PARTITION
        inner = np.cumsum(shares / shares.sum())[:-1] * whole
        return [0, *(int(x) for x in np.round(inner)), whole]

    def _room(self, kind: str, low: tuple[int, ...], high: tuple[int, ...]) -> Room:
        room = Room(kind, np.array(low), np.array(high))
        self._rooms.append(room)
        return room

    def _door(self, a: Room, b: Room, axis: int) -> None:
        """A doorway through the wall between rooms that are neighbours along an axis."""
        first, second = sorted((a, b), key=lambda room: int(room.low[axis]))
        along = 1 - axis
        wide, high = self._door_wide, _DOOR_HIGH
        low = int(max(a.low[along], b.low[along])) + 2
        least, most = low, int(min(a.high[along], b.high[along])) - wide - 2
        at = int(self._rng.integers(least, most + 1))
        box = np.zeros((2, 3), dtype=np.int64)
        box[:, axis] = first.high[axis], second.low[axis]
        box[:, along] = at, at + wide
        box[:, 2] = a.low[2], a.low[2] + high
        self._spaces.append(tuple(box.ravel()))
        for room in (a, b):
            self._keep_clear(room, box)

    def _keep_clear(self, room: Room, box: NDArray[np.int64], reach: int = 8) -> None:
        low, high = box[0, :2] - reach, box[1, :2] + reach
        room.taken.append((int(low[0]), int(low[1]), int(high[0]), int(high[1])))

    def _window(self, room: Room, outward: int) -> None:
        """A recess in the outer wall, closed by a pane."""
        wide = int(self._rng.integers(8, 14))
        x = int(self._rng.integers(room.low[0] + 2, room.high[0] - wide - 1))
        z = int(room.low[2])
        inner = int(room.high[1] if outward > 0 else room.low[1])
        y, end = sorted((inner, inner + outward * _OUTER))
        self._spaces.append((x, y, z + 8, x + wide, end, z + 18))
        pane = end if outward > 0 else y
        self._panes.append((x, pane, z + 8, x + wide, pane, z + 18))

    def _stairs(self) -> None:
        """A flight in the hall, with the opening in the slab above it."""
        lower, upper = (room for room in self._rooms if room.kind == "hall")
        x, y = int(lower.low[0]) + 12, int(lower.low[1])
        z, rise = int(lower.low[2]), _HEIGHT + _SLAB
        run = _STEPS * _TREAD
        for step in range(_STEPS):
            top = z + round((step + 1) * rise / (_STEPS + 1))
            begin = x + step * _TREAD
            self._solids.append(_array([(begin, y, z, x + run, y + _STAIRS_WIDE, top)]))
        hole = (x, y, int(lower.high[2]), x + run, y + _STAIRS_WIDE, int(upper.low[2]))
        self._spaces.append(hole)

    def _place(self, room: Room, piece: Piece) -> None:
        """Puts a piece at a random wall, if there is a place."""
        boxes = piece(self._rng)
        deep, wide = int(boxes[:, 1, 1].max()), int(boxes[:, 1, 0].max())
        for _ in range(_TRIES):
            wall = int(self._rng.integers(4))
            along = 0 if wall < 2 else 1
            room_for = int(room.high[along] - room.low[along]) - wide
            across = int(room.high[1 - along] - room.low[1 - along]) - deep
            if room_for < 0 or across < 0:
                continue
            shift = int(self._rng.integers(room_for + 1))
            placed = _turned(boxes, wall, shift, room)
            floor = placed[:, 0, :2].min(axis=0), placed[:, 1, :2].max(axis=0)
            rectangle = int(floor[0][0]), int(floor[0][1]), int(floor[1][0]), int(floor[1][1])
            if not any(_overlap(rectangle, taken) for taken in room.taken):
                room.taken.append(rectangle)
                self._solids.append(placed)
                return


def _turned(boxes: Boxes, wall: int, shift: int, room: Room) -> Boxes:
    """A piece's boxes in the house, `shift` cells along a wall: 0 and 1 are those of low and high
    y, 2 and 3 those of low and high x."""
    along, across = (0, 1) if wall < 2 else (1, 0)
    placed = np.empty_like(boxes)
    placed[..., along] = room.low[along] + shift + boxes[..., 0]
    if wall % 2:
        placed[..., across] = room.high[across] - boxes[:, ::-1, 1]
    else:
        placed[..., across] = room.low[across] + boxes[..., 1]
    placed[..., 2] = room.low[2] + boxes[..., 2]
    return placed


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _array(boxes: list[tuple[int, ...]]) -> Boxes:
    return np.array(boxes, dtype=np.int64).reshape(-1, 2, 3)
