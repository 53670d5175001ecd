"""Imports OMPL's Python bindings with one copy of its library in the process.

OMPL 1.7.0's loader opens `libompl.so` in site-packages, while its extension modules are linked to
another copy in `ompl.libs/`. Both copies are torn down at exit, and the interpreter dies there
after having worked correctly. Pointing the loader at the linked copy leaves one.
"""

from __future__ import annotations

import ctypes
import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any


@cache
def load() -> tuple[ModuleType, ModuleType, ModuleType]:
    """The modules `ompl.base`, `ompl.geometric` and `ompl.util`, their console output off.

    Raises:
        ImportError: OMPL is not installed.
    """
    original = ctypes.CDLL
    linked = _linked_library()

    def open_linked(name: Any, *args: Any, **kwargs: Any) -> ctypes.CDLL:
        ours = linked is not None and Path(str(name)).name.startswith("libompl.")
        return original(str(linked) if ours else name, *args, **kwargs)

    ctypes.CDLL = open_linked  # type: ignore[misc, assignment]
    try:
        from ompl import base, geometric, util
    finally:
        ctypes.CDLL = original  # type: ignore[misc]
    util.setLogLevel(util.LogLevel.LOG_NONE)
    return base, geometric, util


def _linked_library() -> Path | None:
    """The copy that the extension modules are linked to, or None where there is only one."""
    spec = importlib.util.find_spec("ompl")
    if spec is None or spec.origin is None:
        raise ImportError("OMPL's Python bindings are not installed: pip install ompl==1.7.0")
    return next((Path(spec.origin).parents[1] / "ompl.libs").glob("libompl-*.so*"), None)
