"""Registries of planners and environments: specs are data, classes are imported when made.

A registry knows its own specs and those that other installed packages announce as entry points:
plug-ins, whose classes are imported when they are asked for. One that is broken is named in a
warning and left out of groups; asked for by name it is an error. `name:key=value,key=value` is the
text form of an entry.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Generic, TypeVar

from envs.errors import GroupNameError, InputError, UnknownNameError, reason
from envs.registry.arguments import (
    alternatives,
    argument_text,
    comma_hint,
    parsed_arguments,
    split_entries,
    typed_arguments,
)
from envs.registry.plugins import PlugIns
from envs.registry.spec import Spec, check_form
from envs.registry.text_values import text_of

__all__ = ["Entry", "Registry", "Spec"]

T = TypeVar("T")


@dataclass(frozen=True)
class Entry(Generic[T]):
    """A spec with the arguments that somebody chose, typed and checked."""

    spec: Spec
    arguments: Mapping[str, Any]

    @property
    def id(self) -> str:
        """The canonical id, with the arguments that differ from their defaults, sorted."""
        if not self.arguments:
            return self.spec.id
        return f"{self.spec.id}:{argument_text(self.arguments)}"

    @property
    def description(self) -> dict[str, Any]:
        """JSON data of which `described` makes the same entry, in whatever process."""
        return {
            "id": self.spec.id,
            "entry_point": self.spec.entry_point,
            "fixed": dict(self.spec.arguments),
            "chosen": {key: text_of(value) for key, value in self.arguments.items()},
        }

    @staticmethod
    def described(description: Mapping[str, Any]) -> Entry[Any]:
        """The entry that a `description` is of.

        Raises:
            InputError: its class cannot be imported, or is not what it was.
        """
        id, fixed = description["id"], description["fixed"]
        spec = Spec(id, description["entry_point"], "", fixed)
        return Entry(spec, typed_arguments(id, spec.load(), fixed, description["chosen"]))

    def imported(self) -> Entry[T]:
        """The same, its class imported into this process, where another one looked at it so far
        and has given the arguments as texts.

        Raises:
            InputError: its class cannot be imported, or is not what it was.
        """
        described: Entry[T] = Entry.described(self.description)
        return Entry(self.spec, described.arguments)

    def make(self) -> T:
        """A new instance.

        Raises:
            InputError: the arguments do not fit, or a stranger's class fails in any way.
        """
        made: T
        try:
            made = self.spec.load()(**{**self.spec.arguments, **self.arguments})
        except InputError:
            raise
        except (Exception, SystemExit) as error:
            if not self.spec.origin:
                raise
            raise InputError(f"{self.id} cannot be made: {reason(error)}") from error
        return made


class Registry(Generic[T]):
    """Specs by name.

    Args:
        kind: what it holds, for messages ("planner").
        specs: its own, in the order in which they are listed.
        entry_point_group: under which other packages announce more; each loads to a `Spec`.
        base: what their classes must be subclasses of, or its entry point.
        of_files: by how a file's name ends, what to write to have one of what the file holds, with
            `{}` for its name: who gives a file in place of a name is told so.

    Attributes:
        plugins: who looks at what others add.
    """

    def __init__(
        self,
        kind: str,
        specs: Iterable[Spec],
        entry_point_group: str,
        base: type | str = object,
        of_files: Mapping[str, str] | None = None,
    ) -> None:
        self.kind = kind
        self.plugins = PlugIns(kind, entry_point_group, base)
        self._of_files = of_files or {}
        self._specs: dict[str, Spec] = {}
        self._announced: set[str] = set()
        self._plugins_read = False
        for spec in specs:
            self.register(spec)

    def register(self, spec: Spec) -> None:
        """Adds a spec.

        Raises:
            InputError: its id or an alias is taken or not well formed.
        """
        check_form(self.kind, spec)
        groups = {group for known in self._specs.values() for group in known.groups}
        for name in (spec.id, *spec.aliases):
            if name == "all" or name in groups or name in self._names():
                theirs = f", so {spec.origin} cannot add it: give it another id"
                whose = theirs if spec.origin else ""
                raise InputError(f"there is a {self.kind} called {name!r} already{whose}")
        self._specs[spec.id] = spec

    def unregister(self, id: str) -> None:
        """Takes a spec out again."""
        del self._specs[id]

    def specs(self) -> list[Spec]:
        """All specs, the registry's own first.

        Raises:
            InputError: a plug-in has a name that is taken.
        """
        self._read_plugins()
        return list(self._specs.values())

    def known(self) -> list[Spec]:
        """The specs that are known so far: plug-ins that nobody has asked for are not looked at."""
        return list(self._specs.values())

    def group(self, name: str) -> list[Spec]:
        """The specs of a group; "all" has every spec that does not keep out of it."""
        if name == "all":
            return [spec for spec in self.specs() if spec.in_all]
        return [spec for spec in self.specs() if name in spec.groups]

    def _groups(self) -> set[str]:
        return {"all", *(group for spec in self.specs() for group in spec.groups)}

    def entries(
        self, text: str, wanted: Callable[[Entry[T]], bool] = lambda entry: True
    ) -> list[Entry[T]]:
        """What a comma-separated text names: "c3d,c3d:scene=1,boxes=20" is two entries.

        "rrtstar:range=1|2" is two as well. Each entry is listed once. A group stands for those of
        its members that are `wanted`, without plug-ins that are broken.

        Raises:
            InputError: a name or an argument is unknown or malformed.
        """
        found: dict[str, Entry[T]] = {}
        for part in split_entries(text):
            members = [] if part in self._names() else self.group(part)
            one_by_one = (self._part(one, text) for one in alternatives(part))
            chosen = self._wanted(members, wanted) if members else one_by_one
            found.update((entry.id, entry) for entry in chosen)
        if not found:
            raise InputError(f"no {self.kind} named; choose from: {', '.join(self._names())}")
        return list(found.values())

    def _part(self, part: str, text: str) -> Entry[T]:
        try:
            return self._named(part, self._groups())
        except UnknownNameError as error:
            raise InputError(f"{error}{comma_hint(text, part)}") from error

    def _wanted(
        self, members: Iterable[Spec], wanted: Callable[[Entry[T]], bool]
    ) -> Iterator[Entry[T]]:
        for spec in members:
            entry = Entry[T](spec, {})
            try:
                self._check_class(spec)
                if wanted(entry):
                    yield entry
            except (Exception, SystemExit) as error:
                if spec.id not in self._announced:
                    raise
                self.plugins.skip(f"{spec.id!r} of {spec.origin}", error)

    def entry(self, text: str) -> Entry[T]:
        """What "name" or "name:key=value,..." names.

        Raises:
            InputError: the name or an argument is unknown or malformed, or a stranger's class
                cannot be loaded or is of another kind.
        """
        return self._named(text, may_be_group=())

    def _named(self, text: str, may_be_group: Iterable[str]) -> Entry[T]:
        """See `entry`; to a misspelt name these groups may be near, too."""
        name, _, rest = text.partition(":")
        self._read_plugins()
        names = self._names()
        if name not in names:
            if name in self._groups():
                raise GroupNameError(self.kind, name, [spec.id for spec in self.group(name)])
            instead = self._of_files.get(PurePath(name).suffix.lower(), "").format(name)
            raise UnknownNameError(self.kind, name, [*names, *may_be_group], instead)
        spec = names[name]
        chosen = parsed_arguments(text, rest)
        for key, stand_in in spec.without.items():
            if key not in chosen:
                return self._of_stand_in(names[stand_in], chosen, f"{name} without {key}=")
        return self._entry(spec, chosen)

    def _of_stand_in(self, spec: Spec, chosen: Mapping[str, str], meant: str) -> Entry[T]:
        try:
            return self._entry(spec, chosen)
        except InputError as error:
            raise InputError(f"{error} ({meant} is {spec.id})") from error

    def id_among(self, text: str, known: Collection[str]) -> str:
        """The canonical id of what `text` names; or `text` as it stands, where `known`, ids of some
        record, has it so or it is not registered, which a record's ids may no longer be either.

        Raises:
            InputError: its arguments do not fit.
        """
        if text in known:
            return text
        try:
            return self.entry(text).id
        except UnknownNameError:
            return text

    def ids_among(self, text: str, known: Collection[str]) -> list[str]:
        """The ids that a comma-separated text names, each as in `id_among`; of a group, those of
        its members that are known, and of "all" all that are.

        Raises:
            InputError: arguments do not fit.
        """
        found: dict[str, None] = {}
        for part in split_entries(text):
            members = () if part in self._names() else {spec.id for spec in self.group(part)}
            ids = [id for id in known if part == "all" or id in members]
            found.update(dict.fromkeys(ids or [self.id_among(part, known)]))
        return list(found)

    def _entry(self, spec: Spec, chosen: Mapping[str, str]) -> Entry[T]:
        self._check_class(spec)
        if not chosen:
            return Entry(spec, {})
        if spec.origin:
            return Entry(spec, self.plugins.typed(spec, chosen))
        return Entry(spec, typed_arguments(spec.id, spec.load(), spec.arguments, chosen))

    def _check_class(self, spec: Spec) -> None:
        """Of a stranger's spec: our own classes are imported when they are made."""
        if spec.origin:
            self.plugins.check(spec)

    def make(self, text: str) -> T:
        """A new instance of what `text` names. See `entry`."""
        return self.entry(text).make()

    def _names(self) -> dict[str, Spec]:
        return {name: s for s in self._specs.values() for name in (s.id, *s.aliases)}

    def _read_plugins(self) -> None:
        if self._plugins_read:
            return
        without = dict(self._specs)
        try:
            for spec in self.plugins.of_packages():
                self.register(spec)
        except InputError:
            self._specs = without  # so that the next call says the same
            raise
        self._announced = self._specs.keys() - without.keys()
        self._plugins_read = True
