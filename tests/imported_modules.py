"""Which modules of the program the fast tests import: all of them, or some have no fast test.

Every process of a run tells what it has imported, and the one that leads it adds that up.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bench
import envs
import planners

PACKAGES = (bench, planners, envs)


def imported() -> set[str]:
    """By this process."""
    names = {package.__name__ for package in PACKAGES}
    return {name for name in sys.modules if name.partition(".")[0] in names}


def never(imported_somewhere: set[str]) -> list[str]:
    """The modules that are not among some, but for those that run as a process."""
    return sorted(name for name in _modules() - imported_somewhere if not name.endswith("__main__"))


def _modules() -> set[str]:
    found = set()
    for package in PACKAGES:
        folder = Path(package.__file__ or "").parent
        for file in folder.rglob("*.py"):
            parts = file.relative_to(folder.parent).with_suffix("").parts
            found.add(".".join(parts).removesuffix(".__init__"))
    return found
