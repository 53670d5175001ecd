"""Grey images of occupancy: dark is occupied, as `map_server` of ROS has it."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from envs.errors import InputError, reason
from envs.files.map_formats.cells import Cells, Thresholds, check_count, upright
from envs.problem import Array

FORMATS = ("PPM", "PNG", "BMP")
"""Pillow's names; the first is that of PGM, too."""

DEFAULT_RESOLUTION = 0.05
"""Metres a pixel: what `slam_toolbox`, `gmapping` and `cartographer` make maps with."""

_DEEP = ("I", "I;16", "I;16B", "I;16L", "I;16N")
"""Pillow's modes of images with 16 bits a pixel."""

_BROKEN = (
    *(OSError, ValueError, SyntaxError, EOFError, struct.error, zlib.error),
    *(KeyError, IndexError, TypeError, OverflowError, Image.DecompressionBombError),
)
"""What Pillow raises of files that are none of its formats, or end too early."""


def read(file: Path, unknown: str) -> Cells:
    """An image without a YAML file: black is occupied, white is free, and shades between the
    thresholds of `map_server` are not known.

    Raises:
        InputError: it is no image, one of colours, or too large.
    """
    occupied, share = Thresholds().occupancy(darkness(file), unknown)
    return Cells(upright(occupied), default_resolution=DEFAULT_RESOLUTION, unknown=share)


def darkness(file: Path, negate: bool = False) -> Array:
    """How dark the pixels are, (rows, columns) from 0 (white) to 1 (black), the first row at the
    top; NaN where the image is transparent.

    Args:
        negate: whether light is occupied instead, and how light they are is told.

    Raises:
        InputError: see `read`.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of its size, which is looked at here
            with Image.open(file, formats=FORMATS) as image:
                check_count(file, image.size)
                shades, opaque = _shades(image, file)
    except UnidentifiedImageError:
        raise InputError(f"{file} is no image in PGM, PNG or BMP") from None
    except InputError:
        raise
    except _BROKEN as error:
        raise InputError(f"cannot read {file}: {reason(error)}") from error
    found = shades if negate else 1 - shades
    return np.where(opaque, found, np.nan)


def _shades(image: Image.Image, file: Path) -> tuple[Array, NDArray[np.bool_]]:
    """From 0 (black) to 1 (white), and where the image is not transparent."""
    if image.mode in _DEEP:
        deep = np.asarray(image.convert("I"), dtype=np.float64) / 65535
        return deep, np.ones(deep.shape, dtype=np.bool_)
    colours = np.asarray(image.convert("RGBA"))
    red, green, blue, opacity = np.moveaxis(colours, -1, 0)
    coloured = (red != green) | (green != blue)
    if coloured.any():
        row, column = np.argwhere(coloured)[0].tolist()
        raise InputError(
            f"{file} is an image of colours (row {row + 1}, column {column + 1}); a map is grey: "
            "dark where it is occupied"
        )
    return red / 255, opacity == 255
