"""Importing OMPL, and its planners' parameters by name, from text.

OMPL 1.7.0's loader opens `libompl.so` in site-packages, while its extension modules are linked to
another copy in `ompl.libs/`. Both copies are torn down at exit, and the interpreter dies there
after having worked correctly. Pointing the loader at the linked copy leaves one.
"""

from __future__ import annotations

import ctypes
import importlib.util
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from planners.ompl_common.parameter_text import count, flag, number, refused, unknown


def set_parameters(
    planner: Any, algorithm: str, chosen: Mapping[str, str], own: Sequence[str], names: Any
) -> None:
    """Gives an OMPL planner parameters: true, false, 1 or 0 for a flag, and for others finite
    numbers of at least 0, whole ones where it counts something.

    Args:
        algorithm: the planner's name, for messages.
        own: names that are ours and mean something to `algorithm`, for suggestions.
        names: an empty list of strings of OMPL's, to be filled.

    Raises:
        InputError: a name is unknown, or a value is none of these or refused by OMPL.
    """
    parameters = planner.params()
    parameters.getParamNames(names)
    known = [*names]
    for name, text in chosen.items():
        if name not in known:
            raise unknown(algorithm, name, [*known, *own])
        read = _read(type(parameters.getParam(name)).__name__, text)
        if read is None or not _taken(parameters, name, read):
            raise refused(algorithm, name, text)


def _read(kind: str, text: str) -> str | None:
    """As OMPL cannot misread it, or None if it is not of the kind, a class of OMPL's."""
    if kind == "SpecificParamBool":
        return flag(text)
    return count(text) if kind in ("SpecificParamUint", "SpecificParamInt") else number(text)


def _taken(parameters: Any, name: str, text: str) -> bool:
    try:
        return bool(parameters.setParam(name, text))
    except (RuntimeError, UnicodeError):  # OMPL's own, for text that it does not take for a number
        return False


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
