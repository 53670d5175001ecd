"""What is printed. Names and messages of strangers may hold what moves a terminal's cursor, renames
its window or hides text; not every terminal can show every character; and tables are cut to what
one has room for.
"""

from __future__ import annotations

import logging
import re
import shutil
import sys
from itertools import groupby
from typing import TextIO

from envs.errors import printable


def tell(text: str) -> None:
    """Prints lines, with what does not print in them written as in Python's literals."""
    print(_lines(text))


def tell_tables(text: str, *, wide: bool) -> None:
    """Prints lines with tables in them: on a terminal as much of each as it has room for, unless
    all is wanted; elsewhere all."""
    if wide or not sys.stdout.isatty():
        tell(text)
    else:
        tell(fitted(text, shutil.get_terminal_size().columns))


def note(text: str) -> None:
    """The same on standard error: what is not the result itself."""
    print(_lines(text), file=sys.stderr)


def prepare() -> None:
    """Has log lines go to standard error, checked as the others are, and characters that standard
    output cannot show written as in Python's literals, which it would otherwise fail at."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Formatter("%(message)s"))
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    _take_all(sys.stdout)


def _take_all(stream: TextIO | None) -> None:
    reconfigure = getattr(stream, "reconfigure", None)  # whatever else stands in for a file
    if reconfigure is not None:
        reconfigure(errors="backslashreplace")


class _Formatter(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return _lines(super().format(record))


def _lines(text: str) -> str:
    return "\n".join(map(printable, text.split("\n")))


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
