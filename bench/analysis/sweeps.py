"""Planners of a run that differ in one number, `rrtstar:range=0.5|1|2`, or environments."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import planners
from envs import InputError
from envs.registry import Entry, Registry
from envs.registry.arguments import argument_text


@dataclass(frozen=True)
class Sweep:
    """A planner, or an environment, with several values of a parameter.

    Attributes:
        name: its own, with the arguments that are the same.
        parameter: the one that differs.
        values: at least two, ascending, with the id at each.
    """

    name: str
    parameter: str
    values: tuple[tuple[float, str], ...]

    @property
    def title(self) -> str:
        """As in "rrtstar over range"."""
        return f"{self.name} over {self.parameter}"


_NAMES = ("scene",)
"""Parameters whose numbers are names, of which the order means nothing."""


def sweeps(ids: Sequence[str], registry: Registry[Any] = planners.REGISTRY) -> list[Sweep]:
    """What entries of a registry with these ids are sweeps of, in their order: those with another
    number for a parameter, or its default, and all else the same. Those of a file that is not at
    hand are left out."""
    entries = {id: entry for id in ids for entry in _known(id, registry)}
    swept = dict.fromkeys(
        (entry.spec.id, name)
        for entry in entries.values()
        for name, given in entry.arguments.items()
        if name not in _NAMES and math.isfinite(_number(given))
    )
    found: dict[tuple[str, str], dict[float, str]] = {}
    for spec, parameter in swept:
        for id, entry in entries.items():
            value = _value(entry, parameter)
            if entry.spec.id == spec and math.isfinite(value):
                others = _without(entry.arguments, parameter)
                name = f"{spec}:{others}" if others else spec
                found.setdefault((name, parameter), {})[value] = id
    return [
        Sweep(name, parameter, tuple(sorted(values.items())))
        for (name, parameter), values in found.items()
        if len(values) > 1
    ]


def _known(id: str, registry: Registry[Any]) -> Iterator[Entry[Any]]:
    """Its entry, if there is one."""
    with suppress(InputError):
        yield registry.entry(id)


def _value(entry: Entry[Any], parameter: str) -> float:
    """The number that an entry has for a parameter, NaN if none: by default what its class says."""
    if parameter in entry.arguments:
        return _number(entry.arguments[parameter])
    try:
        known = inspect.signature(entry.spec.load()).parameters
    except InputError:
        return math.nan
    return _number(known[parameter].default) if parameter in known else math.nan


def _without(arguments: Mapping[str, Any], name: str) -> str:
    return argument_text({key: value for key, value in arguments.items() if key != name})


def _number(given: Any) -> float:
    """What is a number, or reads as one; else NaN."""
    if isinstance(given, bool):
        return math.nan
    try:
        return float(given)
    except (TypeError, ValueError):
        return math.nan
