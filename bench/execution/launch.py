"""What processes for planners are started with: nothing that anyone's code has changed since; and
whether this program is still what it was before anyone's environments were imported.

Judge, clock and store run in the process that makes environments, whose worlds the judge needs;
planners are imported elsewhere (`bench.execution.planner_host`). A package that changes one of
them, on purpose or by patching what it needs for itself, would change it for every planner.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import psutil

import envs
from bench.judging import METRIC_GROUP
from envs import InputError
from envs.registry.spec import is_file

ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)
"""Environment variables of every worker: one thread for each numerical library."""

_OF_SPEED = re.compile(
    r"(OMP|GOMP|KMP|OPENBLAS|GOTO|BLIS|MKL|NUMEXPR|VECLIB|NUMBA|NUMPY|NPY|TORCH|PYTORCH|ATEN|TF|XLA"
    r"|JAX|CUDA|CUBLAS|CUDNN|NVIDIA|MALLOC|TCMALLOC|MIMALLOC|GLIBC|LD|DYLD)_\w+|PYTHON\w+"
)
_NOT_OF_SPEED = re.compile(
    r"LD_LIBRARY_PATH|PYTHON(PATH|HOME|USERBASE|STARTUP|IOENCODING|UTF8|HISTORY|PYCACHEPREFIX"
    r"|DONTWRITEBYTECODE|UNBUFFERED|WARNINGS|SAFEPATH|NOUSERSITE|HASHSEED)|NUMBA_CACHE_DIR"
)

_SAFE_PATH = ["-P"] if sys.version_info >= (3, 11) else ["-I"]
"""Else Python, and the Pythons that it starts, would look into the current folder first."""

_GUEST = Path(__file__).with_name("guest.py")
_OF_ONE_PYTHON = frozenset(("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP", "__PYVENV_LAUNCHER__"))

_BOOT = (  # imports nothing before the path is ours
    "import sys; sys.path[:] = sys.argv[3:]; from importlib import import_module;"
    "import_module(sys.argv[1]).main(int(sys.argv[2]))"
)


@dataclass(frozen=True)
class Start:
    """How things stood at a moment.

    Attributes:
        variables: of the environment.
        path: where Python looks for modules, folders in full.
        folder: the current one.
    """

    variables: Mapping[str, str]
    path: tuple[str, ...]
    folder: str

    @staticmethod
    def now() -> Start:
        """As things stand, but for the current folder, see `_safe`."""
        here = str(Path.cwd())
        full = [str(Path(part).absolute()) if Path(part).exists() else part for part in sys.path]
        return Start(dict(os.environ), tuple(_safe(full, here)), here)

    @property
    def variables_of_speed(self) -> dict[str, str]:
        """Those that decide how fast numerical libraries, memory or Python itself are; what every
        worker is given in any case is not among them."""
        return {
            name: value
            for name, value in sorted(self.variables.items())
            if _OF_SPEED.fullmatch(name)
            and not _NOT_OF_SPEED.fullmatch(name)
            and name not in ONE_THREAD
        }


def _safe(path: list[str], here: str) -> list[str]:
    """A path for modules on which the current folder is not the first, where `python -m` puts it:
    what lies there under the name of a module is not meant. It comes last, or before what is
    installed if this program itself is there."""
    if path[:1] != [here]:
        return path
    rest = path[1:]
    if here in rest:
        return rest
    if Path(__file__).parents[2] != Path(here):
        return [*rest, here]
    installed = (i for i, part in enumerate(rest) if part.endswith("-packages"))
    behind = next(installed, len(rest))
    return [*rest[:behind], here, *rest[behind:]]


class _Command:
    """The command that workers are started for."""

    def __init__(self) -> None:
        self.start = Start.now()
        self._program: Program | None = None

    @contextmanager
    def begun(self) -> Iterator[None]:
        """Workers get what there is at the beginning of the context, which must come before
        anyone's module is imported; within another such context, what there was at its beginning.
        """
        if self._program is not None:
            yield
            return
        before = vars(self).copy()
        self.start, self._program = Start.now(), Program.now()
        try:
            yield
        finally:
            vars(self).update(before)

    def check_program(self) -> None:
        """Looks whether this program is still what it was when the command began.

        Raises:
            InputError: somebody's module has changed it.
        """
        if self._program is not None:
            self._program.check()


COMMAND = _Command()


def arguments(module: str, descriptor: int, interpreter: str = "") -> list[str]:
    """The command line of a process that runs a module's `main` and talks over a socket with this
    descriptor.

    Args:
        interpreter: another Python, by its path, with what is installed there; see
            `bench.execution.guest`.
    """
    if interpreter:
        lent = (str(Path(module.__file__ or "").parents[1]) for module in (envs, psutil))
        return [interpreter, str(_GUEST), module, str(descriptor), *lent]
    path = COMMAND.start.path
    return [sys.executable, *_SAFE_PATH, "-c", _BOOT, module, str(descriptor), *path]


def variables(interpreter: str = "") -> dict[str, str]:
    """The environment variables of a worker; another interpreter is not told where this one finds
    its modules."""
    found = {**COMMAND.start.variables, **ONE_THREAD}
    if interpreter:
        return {name: value for name, value in found.items() if name not in _OF_ONE_PYTHON}
    return found


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
        arrived = []  # names, and the files where their code is
        for name, (value, code) in _meanings():
            if name in self.meant:
                before, code_before = self.meant[name]
                if not _same(before, value) or code is not code_before:
                    raise _changed(name)
            elif code is not None:
                arrived.append((name, getattr(code, "co_filename", None)))
        files = _files_of_packages() if arrived else set()
        for name, file in arrived:
            if file in files:
                raise _changed(name)


def _changed(name: str) -> InputError:
    return InputError(
        f"{name} was changed by a package with environments or by metrics; these may only add to "
        "the benchmark, whose judge and clock are the same for all"
    )


def _files_of_packages() -> set[str | None]:
    """The files of metrics, and of all modules that packages with environments or metrics have."""
    every = entry_points()  # read once: it takes as long as all else that is looked at
    groups = envs.REGISTRY.plugins.group, METRIC_GROUP
    points = [point for group in groups for point in every.select(group=group)]
    packages = {point.module.partition(".")[0] for point in points}
    metrics = sys.modules.get("bench.judging.metrics")  # not for commands that have none
    registered = metrics.REGISTERED if metrics else ()
    files = {str(Path(m.origin).resolve()) for m in registered if is_file(m.origin)}
    modules = [m for name, m in sys.modules.items() if name.partition(".")[0] in packages]
    return {getattr(module, "__file__", None) for module in modules} - {None} | files


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
