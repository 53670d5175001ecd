"""Registries of planners and environments: specs are data, classes are imported when made.

A registry knows its own specs and those that other installed packages announce as entry points.
`name:key=value,key=value` is the text form of an entry.
"""

from __future__ import annotations

import importlib
import inspect
import logging
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from types import NoneType, UnionType
from typing import Any, Generic, TypeVar, get_args, get_type_hints

from envs.errors import InputError, UnknownNameError, suggestion

logger = logging.getLogger(__name__)
T = TypeVar("T")


@dataclass(frozen=True)
class Spec:
    """How something is made: `entry_point` is "module:Class", called with `arguments`.

    `version` rises whenever results would no longer compare with earlier ones. `groups` are names
    under which several are chosen together ("paper"); "all" has those with `in_all`. `without`
    maps an argument to the id of the spec that is meant where the argument is not given: a stand-in
    under its own name.
    """

    id: str
    entry_point: str
    description: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    version: int = 1
    aliases: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    in_all: bool = True
    without: Mapping[str, str] = field(default_factory=dict)

    def load(self) -> type:
        """The class.

        Raises:
            InputError: it cannot be imported.
        """
        module, _, name = self.entry_point.partition(":")
        try:
            loaded: type = getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError) as error:
            raise InputError(f"{self.id!r} cannot be loaded: {error}") from error
        return loaded


@dataclass(frozen=True)
class Entry(Generic[T]):
    """A spec with the arguments that somebody chose, typed and checked."""

    spec: Spec
    arguments: Mapping[str, Any]

    @property
    def id(self) -> str:
        """The canonical id: with the arguments that differ from their defaults, sorted."""
        if not self.arguments:
            return self.spec.id
        return f"{self.spec.id}:" + ",".join(f"{k}={v}" for k, v in sorted(self.arguments.items()))

    def make(self) -> T:
        """A new instance.

        Raises:
            InputError: the arguments do not fit.
        """
        made: T = self.spec.load()(**{**self.spec.arguments, **self.arguments})
        return made


