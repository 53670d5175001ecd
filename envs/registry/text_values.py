"""Values as text: how a person writes one of a type, how it is read, and lists with quotes."""

from __future__ import annotations

import collections.abc as abc
import contextlib
import numbers
import os
import re
import typing
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import singledispatch
from pathlib import Path, PurePath
from types import NoneType, UnionType
from typing import Any, Literal, NewType, Union, get_args, get_origin

QUOTES = "\"'"

IN_QUOTES = r'"(?:[^"]|"")*"|' + r"'(?:[^']|'')*'"
"""Of a regular expression: text in quotes, where a quote within is written twice."""

_ITEM = re.compile(rf"\s*(?:{IN_QUOTES})?[^,]*")


def quoted(text: str) -> str:
    """`text`, in quotes if it has a comma or | in it, a quote first, space about it or nothing in
    it."""
    if text and text == text.strip() and not set(",|") & set(text) and text[0] not in QUOTES:
        return text
    quote = "'" if '"' in text and "'" not in text else '"'
    return quote + text.replace(quote, 2 * quote) + quote


def unquoted(text: str) -> str:
    """What `quoted` was given.

    Raises:
        ValueError: a quote is not closed, or not at the end; says so.
    """
    quote = text[:1]
    if not quote or quote not in QUOTES:
        return text
    if not re.fullmatch(IN_QUOTES, text):
        whole = quoted(text)
        raise ValueError(f"{text} begins with a quote that does not end it; or is it {whole}?")
    return text[1:-1].replace(2 * quote, quote)


def split(text: str, item: re.Pattern[str] = _ITEM) -> list[str]:
    """What is between the commas of a text, with the spaces about it: "" has one, empty item.

    Args:
        item: matches one, from any place up to the next comma or the end; by default one in
            which commas between quotes count as any other character.
    """
    found, at = [], 0
    while at <= len(text):
        match = item.match(text, at)
        assert match is not None
        found.append(match[0])
        at = match.end() + 1
    return found


@singledispatch
def text_of(value: object) -> str:
    """A value as `Kind.read` reads it."""
    return str(value)


@text_of.register
def _(value: Enum) -> str:
    return value.name


@text_of.register(list)
@text_of.register(tuple)
def _(value: Sequence[Any]) -> str:
    return ",".join(quoted(text_of(one)) for one in value)


@text_of.register(set)
@text_of.register(frozenset)
def _(value: abc.Set[Any]) -> str:
    return ",".join(sorted(quoted(text_of(one)) for one in value))


@dataclass(frozen=True)
class Kind:
    """How values of some type are written.

    Attributes:
        wanted: in words, as in "of type int", for messages.
        read: the value of a text; raises ValueError if there is none.
        choices: all texts there are, if there are few.
        rank: where several kinds may be meant, that of the least rank is.
        several: whether a value is a list of others, as a text with commas will be.
    """

    wanted: str
    read: Callable[[str], Any]
    choices: tuple[str, ...] = ()
    rank: int = 1
    several: bool = False


def kind_of(hint: Any) -> Kind:
    """The kind of what an annotation allows.

    Raises:
        TypeError: no text stands for a value of such a type.
    """
    alias = getattr(typing, "TypeAliasType", ())  # of Python 3.12
    if isinstance(hint, NewType):
        return kind_of(hint.__supertype__)
    if isinstance(hint, alias):
        return kind_of(hint.__value__)
    if hint in (Any, object):
        return _TEXT
    origin = get_origin(hint) or hint
    if origin in _COMPOUND:
        return _COMPOUND[origin](get_args(hint))
    if isinstance(origin, type):
        for base, make in _SIMPLE.items():
            if issubclass(origin, base):
                return make(origin)
    raise TypeError(f"no text stands for a {hint}")


def _text(cls: type) -> Kind:
    return Kind("a text", cls, rank=9)


_TEXT = _text(str)


def _flag(_: type) -> Kind:
    return Kind("of type bool; say true or false", _truth, rank=3)


_TRUTH = {
    **dict.fromkeys(("true", "1", "on", "yes"), True),
    **dict.fromkeys(("false", "0", "off", "no"), False),
}


def _truth(text: str) -> Any:
    return _value_of(_TRUTH, text.casefold())


def _none(_: type) -> Kind:
    return Kind("none", lambda text: _value_of({"none": None}, text.casefold()), ("none",), rank=0)


def _value_of(values: abc.Mapping[str, Any], text: str) -> Any:
    if text not in values:
        raise ValueError(text)
    return values[text]


