"""What a registry has, as Markdown: each spec with its arguments, by signature and docstring."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from envs.registry import Registry, Spec
from envs.registry.text_values import text_of

Rows = Sequence[tuple[str, str, str, str]]
"""Of arguments: name, type, default and meaning, in Markdown."""


def sections(registry: Registry[Any]) -> Iterator[str]:
    """A section in Markdown for each spec."""
    first: dict[type, Spec] = {}
    for spec in registry.specs():
        cls = spec.load()
        known = first.setdefault(cls, spec)
        description, meanings = read_docstring(inspect.getdoc(cls) or "")
        about = description if known is spec else f"Made by the same class as `{known.id}`."
        parts = [f"## `{spec.id}`", sentence(spec.description), *facts(spec), escaped(about)]
        rows = [*arguments(cls, spec, meanings), *ompl_parameters(spec)]
        yield "\n\n".join([*parts, table(rows) if rows else "It has no arguments."])


def sentence(text: str) -> str:
    """A spec's description, which begins small and has no full stop."""
    return escaped(f"{text[:1].upper()}{text[1:]}.")


def facts(spec: Spec) -> Iterator[str]:
    """What else a spec says."""
    if spec.aliases:
        yield f"Also called {', '.join(f'`{name}`' for name in spec.aliases)}."
    if spec.groups:
        yield f"Of the group {', '.join(f'`{name}`' for name in spec.groups)}."
    if not spec.in_all:
        yield "Not among `all`."
    for argument, stand_in in spec.without.items():
        yield f"Without `{argument}` it is `{stand_in}`."
    if spec.not_repeatable:
        yield escaped(f"The same seed may give another path: {spec.not_repeatable}.")


def arguments(cls: type, spec: Spec, meanings: Mapping[str, str]) -> Rows:
    """The arguments that a user may choose."""
    if cls.__init__ is object.__init__:  # type: ignore[misc]
        return []
    parameters = list(inspect.signature(cls.__init__).parameters.values())[1:]  # type: ignore[misc]
    return [
        (f"`{p.name}`", f"`{p.annotation}`", default(p), escaped(meanings.get(p.name, "")))
        for p in parameters
        if p.kind is not p.VAR_KEYWORD and p.name not in spec.arguments
    ]


def default(parameter: inspect.Parameter) -> str:
    """As a user would write it."""
    value = parameter.default
    if value is parameter.empty:
        return "must be given"
    if isinstance(value, float) and math.isnan(value):
        return "depends"
    return f"`{text_of(value)}`" if value != "" else "none"


def ompl_parameters(spec: Spec) -> Rows:
    """The parameters that OMPL's own planner declares, with its defaults."""
    if not spec.entry_point.startswith("planners.ompl"):
        return []
    from planners.ompl import parameters
    from planners.ompl.state_space import unit_square

    _, geometric, util = parameters.load()
    information = unit_square().information()
    planner = getattr(geometric, spec.arguments["algorithm"])(information)  # owns its parameters
    declared, names = planner.params(), util.vectorString()
    declared.getParamNames(names)
    rows = []
    for name in names:
        parameter = declared.getParam(name)
        kind = _OMPL_KINDS.get(type(parameter).__name__, "number")
        rows.append((f"`{name}`", f"`{kind}`", f"`{parameter.getValue()}`", "OMPL's own"))
    return rows


_OMPL_KINDS = {"SpecificParamBool": "bool", "SpecificParamUint": "int", "SpecificParamInt": "int"}


def table(rows: Rows) -> str:
    """Rows of arguments as a table in Markdown."""
    head = ("argument", "type", "default", "meaning")
    lines = [[cell.replace("|", r"\|") for cell in row] for row in (head, ("---",) * 4, *rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Example|Class attributes):\s*$", re.M)
_ARGUMENT = re.compile(r"^ {4}(\w+(?:, \w+)*): (.*(?:\n {5,}.*|\n)*)", re.M)


def read_docstring(text: str) -> tuple[str, dict[str, str]]:
    """What stands before the first section of a docstring, and its arguments' meanings by name."""
    description, *rest = _SECTION.split(text)
    by_title = dict(zip(rest[::2], rest[1::2], strict=True))
    meanings = {
        name: " ".join(meaning.split())
        for names, meaning in _ARGUMENT.findall(by_title.get("Args", ""))
        for name in names.split(", ")
    }
    return description.strip(), meanings


def escaped(text: str) -> str:
    """Docstrings have stars in names, as in RRT*, which Markdown would take for emphasis."""
    pieces = re.split("(`[^`]*`)", text)
    return "".join(p if p.startswith("`") else p.replace("*", r"\*") for p in pieces)
