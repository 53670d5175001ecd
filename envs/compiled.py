"""Compiled functions that innermost loops call, where they are kept between processes, and loops
over many items on several threads.

Numba notices that a function's own file has changed, but not that one it calls elsewhere has, or a
type that it is given: it would go on with what was compiled from both before. So code that was
compiled from other sources of this program is kept in another folder.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
import platformdirs

from envs import processors

_PACKAGES = ("envs", "planners", "bench")
_KEPT_S = 30 * 86_400.0


def cache_folder() -> str:
    """The folder for code that is compiled from the sources as they are, in the user's cache, or in
    `NUMBA_CACHE_DIR`. It is made if missing, and others are removed that were not used for a month.
    "" where none can be made: Numba keeps it beside the sources then, as far as it may.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    parent = Path(chosen) if chosen else platformdirs.user_cache_path("plannerbench") / "compiled"
    folder = parent / _digest(Path(__file__).parents[1])
    with suppress(OSError):
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(parent)
        os.utime(folder)
        return str(folder)
    return ""


def _digest(root: Path) -> str:
    """Of all sources that have to do with compiling, of the packages below a folder."""
    digest = sha256()
    for file in sorted(file for name in _PACKAGES for file in (root / name).rglob("*.py")):
        text = file.read_bytes()
        if b"numba" in text or b"njit" in text or b"NamedTuple" in text:
            digest.update(str(file.relative_to(root)).encode() + b"\0" + text)
    return digest.hexdigest()[:16]


def _remove_unused(parent: Path) -> None:
    for folder in parent.iterdir():
        is_ours = len(folder.name) == 16 and folder.is_dir()
        if is_ours and time.time() - folder.stat().st_mtime > _KEPT_S:
            shutil.rmtree(folder, ignore_errors=True)


numba.config.CACHE_DIR = cache_folder()  # type: ignore[attr-defined]  # before anything compiles

_F = TypeVar("_F", bound=Callable[..., Any])


QUICK = {"reassoc", "contract", "arcp", "nsz", "afn"}
"""What LLVM may do with sums, products and functions of floating-point numbers. All that Numba's
`fastmath=True` allows but `nnan` and `ninf`: with these LLVM may do anything where a number is
infinite or none, and distances from nothing and times through a wall are infinite."""

_KEPT: dict[str, Any] = {"cache": True, "nogil": True}
_UNCOUNTED: dict[str, Any] = {"nogil": True, "_nrt": False}


def njit_cached(function: _F) -> _F:
    """Compiles a function, which may make arrays."""
    compiled: _F = numba.njit(**_KEPT)(function)
    return compiled


def njit_cached_quick(function: _F) -> _F:
    """As `njit_cached`, with `QUICK` arithmetic."""
    compiled: _F = numba.njit(fastmath=QUICK, **_KEPT)(function)
    return compiled


def njit_hot(function: _F) -> _F:
    """Compiles a function that makes no arrays; one that does fails to compile.

    In return references to arrays are not counted. Numba counts one wherever an array is taken out
    of a tuple or another array, by an atomic addition that all threads share: half of the time of
    an arm's clearances, and more on two threads.
    """
    compiled: _F = numba.njit(cache=True, **_UNCOUNTED)(function)
    return compiled


def njit_quick(function: _F) -> _F:
    """As `njit_hot`, with `QUICK` arithmetic."""
    compiled: _F = numba.njit(cache=True, fastmath=QUICK, **_UNCOUNTED)(function)
    return compiled


def njit_simd(function: _F) -> _F:
    """As `njit_quick`, for loops that processors are to take several rounds of at once: what is
    divided by 0 is infinite, as in NumPy, where it is an error elsewhere, which takes rounds one by
    one."""
    compiled: _F = numba.njit(cache=True, fastmath=QUICK, error_model="numpy", **_UNCOUNTED)(
        function
    )
    return compiled


def njit_inline(function: _F) -> _F:
    """As `njit_hot`, and made part of its callers before they are compiled."""
    compiled: _F = numba.njit(inline="always", **_UNCOUNTED)(function)
    return compiled


def c_function(function: Callable[..., Any], signature: Any) -> Any:
    """Compiles a function for callers that know but its `address`, with C's conventions.

    Args:
        signature: of Numba's types.
    """
    return numba.cfunc(signature, cache=True)(function)


def compiled_for(function: _F, *arguments: Any) -> _F:
    """A compiled function for arguments of the types of these alone.

    It does not look at their types when it is called, which with tuples of many arrays takes longer
    than many a check. Whoever calls it must know that they are the same: whole arrays in C's order
    of the same numbers; whether they may be written to does not matter where nothing does.
    """
    found: _F = function.compile(tuple(map(type_of, arguments)))  # type: ignore[attr-defined]
    return found


def type_of(value: Any) -> Any:
    """Numba's type of a number, of a whole array in C's order, as one that may be written to, or of
    a `NamedTuple` of these: one type for what differs in nothing that compiled code minds, which
    then compiles once.

    Raises:
        TypeError: an array is not in C's order.
    """
    if isinstance(value, tuple):
        parts = [type_of(part) for part in value]
        return numba.types.NamedTuple(parts, type(value))  # type: ignore[no-untyped-call]
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise TypeError("an array is not in C's order")
        return numba.types.Array(numba.from_dtype(value.dtype), value.ndim, "C")
    return numba.typeof(value)  # type: ignore[no-untyped-call]


def parallel_for(work: Callable[[slice], None], items: int, block: int) -> None:
    """Calls `work` for slices of at most `block` of the items, on as many threads as Numba may
    use, but no more than there are cores; it must let go of the interpreter's lock (`nogil`) for
    that to help."""
    slices = [slice(begin, begin + block) for begin in range(0, items, block)]
    # Not numba.get_num_threads(): that starts Numba's own threads, and OpenMP's with them, which
    # then spin against PyTorch's.
    most: int = min(numba.config.NUMBA_NUM_THREADS, processors.physical_cores())  # type: ignore[attr-defined]
    if min(len(slices), most) <= 1:
        for part in slices:
            work(part)
        return
    with ThreadPoolExecutor(min(len(slices), most)) as pool:
        list(pool.map(work, slices))
