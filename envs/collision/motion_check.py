"""Whether motions are free, for planners that are compiled themselves.

Such planners are compiled once for each kind of check, which Numba tells by its type. A kind is a
`NamedTuple` with what it knows of robot and obstacles, and a compiled function

    is_free(check, a, b) -> bool

that is registered for it by `checks_motions`. Of `Environment.motion_check` there is one for each
environment, robot and tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import types
from numba.extending import overload

from envs.compiled import compiled_for, njit_cached
from envs.problem import Array

_F = TypeVar("_F", bound=Callable[..., bool])


def motion_is_free(check: Any, a: Any, b: Any) -> Any:
    """Whether a motion is proved free. Only compiled code may call it.

    Args:
        check: what `Environment.motion_check` has made.
        a, b: float64 (size,), configurations; the motion is the space's shortest way.

    Returns:
        True if the robot is proved to keep more than half the tolerance all along, both ends
        included. False means that somewhere it keeps no more than about the tolerance.
    """
    raise TypeError("motion_is_free is for compiled code")


@njit_cached
def _asked(check: Any, a: Any, b: Any) -> bool:
    return bool(motion_is_free(check, a, b))


def asked_from_python(check: Any, size: int) -> Callable[[Array, Array], bool]:
    """`motion_is_free` of a check, for code that is not compiled.

    Args:
        check: what `Environment.motion_check` has made.
        size: of configurations.

    Returns:
        (a, b) -> bool, of configurations (size,).
    """
    q = np.zeros(size)
    compiled = compiled_for(_asked, check, q, q)

    def is_free(a: Array, b: Array) -> bool:
        begin, end = (np.ascontiguousarray(x, dtype=np.float64) for x in (a, b))
        return compiled(check, begin, end)

    return is_free


def checks_motions(kind: type) -> Callable[[_F], _F]:
    """Registers a compiled function, (check, a, b) -> bool, for checks of a kind.

    Args:
        kind: a subclass of `NamedTuple`.
    """

    def register(is_free: _F) -> _F:
        def of_kind(check: Any, a: Any, b: Any) -> Any:
            if not isinstance(check, types.NamedTuple) or check.instance_class is not kind:
                return None  # another function's

            # Annotated as what it stands for, which Numba wants.
            def asked(check: Any, a: Any, b: Any) -> Any:
                return is_free(check, a, b)

            return asked

        overload(motion_is_free)(of_kind)
        return is_free

    return register
