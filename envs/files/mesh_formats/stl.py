"""STL, as text or binary."""

from __future__ import annotations

import struct
from pathlib import Path

from envs.files.mesh_formats.soup import Soup, check_not_coarse, read_triangles

_HEAD, _TRIANGLE = 84, 50  # bytes


def read(path: Path) -> Soup:
    """Triangles; several solids are taken as one.

    Raises:
        UnreadableError: its binary coordinates are too coarse.
    """
    soup = read_triangles(path)
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if len(head) == _HEAD:
        (count,) = struct.unpack_from("<I", head, _HEAD - 4)
        if path.stat().st_size == _HEAD + _TRIANGLE * count:
            check_not_coarse(soup.vertices)
    return soup
