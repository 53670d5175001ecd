"""Files that only stand for others, which Git LFS has."""

from __future__ import annotations

from pathlib import Path

from envs.errors import InputError, input_error_of

_BEGINS = b"version https://git-lfs.github.com/spec/"


def check_is_no_pointer(file: Path) -> None:
    """Raises InputError if a file is what Git keeps in place of one that is in Git LFS, or cannot
    be read."""
    with input_error_of(f"{file} cannot be read"), file.open("rb") as opened:
        begins = opened.read(len(_BEGINS))
    if begins == _BEGINS:
        raise InputError(
            f"{file} is a pointer to a file in Git LFS; get that by `git lfs pull` in its folder, "
            "or download it from its page"
        )
