"""Begins a worker in an interpreter that is not the harness's, and that has not our packages.

Run as a file: PYTHON guest.py MODULE DESCRIPTOR OURS PSUTIL, of which the last two are the folders
that hold our packages and psutil. Nothing else that is there can be imported from them: what is
installed there is of another Python. psutil's own library is the same for all; one that is
installed here comes first.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

_OLDEST = (3, 10)


class Lent:
    """Finds a few packages in a folder, and nothing else there.

    Args:
        folder: that holds them.
        names: of the packages.
    """

    def __init__(self, folder: str, *names: str) -> None:
        self._folder, self._names = folder, names

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """As `importlib.abc.MetaPathFinder` has it."""
        return PathFinder.find_spec(name, [self._folder]) if name in self._names else None


def main(module: str, descriptor: str, ours: str, psutil: str) -> None:
    """Runs the `main` of one of our modules."""
    sys.path.pop(0)  # the folder of this file, put there because it is run as one
    sys.meta_path.insert(0, Lent(ours, "bench", "envs", "planners"))
    sys.meta_path.append(Lent(psutil, "psutil"))
    import_module(module).main(int(descriptor))


if __name__ == "__main__":
    if sys.version_info < _OLDEST:
        sys.exit("this is Python {}.{}; 3.10 is the least".format(*sys.version_info))
    main(*sys.argv[1:])
