"""Planners whose packages may be in another interpreter than this one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

from envs.errors import InputError
from planners.base import Planner

_LOOK_S = 60.0  # for another Python to say what it has


@dataclass(frozen=True)
class Installed:
    """What an interpreter has.

    Attributes:
        version: of the distribution that was asked about; empty without it.
        missing: packages that were asked about and cannot be imported.
    """

    version: str
    missing: tuple[str, ...]


class Guest(Planner):
    """A planner of another package, which this interpreter may not have.

    Class attributes:
        distribution: what is installed.
        packages: that it needs, by the names they are imported by.

    Args:
        python: the interpreter that has them, by its path; by default this one.

    Raises:
        InputError: there is no such file.
    """

    distribution: ClassVar[str]
    packages: ClassVar[tuple[str, ...]]

    def __init__(self, python: str = "") -> None:
        if python:
            file = os.path.abspath(Path(python).expanduser())  # noqa: PTH100  links are kept
            if not os.access(file, os.X_OK) or Path(file).is_dir():
                raise InputError(f"{self.distribution}: python={python} is no program; name one")
            self.interpreter = file

    def unsupported(self, env: Any) -> str | None:
        """What is not installed, or why it cannot plan."""
        return self.lacking(self._installed) or self.refuses(env)

    @property
    def _installed(self) -> Installed:
        if not self.interpreter or self.interpreter == sys.executable:
            return installed(self.distribution, self.packages)
        return _installed_elsewhere(self.interpreter, self.distribution, self.packages)

    @abstractmethod
    def lacking(self, found: Installed) -> str | None:
        """What is not installed and how to install it, in a line; None if nothing is missing."""

    def refuses(self, env: Any) -> str | None:
        """Why it cannot plan in an environment, or None if it can, which is the default."""
        return None


def installed(distribution: str, packages: Sequence[str]) -> Installed:
    """What this interpreter has."""
    try:
        version = metadata.version(distribution)
    except metadata.PackageNotFoundError:
        version = ""
    return Installed(version, tuple(name for name in packages if find_spec(name) is None))


_ASK = """
import json, sys
from importlib import metadata
from importlib.util import find_spec
distribution, *packages = sys.argv[1:]
try:
    version = metadata.version(distribution)
except metadata.PackageNotFoundError:
    version = ""
print(json.dumps([version, [name for name in packages if find_spec(name) is None]]))
"""
"""As `installed`, for an interpreter that has none of ours."""


@lru_cache(maxsize=32)
def _installed_elsewhere(
    interpreter: str, distribution: str, packages: tuple[str, ...]
) -> Installed:
    """What another Python has; nothing, if it does not say."""
    asked = [interpreter, "-I", "-c", _ASK, distribution, *packages]
    try:
        said = subprocess.run(asked, capture_output=True, text=True, timeout=_LOOK_S, check=False)
        version, missing = json.loads(said.stdout)
    except (OSError, subprocess.TimeoutExpired, ValueError):
        return Installed("", packages)
    return Installed(version, tuple(missing))
