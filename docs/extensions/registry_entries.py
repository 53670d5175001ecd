"""The directive `registry-entries`, which lists what a registry has when the site is built.

Its argument names the registry as `package.NAME`.
"""

from __future__ import annotations

from importlib import import_module

from docutils import nodes
from registry_text import sections
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.add_directive("registry-entries", RegistryEntries)
    return {"parallel_read_safe": True}


class RegistryEntries(SphinxDirective):
    """A section for each spec of a registry."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()  # code may have changed where this page has not
        package, _, name = self.arguments[0].rpartition(".")
        text = "\n\n".join(sections(getattr(import_module(package), name)))
        return self.parse_text_to_nodes(text, allow_section_headings=True)