class Registry(Generic[T]):
    """Specs by name.

    Args:
        kind: what it holds, for messages ("planner").
        specs: its own, in the order in which they are listed.
        entry_point_group: under which other packages announce more; each loads to a `Spec`.
    """

    def __init__(self, kind: str, specs: Iterable[Spec], entry_point_group: str) -> None:
        self.kind = kind
        self._group = entry_point_group
        self._specs: dict[str, Spec] = {}
        self._plugins_read = False
        for spec in specs:
            self.register(spec)

    def register(self, spec: Spec) -> None:
        """Adds a spec.

        Raises:
            InputError: its id or an alias is taken or not well formed.
        """
        for name in (spec.id, *spec.aliases):
            if not re.fullmatch(r"[A-Za-z0-9_.*+-]+", name):
                raise InputError(f"{name!r} is not a well-formed {self.kind} name")
            if name == "all" or name in self._names():
                raise InputError(f"there is a {self.kind} called {name!r} already")
        self._specs[spec.id] = spec

    def unregister(self, id: str) -> None:
        """Takes a spec out again."""
        del self._specs[id]

    def specs(self) -> list[Spec]:
        """All specs, the registry's own first."""
        self._read_plugins()
        return list(self._specs.values())

    def group(self, name: str) -> list[Spec]:
        """The specs of a group; "all" has every spec that does not keep out of it."""
        if name == "all":
            return [spec for spec in self.specs() if spec.in_all]
        return [spec for spec in self.specs() if name in spec.groups]

    def entries(
        self, text: str, wanted: Callable[[Entry[T]], bool] = lambda entry: True
    ) -> list[Entry[T]]:
        """What a comma-separated text names: "c3d,c3d:scene=1,boxes=20" is two entries.

        Each entry is listed once. A group stands for those of its members that are `wanted`.

        Raises:
            InputError: a name or an argument is unknown or malformed.
        """
        found: dict[str, Entry[T]] = {}
        for part in split_entries(text):
            members = [] if part in self._names() else self.group(part)
            chosen = [e for e in (Entry[T](spec, {}) for spec in members) if wanted(e)]
            if not members:
                chosen = [self.entry(part)]
            found.update((entry.id, entry) for entry in chosen)
        if not found:
            raise InputError(f"no {self.kind} named; choose from: {', '.join(self._names())}")
        return list(found.values())

    def entry(self, text: str) -> Entry[T]:
        """What "name" or "name:key=value,..." names.

        Raises:
            InputError: the name or an argument is unknown or malformed.
        """
        name, _, rest = text.partition(":")
        self._read_plugins()
        names = self._names()
        if name not in names:
            groups = {group for spec in self.specs() for group in spec.groups}
            raise UnknownNameError(self.kind, name, [*names, *groups, "all"])
        spec = names[name]
        chosen = _arguments(text, rest)
        for key, stand_in in spec.without.items():
            if key not in chosen:
                return self._of_stand_in(names[stand_in], chosen, f"{name} without {key}=")
        return Entry(spec, _typed_arguments(spec, chosen))

    def _of_stand_in(self, spec: Spec, chosen: Mapping[str, str], meant: str) -> Entry[T]:
        try:
            return Entry(spec, _typed_arguments(spec, chosen))
        except InputError as error:
            raise InputError(f"{error} ({meant} is {spec.id})") from error

    def make(self, text: str) -> T:
        """A new instance of what `text` names. See `entry`."""
        return self.entry(text).make()

    def _names(self) -> dict[str, Spec]:
        return {name: s for s in self._specs.values() for name in (s.id, *s.aliases)}

    def _read_plugins(self) -> None:
        if self._plugins_read:
            return
        self._plugins_read = True
        for point in entry_points(group=self._group):
            self._register_plugin(point)

    def _register_plugin(self, point: EntryPoint) -> None:
        try:
            spec = point.load()
            if not isinstance(spec, Spec):
                raise TypeError(f"{point.value} is a {type(spec).__name__}, not a Spec")
            self.register(spec)
        except Exception as error:  # noqa: BLE001  a stranger's package may fail in any way
            logger.warning("%s plug-in %r is skipped: %s", self.kind, point.name, error)


def _arguments(text: str, rest: str) -> dict[str, str]:
    """The keys and values of "key=value,..."; `text` is the whole, for messages."""
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


def _typed_arguments(spec: Spec, chosen: Mapping[str, str]) -> dict[str, Any]:
    """`chosen` in the types of the constructor's annotations, without what equals a default."""
    if not chosen:
        return {}
    constructor = spec.load().__init__  # type: ignore[misc]
    hints = get_type_hints(constructor)
    parameters = inspect.signature(constructor).parameters
    named = [
        p.name
        for p in list(parameters.values())[1:]
        if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and p.name not in spec.arguments
    ]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    typed: dict[str, Any] = {}
    for key, text in chosen.items():
        if key not in named and (key in spec.arguments or not takes_any):
            raise InputError(f"{spec.id} has no argument {key!r}; {suggestion(key, named)}")
        value = _typed(text, hints.get(key) if key in named else None, f"{spec.id}:{key}")
        if key not in named or value != parameters[key].default:
            typed[key] = value
    return typed


def _typed(text: str, hint: Any, what: str) -> Any:
    if hint is None:
        return text
    hint = _without_none(hint)
    try:
        if hint is bool:
            return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
        if hint is float:
            value = float(text)
            if value != value:
                raise ValueError("not a number")
            return value
        if hint is int:
            return int(text)
    except (ValueError, KeyError):
        raise InputError(f"{what}={text}: {text!r} is not of type {hint.__name__}") from None
    return text


def _without_none(hint: Any) -> Any:
    """The type in "type | None", which a person cannot ask for but by leaving the argument out."""
    named = [one for one in get_args(hint) if one is not NoneType]
    return named[0] if isinstance(hint, UnionType) and len(named) == 1 else hint
