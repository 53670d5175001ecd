"""What is read of an occupancy grid: which cells are occupied, how large they are, and where."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from envs.errors import InputError
from envs.problem import Array

MOST_CELLS = 2**25
"""Of a grid, which takes a gigabyte, at most, while it is read."""

FREE, OCCUPIED = "free", "occupied"


@dataclass(frozen=True, eq=False)
class Cells:
    """An occupancy grid.

    Attributes:
        occupied: (nx, ny) or (nx, ny, nz) of bool, x, y and z upwards.
        resolution: of a cell, its side; 0 where the file does not say it.
        origin: (d,) the lower corner of the first cell; None where the file does not say it.
        default_resolution: of such files, if nobody says another.
        unit: what that is in.
        unknown: share of the cells of which it is not known whether they are occupied.
        notes: what else is to be said of the file.
    """

    occupied: NDArray[np.bool_]
    resolution: float = 0.0
    origin: Array | None = None
    default_resolution: float = 1.0
    unit: str = "m"
    unknown: float = 0.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Thresholds:
    """From which probability on a cell is occupied, and up to which it is free, as `map_server` of
    ROS has them: above `occupied`, below `free`; between the two, and where it is no number, it is
    not known.

    Raises:
        InputError: they are out of order.
    """

    occupied: float = 0.65
    free: float = 0.196

    def __post_init__(self) -> None:
        if not 0 <= self.free <= self.occupied <= 1:
            raise InputError(
                f"free_thresh must not be above occupied_thresh, and both must be from 0 to 1, not "
                f"{self.free:g} and {self.occupied:g}"
            )

    def occupancy(self, chances: Array, unknown: str) -> tuple[NDArray[np.bool_], float]:
        """Which cells are occupied, of any shape, by the probabilities of that, and the share of
        those that are not known, which count as `unknown` says."""
        occupied = chances > self.occupied
        uncertain = ~(occupied | (chances < self.free))
        if unknown == OCCUPIED:
            occupied |= uncertain
        return occupied, float(uncertain.mean())


def upright(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells (nx, ny) with y upwards, from rows (ny, nx) of which the first is at the top."""
    return np.ascontiguousarray(rows[::-1].T)


def check_count(file: str | Path, shape: Iterable[int]) -> None:
    """Refuses a grid of no or too many cells, before it is read.

    Raises:
        InputError: it is such.
    """
    sides = [int(side) for side in shape]
    size = " x ".join(map(str, sides))
    if min(sides, default=0) < 1:
        raise InputError(f"{file}: a map of {size or 'no'} cells is empty")
    if prod(sides) > MOST_CELLS:
        raise InputError(
            f"{file}: a map of {size} cells is too large (at most {MOST_CELLS} in all); scale it "
            "down, or cut out a part"
        )


Reader = Callable[[Path, str], Cells]
"""(file, what cells count as that are not known) -> what is in it."""
