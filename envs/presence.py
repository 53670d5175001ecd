"""Whether something is there, for names from outside, which may be such as no file can have."""

from __future__ import annotations

from collections.abc import Callable


def is_there(look: Callable[[], bool]) -> bool:
    """What `look`, a method of `Path` such as `is_file`, says; False where it cannot say, as of a
    name that is too long or in a folder that nobody may look into."""
    try:
        return look()
    except OSError:
        return False
