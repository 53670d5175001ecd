"""What is printed. Names and messages of strangers may hold what moves a terminal's cursor, renames
its window or hides text; and not every terminal can show every character."""

from __future__ import annotations

import logging
import shutil
import sys
from typing import TextIO

from bench.cli.tables import fitted
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
