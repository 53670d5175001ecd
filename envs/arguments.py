"""The text form of entries, `name:key=value,key=value`, and arguments in their types."""

from __future__ import annotations

import inspect
from collections.abc import Collection, Mapping
from types import NoneType, UnionType
from typing import Any, get_args, get_type_hints

from envs.errors import InputError, suggestion


def parsed_arguments(text: str, rest: str) -> dict[str, str]:
    """The keys and values of "key=value,..."; `text` is the whole, for messages.

    Raises:
        InputError: it is malformed.
    """
    chosen: dict[str, str] = {}
    for item in filter(None, rest.split(",")):
        key, equals, value = item.partition("=")
        if not (equals and key and value):
            raise InputError(f"{text!r}: {item!r} is not of the form key=value")
        if key in chosen:
            raise InputError(f"{text!r}: {key!r} is given twice")
        chosen[key] = value
    return chosen


def split_entries(text: str) -> list[str]:
    """Splits at the commas between entries, not at those between an entry's arguments.

    A part with "=" but no ":" before it goes on with the entry before.
    """
    parts: list[str] = []
    for token in (t.strip() for t in text.split(",")):
        before_equals, equals, _ = token.partition("=")
        if equals and ":" not in before_equals and parts:
            parts[-1] += ("," if ":" in parts[-1] else ":") + token
        elif token:
            parts.append(token)
    return parts


def typed_arguments(
    id: str, loaded: type, fixed: Collection[str], chosen: Mapping[str, str]
) -> dict[str, Any]:
    """`chosen` in the types of the annotations of a class's constructor, without what equals a
    default.

    Args:
        id: of what is made, for messages.
        fixed: names of arguments that nobody may choose.

    Raises:
        InputError: a name or a value does not fit.
    """
    constructor = loaded.__init__  # type: ignore[misc]
    hints = _hints(constructor, id)
    parameters = inspect.signature(constructor).parameters
    named = [
        p.name
        for p in list(parameters.values())[1:]
        if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in fixed
    ]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    typed: dict[str, Any] = {}
    for key, text in chosen.items():
        if key not in named and (key in fixed or key in parameters or not takes_any):
            raise InputError(f"{id} has no argument {key!r}; {suggestion(key, named)}")
        value = _typed(text, hints.get(key) if key in named else None, f"{id}:{key}")
        if key not in named or value != parameters[key].default:
            typed[key] = value
    return typed


def _hints(constructor: Any, id: str) -> dict[str, Any]:
    try:
        return get_type_hints(constructor)
    except NameError as error:  # of a type that is imported for type checkers only
        raise InputError(f"{id}: the types of its arguments cannot be read: {error}") from error


def _typed(text: str, hint: Any, what: str) -> Any:
    if hint is None:
        return text
    hint = _without_none(hint)
    try:
        if hint is bool:
            return _TRUTH[text.lower()]
        if hint is float:
            value = float(text)
            if value != value:
                raise ValueError("not a number")
            return value
        if hint is int:
            return int(text)
    except (ValueError, KeyError):
        more = "; say true or false" if hint is bool else ""
        raise InputError(f"{what}={text}: {text!r} is not of type {hint.__name__}{more}") from None
    return text


_TRUTH = {
    **dict.fromkeys(("true", "1", "on", "yes"), True),
    **dict.fromkeys(("false", "0", "off", "no"), False),
}


def _without_none(hint: Any) -> Any:
    """The type in "type | None", which a person cannot ask for but by leaving the argument out."""
    named = [one for one in get_args(hint) if one is not NoneType]
    return named[0] if isinstance(hint, UnionType) and len(named) == 1 else hint
