"""Planners of a run that differ in one number: `rrtstar:range=0.5|1|2`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import planners
from envs import InputError
from envs.registry.arguments import argument_text


@dataclass(frozen=True)
class Sweep:
    """A planner with several values of a parameter.

    Attributes:
        planner: its name, with the arguments that are the same.
        parameter: the one that differs.
        values: at least two, ascending, with the planner's id at each.
    """

    planner: str
    parameter: str
    values: tuple[tuple[float, str], ...]

    @property
    def title(self) -> str:
        """As in "rrtstar over range"."""
        return f"{self.planner} over {self.parameter}"


def sweeps(ids: Sequence[str]) -> list[Sweep]:
    """What planners with these ids are sweeps of, in their order. Those of a file that is not at
    hand are left out."""
    found: dict[tuple[str, str], dict[float, str]] = {}
    for id in ids:
        for others, parameter, value in _places(id):
            found.setdefault((others, parameter), {})[value] = id
    return [
        Sweep(planner, parameter, tuple(sorted(values.items())))
        for (planner, parameter), values in found.items()
        if len(values) > 1
    ]


def _places(id: str) -> Iterator[tuple[str, str, float]]:
    """Of each number among a planner's arguments what the planner is without it, its name, and the
    number."""
    try:
        entry = planners.REGISTRY.entry(id)
    except InputError:
        return
    for name, given in entry.arguments.items():
        value = _number(given)
        if math.isfinite(value):
            others = _without(entry.arguments, name)
            yield f"{entry.spec.id}:{others}" if others else entry.spec.id, name, value


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
