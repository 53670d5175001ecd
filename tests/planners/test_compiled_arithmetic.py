"""Compiled code meets infinities, so LLVM must never be told that there are none."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator

from numba.core.dispatcher import Dispatcher

import bench
import envs
import planners


def compiled() -> Iterator[tuple[str, Dispatcher]]:
    for package in (envs, planners, bench):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if found.name.endswith(".__main__"):
                continue  # that is the command itself
            module = importlib.import_module(found.name)
            for name, value in vars(module).items():
                if isinstance(value, Dispatcher):
                    yield f"{found.name}.{name}", value


def test_no_compiled_code_takes_numbers_for_finite() -> None:
    """`fastmath=True` has `nnan` and `ninf`, with which LLVM may do anything where a number is
    infinite or none."""
    functions = dict(compiled())
    assert len(functions) > 50
    for name, function in functions.items():
        allowed = function.targetoptions.get("fastmath", False)
        assert allowed is False or not {"nnan", "ninf", "fast"} & {*allowed}, name
