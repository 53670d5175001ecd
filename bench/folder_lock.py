"""One run at a time in a folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from envs import InputError


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Holds a folder, which is made if missing, for one run. However the process ends, the lock
    ends with it: it is the system's, on the folder itself, and leaves nothing behind.

    Raises:
        InputError: another run holds it, or it cannot be used.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise InputError(f"cannot use {folder} for a run: {error}") from error
    try:
        _lock(held, folder)
        yield
    finally:
        os.close(held)


def _lock(held: int, folder: Path) -> None:
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"another run is writing to {folder}; wait until it ends, or choose another --out"
        ) from None
    except OSError as error:
        raise InputError(f"{folder} cannot be locked for a run: {error}") from error
