"""The names of MotionBenchMaker's sets, which lists show without reading any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

_SHELVES = (
    *("table_pick", "table_under_pick", "box", "cage"),
    *("bookshelf_small", "bookshelf_tall", "bookshelf_thin"),
)
_BOTH_ARMS = tuple(f"bookshelf_tall_both_arms_{level}" for level in ("easy", "medium", "hard"))

SETS: Mapping[str, Sequence[str]] = {
    "panda": _SHELVES,
    "ur5": _SHELVES,
    "fetch": _SHELVES,
    "baxter": _BOTH_ARMS,
}
"""By robot."""
