"""Whether this program is still what it was before anyone's environments were imported.

Judge, clock and store run in the process that makes environments, whose worlds the judge needs;
planners are imported elsewhere (`bench.planner_host`). A package that changes one of them, on
purpose or by patching what it needs for itself, would change it for every planner.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from types import FunctionType, ModuleType
from typing import Any

import envs
from envs import InputError

_OURS = ("bench", "envs", "planners")
_PLAIN = (str, int, float, bool, tuple, frozenset, type(None))


@dataclass(frozen=True)
class Program:
    """What every name in this program's modules and classes meant at a moment, and the code of what
    is a function; only what is meant to stay: functions, classes and constants."""

    meant: dict[str, tuple[object, object]]

    @staticmethod
    def now() -> Program:
        return Program(dict(_meanings()))

    def check(self) -> None:
        """Looks whether something has taken the place of a function, class or constant; of modules
        that were not imported yet, something from a package that announces environments.

        Raises:
            InputError: it has.
        """
        files = _files_of_packages()
        for name, (value, code) in _meanings():
            if name in self.meant:
                before, code_before = self.meant[name]
                if not _same(before, value) or code is not code_before:
                    raise _changed(name)
            elif getattr(code, "co_filename", None) in files:
                raise _changed(name)


def _changed(name: str) -> InputError:
    return InputError(
        f"{name} was changed by a package with environments; these may only add to the benchmark, "
        "whose judge and clock are the same for all"
    )


def _files_of_packages() -> set[str | None]:
    """The files of all modules that packages with environments have."""
    packages = {point.module.partition(".")[0] for point in envs.REGISTRY.plugins.points()}
    modules = [m for name, m in sys.modules.items() if name.partition(".")[0] in packages]
    return {getattr(module, "__file__", None) for module in modules} - {None}


def _same(before: object, now: object) -> bool:
    return before is now or (isinstance(now, _PLAIN) and before == now)


def _meanings() -> Iterator[tuple[str, tuple[object, object]]]:
    for module in [m for n, m in sys.modules.items() if n.partition(".")[0] in _OURS]:
        yield from _of(module.__name__, vars(module), module)


def _of(where: str, names: Any, module: ModuleType) -> Iterator[tuple[str, tuple[object, object]]]:
    for name, value in list(names.items()):
        function = getattr(value, "__func__", getattr(value, "fget", value))
        if isinstance(function, FunctionType):
            yield f"{where}.{name}", (value, function.__code__)
        elif isinstance(value, type):
            yield f"{where}.{name}", (value, None)
            if value.__module__ == module.__name__ and value.__name__ == name:
                yield from _of(f"{where}.{name}", vars(value), module)
        elif callable(value) or name.isupper():
            yield f"{where}.{name}", (value, None)
