"""The names of robometrics' scenes, which lists show without reading any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

_WHENCE = ("neutral_goal", "neutral_start", "task_oriented")

SCENES: Mapping[str, Sequence[str]] = {
    "mb": (
        *("bookshelf_small_panda", "bookshelf_tall_panda", "bookshelf_thin_panda"),
        *("box_panda", "box_panda_flipped", "cage_panda"),
        *("table_pick_panda", "table_under_pick_panda"),
    ),
    "mpinets": tuple(
        f"{where}_{whence}"
        for where in ("cubby", "dresser", "merged_cubby", "tabletop")
        for whence in _WHENCE
    ),
}
"""By set."""
