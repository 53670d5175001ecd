"""Planners from files that nobody installed: every public subclass of `Planner` in one.

A class may say more of itself in class attributes that are called like the fields of a `Spec`:
`id` (by default its name, `MyPlanner` as `my-planner`), `description` (by default the first line
of its docstring), `version`, `groups`, `in_all` and `not_repeatable`. The version is by default
made of the file's content, so that results of a changed file can be told apart.
"""

from __future__ import annotations

import contextlib
import inspect
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import planners
from envs import InputError, Spec, loading
from envs.errors import reason, suggestion
from planners import Planner

_SAID = {
    "id": str,
    "description": str,
    "version": int,
    "groups": tuple,
    "in_all": bool,
    "not_repeatable": str,
}
"""Fields of a spec that a class may set, and their types."""

_VERSION_DIGITS = 7  # hexadecimal, of the file's digest


def specs_of_file(file: Path) -> list[Spec]:
    """A spec for each planner that a file of Python defines, in its order.

    Raises:
        InputError: the file cannot be read or run, or defines no planner.
    """
    if not loading.is_file(file.name):
        raise InputError(f"{file} is no file of Python, whose name ends in .py")
    file = file.resolve()
    try:
        module = loading.module_of(str(file))
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"{file} cannot be loaded: {reason(error)}") from error
    found = [
        cls
        for name, cls in vars(module).items()
        if inspect.isclass(cls)
        and cls.__module__ == module.__name__
        and name == cls.__name__
        and issubclass(cls, Planner)
        and not name.startswith("_")
    ]
    made = [_spec(cls, file) for cls in found if not inspect.isabstract(cls)]
    if not made:
        unfinished = f"; {found[0].__name__} lacks a method `solve`" if found else ""
        raise InputError(f"{file} defines no subclass of planners.Planner{unfinished}")
    return made


def spec_of_class(file: Path, name: str) -> Spec:
    """The spec of one of a file's planners, by the name of its class; "" if it has only one.

    Raises:
        InputError: see `specs_of_file`; or there is no such class, or more than one to choose from.
    """
    by_name = {spec.entry_point.rpartition(":")[2]: spec for spec in specs_of_file(file)}
    if not name and len(by_name) == 1:
        return next(iter(by_name.values()))
    if name not in by_name:
        raise InputError(f"{file} has no planner {name!r}; {suggestion(name, by_name)}")
    return by_name[name]


@contextlib.contextmanager
def registered(files: Sequence[Path]) -> Iterator[list[Spec]]:
    """The planners of some files, in the registry as long as the context lasts.

    Raises:
        InputError: see `specs_of_file`; or an id is taken.
    """
    with contextlib.ExitStack() as undone:
        added = []
        for spec in (spec for file in files for spec in specs_of_file(file)):
            planners.REGISTRY.specs()  # plug-ins too: the id must not be one of theirs
            planners.REGISTRY.register(spec)
            undone.callback(planners.REGISTRY.unregister, spec.id)
            added.append(spec)
        yield added


def _spec(cls: type[Planner], file: Path) -> Spec:
    said: dict[str, Any] = {
        "id": re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", cls.__name__).lower(),
        "description": ((cls.__doc__ or "").strip() or cls.__name__).splitlines()[0],
        "version": int(loading.digest(file)[:_VERSION_DIGITS], 16),
    }
    for name, kind in _SAID.items():
        value = getattr(cls, name, None)
        if value is None:
            continue
        if not isinstance(value, kind):
            raise InputError(f"{file}: {cls.__name__}.{name} must be a {kind.__name__}")
        said[name] = value
    return Spec(entry_point=f"{file}:{cls.__name__}", origin=str(file), **said)
