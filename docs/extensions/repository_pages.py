"""Pages that are read on the repository's page too, where links lead to files.

`architecture`, `contributing` and `changes` are the files of that name in the root of the
repository. A link to any other file outside docs/ becomes a download, and a link to a folder its
name.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

OF_ROOT = {
    "architecture": "ARCHITECTURE.md",
    "contributing": "CONTRIBUTING.md",
    "changes": "CHANGELOG.md",
}
"""Pages of the site by the file in the root that they show."""

_ON_SITE = {file: f"{page}.md" for page, file in OF_ROOT.items()} | {"README.md": "index.md"}

_LINK = re.compile(r"(?<!!)\[(?P<text>[^\]]*)\]\((?P<target>[^)#:]+)(?P<anchor>#[^)]*)?\)")
"""A link to a file; an image is none, nor is an address."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the extension."""
    app.connect("source-read", _rewrite)
    return {"parallel_read_safe": True}


def _rewrite(app: Sphinx, page: str, source: list[str]) -> None:
    file = DOCS / f"{page}.md"
    if page in OF_ROOT:
        file = ROOT / OF_ROOT[page]
        app.env.note_dependency(str(file))
        source[0] = file.read_text(encoding="utf-8")
    if file.is_file():
        source[0] = on_site(source[0], file.parent, DOCS / Path(page).parent)


def on_site(text: str, folder: Path, page_folder: Path) -> str:
    """A page's text with links that lead somewhere on the site.

    Args:
        text: Markdown.
        folder: of the file, which its links are relative to.
        page_folder: where the site has the page.
    """

    def link(match: re.Match[str]) -> str:
        target = Path(os.path.normpath(folder / match["target"]))
        named = target.relative_to(ROOT).as_posix()
        shown = DOCS / _ON_SITE[named] if named in _ON_SITE else target
        address = Path(os.path.relpath(shown, page_folder)).as_posix()
        if shown.is_relative_to(DOCS) and shown.suffix in (".md", ".ipynb"):
            return f"[{match['text']}]({address}{match['anchor'] or ''})"
        if target.is_dir():
            return f"{match['text']} (in the repository)"
        return f"{{download}}`{match['text']} <{address}>`"

    return _LINK.sub(link, text)
