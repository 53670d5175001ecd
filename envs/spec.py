"""How something that a registry knows is made: data, whose class is imported when it is made."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from envs.errors import InputError, brief
from envs.loading import load_class


@dataclass(frozen=True)
class Spec:
    """How something is made: `entry_point` is "module:Class" or "/folder/file.py:Class", called
    with `arguments`.

    `version` rises whenever results would no longer compare with earlier ones. `groups` are names
    under which several are chosen together ("paper"); "all" has those with `in_all`. `without`
    maps an argument to the id of the spec that is meant where the argument is not given: a stand-in
    under its own name. `not_repeatable` is why a planner's path may differ although its seed is
    the same and no clock cuts it short. `origin` is where a spec of somebody else's is from, a
    distribution or a file; it is empty for our own.
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
    not_repeatable: str = ""
    origin: str = ""

    def load(self) -> type:
        """The class.

        Raises:
            InputError: it cannot be imported.
        """
        try:
            return load_class(self.entry_point)
        except InputError as error:
            raise InputError(f"{self.id!r} cannot be loaded: {error}") from error

    @property
    def data(self) -> dict[str, Any]:
        """JSON data of which `of` makes the same spec, in whatever process."""
        return {
            name: dict(value) if isinstance(value, Mapping) else value
            for name, value in vars(self).items()
        }

    @staticmethod
    def of(data: Mapping[str, Any]) -> Spec:
        """The spec that `data` is of.

        Raises:
            TypeError: it is of none.
        """
        fields: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
        return Spec(**fields)


_TYPES = {
    "id": str,
    "entry_point": str,
    "description": str,
    "arguments": Mapping,
    "version": int,
    "aliases": tuple,
    "groups": tuple,
    "in_all": bool,
    "without": Mapping,
    "not_repeatable": str,
    "origin": str,
}


def check_form(kind: str, spec: Spec) -> None:
    """Looks whether a spec is well formed.

    Args:
        kind: what it is a spec of, for messages ("planner").

    Raises:
        InputError: one of its names is not well formed.
        TypeError: one of its fields is of another type.
    """
    for name, wanted in _TYPES.items():
        value = getattr(spec, name)
        if not isinstance(value, wanted):
            raise TypeError(f"{name} is {brief(value)}, not a {wanted.__name__}")
    for name in (spec.id, *spec.aliases):
        if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z0-9_.*+-]+", name):
            raise InputError(f"{brief(name)} is not a well-formed {kind} name")
