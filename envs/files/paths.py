"""Names of files that come from outside, and files that are replaced whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from envs.errors import InputError


def cache_folder() -> Path:
    """Where what is fetched, unpacked or trained is kept: the user's cache;
    `XDG_CACHE_HOME` is honoured."""
    return platformdirs.user_cache_path("plannerbench")


def exists(look: Callable[[], bool]) -> bool:
    """What `look`, a method of `Path` such as `is_file`, says; False where it cannot say, as of a
    name that is too long or in a folder that nobody may look into."""
    try:
        return look()
    except OSError:
        return False


def safe_join(folder: Path, name: str) -> Path:
    """The file that one in `folder` names, from there, at most one folder up ("../meshes/hand.stl",
    as packages are laid out).

    A file that comes from others shall not reach for whatever else is on a machine. Links are not
    followed to judge that: who made them may say what they lead to.

    Raises:
        InputError: it is elsewhere.
    """
    home = _without_ups(folder.absolute())
    path = Path(os.path.normpath(home / name))
    if not path.is_relative_to(home.parent) or _ups(name) > 1:
        raise InputError(
            f"{name} climbs out of the folder above {folder}; put it there and correct its name"
        )
    return path


def _without_ups(folder: Path) -> Path:
    """The same folder, called without "..". What stands before the last ".." is followed if it is a
    link, as the file system does: from a link, ".." leads to where the link's target is."""
    parts = folder.parts
    ups = max((at + 1 for at, part in enumerate(parts) if part == ".."), default=0)
    return Path(*parts[:ups]).resolve().joinpath(*parts[ups:])


def _ups(name: str) -> int:
    """How many folders up a relative name leads. At the root of a file system, all is within."""
    return 0 if Path(name).is_absolute() else Path(os.path.normpath(name)).parts.count("..")


@contextmanager
def atomic_write(file: Path) -> Iterator[Path]:
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
