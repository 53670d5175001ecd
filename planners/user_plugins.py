"""Planners from files that nobody installed; see `envs.registry.plugins`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import planners
from envs import InputError, Spec
from envs.errors import suggestion


def specs_of_file(file: Path) -> list[Spec]:
    """A spec for each planner that a file of Python defines, in its order.

    Raises:
        InputError: the file cannot be read or run, or defines no planner.
    """
    return planners.REGISTRY.plugins.of_file(file)


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
