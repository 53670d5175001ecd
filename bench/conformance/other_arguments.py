"""Environments that differ in one number from another."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

from envs import Environment
from envs.registry import Entry


def with_other_numbers(entry: Entry[Environment]) -> Iterator[Entry[Environment]]:
    """The entry with another value of one of its arguments that are numbers, for each of these: the
    next integer, or a number that is a tenth less. It may be that no environment can be made of
    it."""
    for name, parameter in inspect.signature(entry.spec.load()).parameters.items():
        value = entry.arguments.get(name, parameter.default)
        if name in entry.spec.arguments:
            continue
        if type(value) is int:
            yield Entry(entry.spec, {**entry.arguments, name: value + 1})
        elif type(value) is float:
            yield Entry(entry.spec, {**entry.arguments, name: 0.9 * value or 0.1})
