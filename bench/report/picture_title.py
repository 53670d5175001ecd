"""What stands above pictures of environments."""

from __future__ import annotations

import re

from bench.report.chosen_paths import Shown

_JOINTS = r"(?<=/)|(?<=:)(?=\w+=)|(?<=,)(?=\s*[A-Za-z]\w*[= ])"
"""Where names may be parted: after a slash, and before an argument's name or further words."""

_WIDTH = 0.65
"""Of a character, by the font's size: more than nearly all are."""


def picture_title(name: str, shown: Shown | None, inches: float, points: float) -> str:
    """The name of an environment, and the problem whose paths are shown, in lines that fit into a
    picture.

    Args:
        inches: the width of the picture.
        points: the size of the font.
    """
    whole = name if shown is None else f"{name}, problem {shown.problem}"
    return in_lines(whole, int(72 * inches / (_WIDTH * points)))


def in_lines(text: str, most: int) -> str:
    """A text in lines of at most so many characters, parted between arguments and folders, or
    wherever one of these is longer."""
    lines = [""]
    for piece in re.split(_JOINTS, text):
        if len(lines[-1] + piece) > most:
            lines.append("")
        piece = piece if lines[-1] else piece.lstrip()
        while len(piece) > most:
            lines[-1], piece = piece[:most], piece[most:]
            lines.append("")
        lines[-1] += piece
    return "\n".join(filter(None, lines))
