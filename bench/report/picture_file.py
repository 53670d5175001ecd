"""Files of pictures."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from envs import InputError

_DPI = 150


def save(figure: Figure, file: Path) -> None:
    """Writes a picture.

    Raises:
        InputError: the file cannot be written as an image.
    """
    try:
        figure.savefig(file, dpi=_DPI)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write {file}: {error}") from error
