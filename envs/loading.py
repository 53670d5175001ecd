"""Classes by name: "module:Class", or "folder/file.py:Class" for a file that nobody installed."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from envs.errors import InputError, reason


def load_class(entry_point: str) -> type:
    """The class that `entry_point` names.

    Raises:
        InputError: it cannot be imported, whatever its module does, or is no class.
    """
    source, _, name = entry_point.rpartition(":")
    try:
        loaded = getattr(module_of(source), name)
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # a stranger's module may fail in any way
        raise InputError(f"{entry_point} cannot be loaded: {reason(error)}") from error
    if not isinstance(loaded, type):
        raise InputError(f"{entry_point} is a {type(loaded).__name__}, not a class")
    return loaded


def is_file(source: str) -> bool:
    """Whether `source` names a file of Python rather than a module."""
    return source.endswith(".py")


def module_of(source: str) -> ModuleType:
    """The module called `source`, or made of the file called so, run once for each content.

    Raises:
        InputError: there is no such file.
    """
    if not is_file(source):
        return importlib.import_module(source)
    file = Path(source).resolve()
    place = hashlib.sha256(str(file).encode()).hexdigest()[:12]
    name = f"{file.stem}_{place}_{digest(file)}"
    if name not in sys.modules:
        _run(file, name)
    return sys.modules[name]


def digest(file: Path) -> str:
    """12 hexadecimal digits of a file's content.

    Raises:
        InputError: it cannot be read.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {file}: {error.strerror or error}") from error
    return hashlib.sha256(content).hexdigest()[:12]


def _run(file: Path, name: str) -> None:
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # while it runs, as dataclasses and annotations look it up there
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
