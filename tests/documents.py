"""What users read: the README and the pages in docs/."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = sorted((ROOT / "docs").glob("*.md"))
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in (README, *PAGES))


def blocks(language: str) -> list[str]:
    """The blocks of text in a language, in the order of the pages."""
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


def block_after(comment: str) -> str:
    """The text of the block after a comment."""
    [found] = re.findall(rf"<!-- {comment} -->\n```\w+\n(.*?)```", TEXT, flags=re.DOTALL)
    return str(found)
