"""What the sources of an installed package are, so that results of edited ones are told apart."""

from __future__ import annotations

import hashlib
import importlib.util
from collections.abc import Iterator
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES
from pathlib import Path

_SUFFIXES = tuple(SOURCE_SUFFIXES + EXTENSION_SUFFIXES)


def package_digest(module: str) -> str:
    """12 hexadecimal digits of all modules, compiled ones too, of the package that a module is in;
    of a module in no package, of its file. Empty if there is no file to be found.

    Args:
        module: its name, as in "package.module". It is not imported.
    """
    package = module.partition(".")[0]
    digest = hashlib.sha256()
    found = ""
    for name, file in _files(package):
        digest.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
        found = digest.hexdigest()[:12]
    return found


def _files(package: str) -> Iterator[tuple[str, Path]]:
    """The files, each with its place in the package, in an order that is the same everywhere."""
    try:
        spec = importlib.util.find_spec(package)
    except ValueError:  # it was made while a program runs, and says nothing of its origin
        return
    if spec is None:
        return
    if spec.submodule_search_locations is None:
        if spec.has_location and spec.origin:
            yield Path(spec.origin).name, Path(spec.origin)
        return
    for folder in map(Path, spec.submodule_search_locations):
        files = (file for file in folder.rglob("*") if file.name.endswith(_SUFFIXES))
        for file in sorted(files):
            yield file.relative_to(folder).as_posix(), file
