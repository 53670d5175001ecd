"""The text form of entries, `name:key=value,key=value`, and arguments in their types.

A value with a comma in it, a quote first or space about it is in quotes, as in `file="a, b.obj"`; a
quote within is written twice.
"""

from __future__ import annotations

import inspect
import re
import shlex
from collections.abc import Collection, Mapping
from enum import Enum
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_type_hints

from envs.errors import InputError, is_text, reason, suggestion
from envs.registry.text_values import IN_QUOTES, kind_of, quoted, split, text_of, unquoted

_PIECE = re.compile(rf"[^,=]*(?:=\s*(?:{IN_QUOTES})?[^,]*)?")
"""What is between two commas, of which those in a quoted value are none."""


def parsed_arguments(text: str, rest: str) -> dict[str, str]:
    """The keys and values of "key=value,..."; `text` is the whole, for messages.

    Raises:
        InputError: it is malformed.
    """
    chosen: dict[str, str] = {}
    pieces = [piece for piece in split(rest, _PIECE) if piece.strip()]
    for number, piece in enumerate(pieces):
        key, equals, value = (part.strip() for part in piece.partition("="))
        if not (equals and key and value):
            hint = _comma_hint(pieces[number - 1], piece) if number else ""
            raise InputError(f"{text!r}: {piece.strip()!r} is not of the form key=value{hint}")
        if key in chosen:
            raise InputError(f"{text!r}: {key!r} is given twice")
        if not is_text(value):
            raise InputError(f"{text!r}: {key} holds bytes that are not UTF-8; rename that file")
        try:
            chosen[key] = unquoted(value)
        except ValueError as error:
            raise InputError(f"{text!r}: {key}: {error}") from None
    return chosen


def argument_text(arguments: Mapping[str, Any]) -> str:
    """What `parsed_arguments` and `typed_arguments` make the arguments of, sorted by keys."""
    return ",".join(f"{key}={quoted(text_of(arguments[key]))}" for key in sorted(arguments))


def split_entries(text: str) -> list[str]:
    """Splits at the commas between entries, not at those between an entry's arguments.

    A part with "=" but no ":" before it goes on with the entry before.
    """
    parts: list[str] = []
    for token in (piece.strip() for piece in split(text, _PIECE)):
        before_equals, equals, _ = token.partition("=")
        if equals and ":" not in before_equals and parts:
            parts[-1] += ("," if ":" in parts[-1] else ":") + token
        elif token:
            parts.append(token)
    return parts


def alternatives(part: str) -> list[str]:
    """The entries that one with values as in `range=0.5|1|2` stands for, in the order of the
    values; of several such arguments all combinations. A value in quotes is one.

    Example:
        >>> alternatives("rrtstar:goal_bias=0.1,range=1|2")
        ['rrtstar:goal_bias=0.1,range=1', 'rrtstar:goal_bias=0.1,range=2']
    """
    name, colon, rest = part.partition(":")
    pieces = [_values(piece) for piece in split(rest, _PIECE)]
    return [f"{name}{colon}{','.join(chosen)}" for chosen in product(*pieces)]


def _values(piece: str) -> list[str]:
    key, equals, value = piece.partition("=")
    if not equals or value.lstrip()[:1] in ('"', "'"):
        return [piece]
    return [f"{key}={one}" for one in value.split("|")]


def comma_hint(text: str, part: str) -> str:
    """What to add to a message if `part`, one of `split_entries(text)`, names nothing: perhaps it
    goes on with a value before it, with a comma in it."""
    pieces = [piece for piece in split(text, _PIECE) if piece.strip()]
    both = pairwise(pieces)
    hints = (_comma_hint(before, piece) for before, piece in both if part.startswith(piece.strip()))
    return next(hints, "")


def _comma_hint(before: str, piece: str) -> str:
    key, equals, value = before.partition("=")
    if not (equals and value.strip()):
        return ""
    whole = f"{key}={quoted(f'{value},{piece}'.strip())}".strip()
    return f"; a value with a comma in it is written in quotes, here {shlex.quote(whole)}"


def typed_arguments(
    id: str, loaded: type, fixed: Collection[str], chosen: Mapping[str, str]
) -> dict[str, Any]:
    """`chosen` in the types of the annotations of a class's constructor, without what equals a
    default. Where there is no annotation, the default's type is meant.

    Args:
        id: of what is made, for messages.
        fixed: names of arguments that nobody may choose.

    Raises:
        InputError: a name or a value does not fit.
    """
    constructor = loaded.__init__  # type: ignore[misc]
    parameters = inspect.signature(constructor).parameters
    named = [
        p.name
        for p in list(parameters.values())[1:]
        if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in fixed
    ]
    takes_any = constructor is not object.__init__ and any(
        p.kind is p.VAR_KEYWORD for p in parameters.values()
    )
    typed: dict[str, Any] = {}
    for key, text in chosen.items():
        if key not in named and (key in fixed or key in parameters or not takes_any):
            raise InputError(f"{id} has no argument {key!r}; {suggestion(key, named)}")
        if key not in named:
            typed[key] = text
            continue
        value = _typed(text, _hint(constructor, parameters[key], id), f"{id}:{key}")
        if not _same(value, parameters[key].default):
            typed[key] = value
    return typed


def _same(value: Any, default: Any) -> bool:
    """Whether a value is the default, perhaps in another type, as a list is for a tuple."""
    if default is inspect.Parameter.empty:
        return False
    same: Any = default == value  # perhaps an array of them
    return same is True or text_of(value) == text_of(default)


def _hint(constructor: Any, parameter: inspect.Parameter, id: str) -> Any:
    if parameter.annotation is parameter.empty:
        return _hint_of_default(parameter.default)
    alone = SimpleNamespace(__annotations__={"it": parameter.annotation})
    try:
        return get_type_hints(alone, inspect.unwrap(constructor).__globals__)["it"]
    except Exception as error:  # of a stranger's, such as a type imported for type checkers only
        raise InputError(
            f"{id}: the types of its arguments cannot be read: {parameter.name}: {reason(error)}"
        ) from error


def _hint_of_default(default: Any) -> Any:
    kind = type(default)
    if kind is int:
        return int | float
    return kind if issubclass(kind, bool | float | Enum | Path) else str


def _typed(text: str, hint: Any, what: str) -> Any:
    try:
        kind = kind_of(hint)
    except TypeError:
        name = getattr(hint, "__name__", hint)
        raise InputError(f"{what}: no text stands for a {name}; leave it out") from None
    try:
        return kind.read(text)
    except ValueError:
        wanted = f"none of its values; {suggestion(text, kind.choices)}"
        if not kind.choices:
            wanted = f"not {kind.wanted}"
        raise InputError(f"{what}={text}: {text!r} is {wanted}") from None
