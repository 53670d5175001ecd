"""Compiled functions that innermost loops call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

_F = TypeVar("_F", bound=Callable[..., Any])


_UNCOUNTED: dict[str, Any] = {"nogil": True, "_nrt": False}


def kernel(function: _F) -> _F:
    """Compiles a function that makes no arrays; one that does fails to compile.

    In return references to arrays are not counted. Numba counts one wherever an array is taken out
    of a tuple or another array, by an atomic addition that all threads share: half of the time of
    an arm's clearances, and more on two threads.
    """
    compiled: _F = numba.njit(cache=True, **_UNCOUNTED)(function)
    return compiled


def inlined(function: _F) -> _F:
    """As `kernel`, and made part of its callers before they are compiled."""
    compiled: _F = numba.njit(inline="always", **_UNCOUNTED)(function)
    return compiled
