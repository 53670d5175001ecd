"""How something that a registry knows is made: data, whose class is imported when it is made.

Classes go by name: "module:Class", or "folder/file.py:Class" for a file that nobody installed.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from envs.errors import InputError, brief, input_error_of, reason


@dataclass(frozen=True)
class Spec:
    """How something is made: `entry_point` is "module:Class" or "/folder/file.py:Class", called
    with `arguments`.

    `version` rises whenever results would no longer compare with earlier ones. `groups` are names
    under which several are chosen together ("paper"); "all" has those with `in_all`. `without`
    maps an argument to the id of the spec that is meant where the argument is not given: a stand-in
    under its own name. `not_repeatable` is why a planner's path may differ although its seed is
    the same and no clock cuts it short. `colour` is what it is drawn in, by Matplotlib's names; one
    is chosen where none is said. `reference` is how well a planner of ours serves as the one whose
    path lengths others are held to: of those above 0, the highest that can plan. `origin` is where
    a spec of somebody else's is from, a distribution or a file; it is empty for our own.
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
    colour: str = ""
    reference: int = 0
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
    "colour": str,
    "reference": int,
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
        check_name(kind, name)


def check_name(kind: str, name: object) -> None:
    """Raises InputError unless a name of something of a kind ("planner") is well formed."""
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z0-9_.*+-]+", name):
        raise InputError(f"{brief(name)} is not a well-formed {kind} name")


def load_class(entry_point: str) -> type:
    """The class that `entry_point` names.

    Raises:
        InputError: it cannot be imported, whatever its module does, or is no class.
    """
    source, _, name = entry_point.rpartition(":")
    try:
        loaded = getattr(module_of(source), name)
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # a stranger's module may fail in any way
        raise InputError(f"{entry_point} cannot be loaded: {reason(error)}") from error
    if not isinstance(loaded, type):
        raise InputError(f"{entry_point} is a {type(loaded).__name__}, not a class")
    return loaded


def is_file(source: str) -> bool:
    """Whether `source` names a file of Python rather than a module."""
    return source.endswith(".py")


def module_of(source: str) -> ModuleType:
    """The module called `source`, or made of the file called so, run once for each content.

    Raises:
        InputError: there is no such file.
    """
    if not is_file(source):
        return importlib.import_module(source)
    file = Path(source).resolve()
    place = hashlib.sha256(str(file).encode()).hexdigest()[:12]
    name = f"{file.stem}_{place}_{digest(file)}"
    if name not in sys.modules:
        _run(file, name)
    return sys.modules[name]


def digest(file: Path) -> str:
    """12 hexadecimal digits of a file's content.

    Raises:
        InputError: it cannot be read.
    """
    with input_error_of(f"cannot read {file}"):
        return hashlib.sha256(file.read_bytes()).hexdigest()[:12]


def _run(file: Path, name: str) -> None:
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # while it runs, as dataclasses and annotations look it up there
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
