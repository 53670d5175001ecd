"""The site is read without a network: no page may load anything from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_LOADED = {
    ("script", "src"),
    ("link", "href"),
    ("img", "src"),
    ("iframe", "src"),
    ("source", "src"),
    ("video", "src"),
    ("audio", "src"),
    ("object", "data"),
    ("embed", "src"),
}
"""Elements with the attribute by which they load something; where `a` leads is the reader's."""

_NOT_LOADED = {"canonical", "author", "license", "next", "prev", "search", "index"}
"""Kinds of `link` that only say something."""

_IN_STYLE = re.compile(r"(?:url\(|@import)\s*[\"']?\s*((?:https?:)?//[^\"')\s;]+)")


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True}


def _check(app: Sphinx, error: Exception | None) -> None:
    from sphinx.util.logging import getLogger

    if error is not None or app.builder.format != "html":
        return
    for file, address in loaded_from_elsewhere(Path(app.outdir)):
        getLogger(__name__).warning("%s loads %s from the network", file, address)


def loaded_from_elsewhere(site: Path) -> Iterator[tuple[Path, str]]:
    """The addresses outside the site that its pages and styles load something from, each with the
    file that does."""
    for file in sorted(site.rglob("*.html")):
        page = _Page()
        page.feed(file.read_text(encoding="utf-8"))
        yield from ((file, address) for address in page.elsewhere)
    for file in sorted(site.rglob("*.css")):
        yield from ((file, a) for a in _IN_STYLE.findall(file.read_text(encoding="utf-8")))


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.elsewhere: list[str] = []
        self._in_style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_style = tag == "style"
        given = {name: value or "" for name, value in attrs}
        self.elsewhere += _IN_STYLE.findall(given.get("style", ""))
        if tag == "link" and given.get("rel", "") in _NOT_LOADED:
            return
        for element, attribute in _LOADED:
            if tag == element and re.match("(https?:)?//", given.get(attribute, "")):
                self.elsewhere.append(given[attribute])

    def handle_data(self, data: str) -> None:
        if self._in_style:
            self.elsewhere += _IN_STYLE.findall(data)

    def handle_endtag(self, tag: str) -> None:
        self._in_style = False
