"""What users read: the README, the pages in docs/, and the blocks of text in them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = sorted((ROOT / "docs").rglob("*.md"))
NOTEBOOKS = sorted((ROOT / "docs").rglob("*.ipynb"))
TEXT = "\n".join(page.read_text(encoding="utf-8") for page in (README, *PAGES))

ALL = [README, ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md", *PAGES]
"""Those for contributors, too."""


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: its file, from the root of the repository.
        language: as its fence says.
        label: the comment before it, by which a test finds it; else empty.
    """

    page: str
    language: str
    label: str
    text: str

    @property
    def name(self) -> str:
        """Its page and its first words, for `NOT_RUN`."""
        return f"{self.page}: {' '.join(self.text.split()[:3])}"

    @property
    def is_run(self) -> bool:
        """Whether a test runs it, or the build of the site, of which directives are a part."""
        by_label = self.label and f'block_after("{self.label}")' in _tests()
        return bool(by_label) or self.language in RUN_WHEREVER_THEY_ARE or self.language[0] == "{"


@cache
def _tests() -> str:
    files = sorted(Path(__file__).parent.rglob("test_*.py"))
    return "\n".join(file.read_text(encoding="utf-8") for file in files)


def _blocks_of(page: Path) -> list[Block]:
    found = re.findall(
        r"^(?:<!-- (.*) -->\n)?```(\S+).*\n((?:.*\n)*?)```$",
        page.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    where = page.relative_to(ROOT).as_posix()
    return [Block(where, language, label, text) for label, language, text in found]


BLOCKS = [block for page in ALL for block in _blocks_of(page)]

RUN_WHEREVER_THEY_ARE = ("python", "xml", "yaml")
"""Languages of which tests take every block; of others those with a label."""

NOT_RUN = {
    "README.md: python3 -m venv": "installs the package; .ci/run does the second of the two",
    "CONTRIBUTING.md: python -m venv": "installs the package",
    "CONTRIBUTING.md: .venv/bin/pytest # the": "the tests themselves",
    "CONTRIBUTING.md: .venv/bin/pip install -c": "builds the site, as .ci/run does",
    "docs/other-paths.md: bench judge --env": "takes a while; test_other_paths.py does the same "
    "with a few problems",
    "docs/own-planner.md: bench test-planner detours.py:Detours": "all planners take minutes; "
    "test_docs_plugins.py does the same with one",
    "docs/peers.md: python3 -m venv": "installs a package; test_peers.py runs it so",
    "docs/planners.md: python -m venv": "installs packages; test_ompl2.py makes the same",
    "docs/quick-start.md: python3 -m venv": "installs the package",
    "docs/robots.md: bench show --env": "trains a planner; test_readme.py draws the arm and plans",
    "docs/running.md: bench run --env": "takes hours; test_readme.py has its arguments checked",
}
"""By `Block.name`, blocks that could be run and are not, with the reason."""


def blocks(language: str) -> list[str]:
    """The text of the blocks in a language for users, in the order of the pages."""
    theirs = [block for block in BLOCKS if block.page == "README.md" or "docs/" in block.page]
    return [block.text for block in theirs if block.language == language]


def block_after(comment: str) -> str:
    """The text of the block after a comment."""
    [found] = [block.text for block in BLOCKS if block.label == comment]
    return found
