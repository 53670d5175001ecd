"""Interpreters with next to nothing installed, for planners that run in one of their own."""

from __future__ import annotations

import subprocess
import venv
from collections.abc import Sequence
from pathlib import Path

import numpy
import pytest


def made_interpreter(folder: Path) -> Path:
    """A virtual environment with nothing but NumPy, which is that of this one."""
    venv.create(folder, symlinks=True)
    packages = packages_of(folder)
    for part in ("numpy", "numpy.libs"):
        there = Path(numpy.__file__).parents[1] / part
        if there.exists():
            (packages / part).symlink_to(there)
    return folder / "bin" / "python"


def packages_of(folder: Path) -> Path:
    """Where a virtual environment keeps what is installed."""
    [packages] = folder.glob("lib/python*/site-packages")
    return packages


def interpreter_with(folder: Path, wanted: Sequence[str]) -> Path:
    """A virtual environment into which pip installs what is wanted. The test is skipped where that
    cannot be had."""
    venv.create(folder, symlinks=True, with_pip=True)
    python = folder / "bin" / "python"
    said = subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted],
        capture_output=True,
        text=True,
        check=False,
    )
    if said.returncode:
        pytest.skip(f"pip cannot install {' '.join(wanted)}: {said.stderr.strip()[-300:]}")
    return python
