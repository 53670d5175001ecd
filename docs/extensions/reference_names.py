"""Names in the reference: where those of docstrings and annotations lead.

Docstrings have names and other code between single backticks. One that the reference describes is
a link, and any other is code. So are types in annotations, many of which are of other projects,
whose lists of names would have to come from the network.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.inspect import TypeAliasForwardRef

_PUBLIC = {
    r"bench\.api\.(Run|run|load|judge)": r"bench.\1",
    r"planners\.base\.(Planner|PlannerResult|Budget|Status)": r"planners.\1",
    r"envs\.environment\.(Environment)": r"envs.\1",
    r"envs\.problem\.(Problem|Path)": r"envs.\1",
    r"envs\.errors\.(InputError)": r"envs.\1",
    r"envs\.registry\.(?:spec\.|registry\.)?(Spec)": r"envs.\1",
    r"envs\.registry\.registry\.(Registry|Entry)": r"envs.registry.\1",
}
"""Where things are defined, by the name under which they are imported and described."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.connect("missing-reference", _resolve)
    app.connect("autodoc-process-docstring", _keep_first_line, priority=400)  # before Napoleon
    app.config.default_role = "py:obj"
    # Within other types, Sphinx writes its stand-in for an alias as Python would.
    TypeAliasForwardRef.__repr__ = lambda alias: alias.name  # type: ignore[method-assign]
    return {"parallel_read_safe": True}


def _keep_first_line(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Napoleon takes what stands before a colon in a property's first line for its type."""
    if what == "property":
        lines[:0] = ["..", ""]  # a comment


def _resolve(
    app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, shown: nodes.Element
) -> Any | None:
    if node.get("refdomain") != "py":
        return None
    domain = env.domains["py"]
    target = described(node["reftarget"], domain.data["objects"])
    if target:
        return domain.resolve_xref(
            env, node["refdoc"], app.builder, node["reftype"], target, node, shown
        )
    of_annotation = not isinstance(shown, nodes.literal | addnodes.literal_emphasis)
    return shown if node["reftype"] == "obj" or of_annotation else None


def described(name: str, known: Collection[str]) -> str | None:
    """Which of the `known` names is meant by one that is not among them, if it is clear."""
    for pattern, public in _PUBLIC.items():
        if re.fullmatch(pattern, name):
            return re.sub(pattern, public, name)
    alike = [one for one in known if one.rpartition(".")[2] == name and name[:1].isupper()]
    return alike[0] if len(alike) == 1 else None