_NUMBERS: dict[type, type] = {
    numbers.Integral: int,
    numbers.Rational: float,
    numbers.Real: float,
    numbers.Complex: complex,
    numbers.Number: float,
}
"""For abstract classes of numbers, one that can be made."""


def _number(cls: type) -> Kind:
    made: Any = _NUMBERS.get(cls, cls)

    def read(text: str) -> Any:
        try:
            value = made(text)
        except ArithmeticError as error:  # decimal.Decimal's, and of what overflows
            raise ValueError(text) from error
        if value != value:
            raise ValueError("not a number")
        return value

    return Kind(f"of type {made.__name__}", read, rank=1 if issubclass(made, int) else 2)


def _path(cls: type) -> Kind:
    return _text(cls if issubclass(cls, PurePath) else Path)


def _enum(cls: Any) -> Kind:
    names = dict(cls.__members__)
    return _one_of(tuple(names), {text_of(one.value): one for one in cls} | names)


def _literal(values: Sequence[Any]) -> Kind:
    found: dict[str, Any] = {}
    for value in reversed(values):  # of two that are written alike, the first is meant
        flags = [word for word, truth in _TRUTH.items() if truth is value]
        found.update(dict.fromkeys((*flags, text_of(value)), value))
    return _one_of(tuple(map(text_of, values)), found)


def _one_of(choices: tuple[str, ...], values: abc.Mapping[str, Any]) -> Kind:
    """`values` by their texts, not all of which need be among the `choices` that are told."""

    def read(text: str) -> Any:
        alike = {one for one in values if one.casefold() == text.casefold()}
        return values[alike.pop()] if len(alike) == 1 else _value_of(values, text)

    return Kind(f"one of {', '.join(choices)}", read, choices)


def _union(hints: Sequence[Any]) -> Kind:
    kinds = [kind for kind in map(_kind_or_none, hints) if kind is not None]
    if not kinds:
        raise TypeError("no text stands for a value of any of them")

    def read(text: str) -> Any:
        for kind in sorted(kinds, key=lambda kind: (kind.several and "," not in text, kind.rank)):
            with contextlib.suppress(ValueError):
                return kind.read(text)
        raise ValueError(text)

    choices = [kind.choices for kind in kinds]
    return Kind(
        " or ".join(kind.wanted for kind in kinds), read, sum(choices, ()) if all(choices) else ()
    )


def _kind_or_none(hint: Any) -> Kind | None:
    """Other members of a union may be written although this one may not."""
    try:
        return kind_of(hint)
    except TypeError:
        return None


def _several(make: Callable[[Iterable[Any]], Any]) -> Callable[[Sequence[Any]], Kind]:
    def kind(hints: Sequence[Any]) -> Kind:
        each = kind_of(hints[0]) if hints else _TEXT

        def read(text: str) -> Any:
            return make(each.read(item) for item in (_items(text) if text.strip() else ()))

        return Kind(f"values with {_COMMAS}, each {each.wanted}", read, rank=4, several=True)

    return kind


_COMMAS = "commas between and quotes about all of them"


def _items(text: str) -> list[str]:
    return [unquoted(item.strip()) for item in split(text)]


def _tuple(hints: Sequence[Any]) -> Kind:
    if not hints or hints[-1] is Ellipsis:
        return _several(tuple)(hints)
    kinds = [kind_of(hint) for hint in hints]

    def read(text: str) -> tuple[Any, ...]:
        return tuple(kind.read(item) for kind, item in zip(kinds, _items(text), strict=True))

    each = ", ".join(kind.wanted for kind in kinds)
    return Kind(f"{len(kinds)} values with {_COMMAS}: {each}", read, rank=4, several=True)


_COMPOUND: dict[Any, Callable[[Sequence[Any]], Kind]] = {
    Union: _union,
    UnionType: _union,
    Literal: _literal,
    tuple: _tuple,
    frozenset: _several(frozenset),
    **dict.fromkeys((set, abc.Set, abc.MutableSet), _several(set)),
    **dict.fromkeys(
        (list, abc.Sequence, abc.MutableSequence, abc.Collection, abc.Iterable), _several(list)
    ),
}
"""By what `typing.get_origin` has of an annotation."""

_SIMPLE: dict[type, Callable[[type], Kind]] = {
    bool: _flag,
    NoneType: _none,
    Enum: _enum,
    numbers.Number: _number,
    str: _text,
    os.PathLike: _path,
}
"""By a class that they are subclasses of, the first that fits."""
