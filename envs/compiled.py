"""Compiled functions that innermost loops call, and loops over many items on several threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numba

from envs import processors
from envs.compiled_cache import cache_folder

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


def njit_inline(function: _F) -> _F:
    """As `njit_hot`, and made part of its callers before they are compiled."""
    compiled: _F = numba.njit(inline="always", **_UNCOUNTED)(function)
    return compiled


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
