"""Files that are replaced whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(file: Path) -> Iterator[Path]:
    """A path in the same folder to write to; what is there at the end takes the place of `file`.
    Where writing it fails, `file` stays as it was.

    Raises:
        OSError: it cannot be put in place.
    """
    part = file.with_name(f".{os.getpid()}.part.{file.name}")
    try:
        yield part
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
