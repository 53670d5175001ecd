"""Errors a user can cause and mend, and what is said of input that is not quite as it may seem.

InputError                  one clear line: what was wrong, what to do; the CLI exits with 2
└── UnknownNameError        a name no registry knows; suggests the nearest
"""

from __future__ import annotations

import difflib
import logging
import reprlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache

_MOST = 1000
"""Characters of a message; what is longer nobody reads."""


class InputError(ValueError):
    """Bad input from outside. The message is one line meant for a person.

    It may quote whatever came from outside: characters that do not print, such as line breaks and
    what moves a terminal's cursor, are written as in Python's literals, and the middle of a message
    of more than a thousand characters is left out.
    """

    def __init__(self, message: str) -> None:
        if len(message) > _MOST:
            message = f"{message[: _MOST // 2]} [...] {message[-_MOST // 2 :]}"
        super().__init__(printable(message))


def printable(text: str) -> str:
    """`text` in one line, what does not print in it written as in Python's literals."""
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text
    )


def is_text(name: str) -> bool:
    """Whether a name is text throughout, as tables and stores want it: Python has bytes in names
    of files that are not UTF-8 as halves of pairs of surrogates."""
    return not any("\ud800" <= c <= "\udfff" for c in name)


class UnknownNameError(InputError):
    """A name that is not among `known`; the message suggests the nearest ones, or says what to
    write `instead`."""

    def __init__(self, kind: str, name: str, known: Iterable[str], instead: str = "") -> None:
        super().__init__(f"unknown {kind} {name!r}; {instead or suggestion(name, known)}")


class GroupNameError(UnknownNameError):
    """A name of several where one is asked for."""

    def __init__(self, kind: str, name: str, members: Iterable[str]) -> None:
        InputError.__init__(
            self,
            f"{name!r} names several {kind}s, of which one is asked for here: {', '.join(members)}",
        )


def suggestion(name: object, known: Iterable[str]) -> str:
    """The nearest of `known` to a misspelt `name`, which may be anything from outside, or all of
    them where none is near."""
    names = sorted(known)
    text = name if isinstance(name, str) else brief(name)
    near = difflib.get_close_matches(text, names, n=2, cutoff=0.5)
    if near:
        return "did you mean " + " or ".join(repr(n) for n in near) + "?"
    return "choose from: " + ", ".join(names) if names else "there is nothing to choose from"


def brief(value: object) -> str:
    """A value from outside as Python writes it, shortened if it is long or deep."""
    try:
        return reprlib.repr(value)
    except ValueError:  # Python's, of an integer of thousands of digits
        return f"{type(value).__name__} with too many digits"


def reason(error: BaseException) -> str:
    """What another's exception says, in one line, with its type."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


@contextmanager
def input_error_of(what: str, *others: type[Exception]) -> Iterator[None]:
    """Turns the system's errors within, such as a full disk, into an `InputError`.

    Args:
        what: could not be done, as in "cannot write run/report.md".
        others: errors that mean the same.

    Raises:
        InputError: `what`, and what the system said, in words.
    """
    try:
        yield
    except OSError as error:
        named = error.filename is None or str(error.filename) in what
        where = "" if named else f": {error.filename}"
        raise InputError(f"{what}: {error.strerror or error}{where}") from error
    except others as error:
        raise InputError(f"{what}: {reason(error)}") from error


logger = logging.getLogger(__name__)


@cache
def tell_once(message: str) -> None:
    """Logs a line, once in a process, however often the same world is made."""
    logger.info(message)
