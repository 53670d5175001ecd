"""Occupancy grids as NumPy writes them (`.npy`)."""

from __future__ import annotations

import zipfile
from pathlib import Path
from tokenize import TokenError

import numpy as np

from envs.errors import InputError, reason
from envs.files.map_formats.cells import Cells, Thresholds, check_count, upright
from envs.files.map_formats.image import DEFAULT_RESOLUTION

_BROKEN = (
    *(OSError, ValueError, EOFError, SyntaxError, TokenError, TypeError, OverflowError),
    *(MemoryError, RecursionError, zipfile.BadZipFile),
)
"""What NumPy raises of headers that are none."""


def read(file: Path, unknown: str) -> Cells:
    """An array of bool (True is occupied), of integers 0 and 1, or of probabilities of being
    occupied, to which the thresholds of `map_server` apply: of two dimensions (rows, columns), the
    first row at the top, or of three, (x, y, z) upwards.

    Raises:
        InputError: it is none.
    """
    try:
        array = np.load(file, mmap_mode="r", allow_pickle=False)
    except _BROKEN as error:
        raise InputError(f"cannot read {file}: {reason(error)}") from error
    if not isinstance(array, np.ndarray) or array.ndim not in (2, 3):
        found = f"{array.ndim} axes" if isinstance(array, np.ndarray) else "several arrays"
        raise InputError(f"{file}: a map has 2 or 3 axes, not {found}")
    check_count(file, array.shape)
    if array.dtype.kind not in "biuf":
        raise InputError(
            f"{file}: a map holds bool, 0 and 1, or probabilities, not {array.dtype.name}"
        )
    chances = np.array(array, dtype=np.float64)
    wrong = ~((chances >= 0) & (chances <= 1))
    if array.dtype.kind in "iu":
        wrong |= (chances != 0) & (chances != 1)
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0].tolist())
        wanted = "0 or 1" if array.dtype.kind in "iu" else "from 0 to 1"
        raise InputError(f"{file}: cells must be {wanted}, not {array[place]} as at {place}")
    occupied, share = Thresholds().occupancy(chances, unknown)
    cells = upright(occupied) if array.ndim == 2 else occupied
    return Cells(cells, default_resolution=DEFAULT_RESOLUTION, unknown=share)
