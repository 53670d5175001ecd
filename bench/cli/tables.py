"""Tables in text, cut to what a terminal has room for."""

from __future__ import annotations

import re
from itertools import groupby

_CELLS = re.compile(r"(?<!\\)\|")
_KEPT = 2  # columns that say what a row is about

_ALWAYS = ("verdict",)
"""Titles of columns that are what a table is for."""

_FIRST = ("blocked: ", "offline ", "problems")
"""How the titles of columns begin that are left out before others."""


def fitted(text: str, width: int) -> str:
    """Text in which every Markdown table is at most so many characters wide, as far as leaving out
    columns makes it so: details first, then from the right on, but for the first two and the
    verdict. A line below a table names what was left out."""
    parts = []
    for is_table, lines in groupby(text.split("\n"), key=lambda line: line.startswith("|")):
        block = list(lines)
        parts += _fitted(block, width) if is_table and len(block) > 1 else block
    return "\n".join(parts)


def _fitted(lines: list[str], width: int) -> list[str]:
    rows = [_CELLS.split(line)[1:-1] for line in lines]
    columns = list(zip(*rows, strict=False))
    titles = [cells[0].strip() for cells in columns]
    shown = list(range(len(columns)))
    order = sorted(range(_KEPT, len(columns)), key=lambda i: (not titles[i].startswith(_FIRST), -i))
    for column in order:
        if 1 + sum(len(columns[i][0]) + 1 for i in shown) <= width:
            break
        if titles[column] not in _ALWAYS:
            shown.remove(column)
    left_out = [title for i, title in enumerate(titles) if i not in shown]
    if not left_out:
        return lines
    kept = ["|" + "|".join(row[i] for i in shown) + "|" for row in rows]
    return [*kept, "", f"Not shown, as the terminal is narrow (--wide): {', '.join(left_out)}."]
