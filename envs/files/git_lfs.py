"""Files that only stand for others, which Git LFS has."""

from __future__ import annotations

from pathlib import Path

from envs.errors import InputError, input_error_of

_BEGINS = b"version https://git-lfs.github.com/spec/"


def check_is_no_pointer(content: bytes) -> None:
    """Raises InputError if a file's content is what Git keeps in place of one that is in Git LFS.
    Does not name the file."""
    if content.startswith(_BEGINS):
        raise InputError(
            "it is a pointer to a file in Git LFS; get that by `git lfs pull` in its folder, or "
            "download it from its page"
        )


def check_file_is_no_pointer(file: Path) -> None:
    """The same of a file that need not be read whole for that. Names it.

    Raises:
        InputError: it is one, or cannot be read.
    """
    with input_error_of(f"{file} cannot be read"), file.open("rb") as opened:
        begins = opened.read(len(_BEGINS))
    try:
        check_is_no_pointer(begins)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
