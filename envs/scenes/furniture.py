"""Furniture on a lattice: pieces as boxes of whole cells.

A piece is in its own frame: u along the wall behind it, v away from the wall, w up from the floor;
its boxes are (n, 2, 3) of int, their lowest and highest corners. Sizes are for cells of 0.12 m.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Boxes = NDArray[np.int64]
Piece = Callable[[np.random.Generator], Boxes]


def _boxes(*corners: tuple[int, int, int, int, int, int]) -> Boxes:
    """Boxes of (u, v, w) from and to."""
    return np.array(corners, dtype=np.int64).reshape(-1, 2, 3)


def bed(rng: np.random.Generator) -> Boxes:
    """With its head at the wall."""
    wide = int(rng.integers(8, 16))
    return _boxes((0, 0, 0, wide, 1, 8), (0, 1, 1, wide, 18, 4), (1, 1, 4, wide - 1, 5, 5))


def wardrobe(rng: np.random.Generator) -> Boxes:
    """A closed cupboard."""
    return _boxes((0, 0, 0, int(rng.integers(8, 17)), 5, int(rng.integers(15, 19))))


def sofa(rng: np.random.Generator) -> Boxes:
    """With arms and a back."""
    wide = int(rng.integers(12, 20))
    return _boxes(
        (0, 0, 0, wide, 2, 7),
        (0, 2, 1, wide, 7, 4),
        (0, 2, 4, 1, 7, 5),
        (wide - 1, 2, 4, wide, 7, 5),
    )


def desk(rng: np.random.Generator) -> Boxes:
    """With a chair in front."""
    wide = int(rng.integers(10, 15))
    table = _boxes((0, 0, 6, wide, 6, 7), (0, 0, 0, 1, 6, 6), (wide - 1, 0, 0, wide, 6, 6))
    return np.concatenate([table, _chair(wide // 2 - 2, 6, back=4)])


def shelf(rng: np.random.Generator) -> Boxes:
    """Open, with boards every four cells."""
    wide = int(rng.integers(7, 13))
    boards = [(0, 0, w, wide, 3, w + 1) for w in range(0, 17, 4)]
    return _boxes(
        *boards, (0, 0, 0, 1, 3, 17), (wide - 1, 0, 0, wide, 3, 17), (0, 0, 0, wide, 1, 17)
    )


def counter(rng: np.random.Generator) -> Boxes:
    """A kitchen's, with cupboards above."""
    wide = int(rng.integers(14, 24))
    return _boxes((0, 0, 0, wide, 5, 7), (2, 0, 12, wide - 2, 3, 18))


def tub(rng: np.random.Generator) -> Boxes:
    """Open above."""
    sides = [(0, 0, 0, 14, 6, 1), (0, 0, 1, 14, 1, 5), (0, 5, 1, 14, 6, 5)]
    return _boxes(*sides, (0, 1, 1, 1, 5, 5), (13, 1, 1, 14, 5, 5))


def plant(rng: np.random.Generator) -> Boxes:
    """A pot, a stem and a crown."""
    high = int(rng.integers(7, 13))
    return _boxes((1, 1, 0, 4, 4, 3), (2, 2, 3, 3, 3, high), (0, 0, high, 5, 5, high + 4))


def dining_table(rng: np.random.Generator) -> Boxes:
    """With chairs on both sides; stands free of the wall."""
    wide = int(rng.integers(11, 17))
    legs = [(u, v, 0, u + 1, v + 1, 6) for u in (0, wide - 1) for v in (8, 14)]
    chairs = [_chair(u, 4, back=0) for u in (1, wide - 5)] + [
        _chair(u, 15, back=4) for u in (1, wide - 5)
    ]
    return np.concatenate([_boxes((0, 8, 6, wide, 15, 7), *legs), *chairs])


def low_table(rng: np.random.Generator) -> Boxes:
    """Before where a sofa may stand."""
    wide = int(rng.integers(7, 11))
    legs = [(u, v, 0, u + 1, v + 1, 3) for u in (0, wide - 1) for v in (11, 14)]
    return _boxes((0, 11, 3, wide, 15, 4), *legs)


def _chair(u: int, v: int, back: int) -> Boxes:
    """Of 4 x 4 cells at (u, v), with its back at `back` cells from there."""
    at = v + min(back, 3)
    return _boxes(
        (u, v, 3, u + 4, v + 4, 4),
        (u, at, 4, u + 4, at + 1, 8),
        *((u + i, v + j, 0, u + i + 1, v + j + 1, 3) for i in (0, 3) for j in (0, 3)),
    )


ROOMS: dict[str, tuple[Piece, ...]] = {
    "living room": (sofa, low_table, shelf, plant, wardrobe, sofa),
    "kitchen": (counter, dining_table, counter, plant),
    "bedroom": (bed, wardrobe, shelf, desk),
    "study": (desk, shelf, shelf, sofa, plant),
    "bathroom": (tub, counter, wardrobe),
    "dining room": (dining_table, wardrobe, plant, shelf),
}
"""What stands in which room, as far as there is space."""
