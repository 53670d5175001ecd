"""Whether motions are free, for planners that are compiled themselves, and for others.

A check is of a kind: a `NamedTuple` with what it knows of robot and obstacles, and a function
(known, a, b, size) -> bool, or int where it tells more, that is registered for it by
`checks_motions`. To compiled code all checks are of one type, the address of that function and the
memory of what it knows, so that a planner is compiled once for all kinds.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from envs.compiled import c_function, compiled_for, njit_hot, type_of
from envs.problem import Array

_F = TypeVar("_F", bound=Callable[..., int])

_Numbers = types.CPointer(types.float64)  # type: ignore[no-untyped-call]
_SIGNATURE = types.int64(types.voidptr, _Numbers, _Numbers, types.int64)
_SIGNATURE_OF_ENDS = types.int64(types.voidptr, _Numbers, types.int64)

LANES = 16
"""Configurations that are asked about at once."""

_WORD = 8  # bytes

MOTION_FREE, MOTION_OPEN, MOTION_NEARS, MOTION_TOUCHES = 1, 0, -1, -2
"""What checks answer of a motion: that it is proved free; that it is not. Those that tell more know
of the latter that it may come as near as the tolerance somewhere, or that it touches something."""


class CompiledCheck(NamedTuple):
    """A check as compiled code has it.

    Attributes:
        function: the address of the kind's function.
        of_ends: that of its function of many configurations, 0 if there is none.
        known: (n,) words, the kind's `NamedTuple` as Numba lays it out.
    """

    function: int
    of_ends: int
    known: NDArray[np.int64]


class MotionCheck:
    """Proves motions free. Whoever uses `compiled` must keep this object as long, and ask it from
    one thread at a time: some kinds work in arrays of their own.

    Args:
        check: of a kind that `checks_motions` knows, with arrays in C's order.

    Attributes:
        compiled: for compiled code, see `motion_is_free`.
    """

    def __init__(self, check: Any) -> None:
        self._kept = check  # as its arrays are pointed to
        kind = type(check)
        kind_type = type_of(check)
        if _TYPES.setdefault(kind.__name__, kind_type) != kind_type:
            raise TypeError(f"{kind.__name__} has fields of other types: {kind_type}")
        if kind not in _COMPILED:
            tells = _OF_ENDS.get(kind)
            _COMPILED[kind] = (
                c_function(_FUNCTIONS[kind], _SIGNATURE),
                c_function(tells, _SIGNATURE_OF_ENDS) if tells else None,
            )
        known = np.array(list(_words(check)), dtype=np.int64)
        function, of_ends = (made.address if made else 0 for made in _COMPILED[kind])
        self.compiled = CompiledCheck(function, of_ends, known)
        q = np.zeros(1)
        self._ask = compiled_for(told_of_motion, self.compiled, q, q)

    def is_free(self, a: Array, b: Array) -> bool:
        """`motion_is_free`, for code that is not compiled."""
        return self.told(a, b) == MOTION_FREE

    def told(self, a: Array, b: Array) -> int:
        """`told_of_motion`, for code that is not compiled."""
        begin, end = (np.ascontiguousarray(x, dtype=np.float64) for x in (a, b))
        return self._ask(self.compiled, begin, end)


def checks_motions(kind: type) -> Callable[[_F], _F]:
    """Registers a function for checks of a kind. Numba compiles it when the first is made.

    Args:
        kind: a subclass of `NamedTuple`, of arrays, floats, integers and other such tuples. No
            other kind has its name.

    The function is given `known`, of which `known_as(known, "Kind")` makes the tuple, and the
    motion's ends a and b as pointers to `size` numbers each, of which `array_at` makes arrays.
    See `motion_is_free` for what it answers.
    """

    def register(function: _F) -> _F:
        _FUNCTIONS[kind] = function
        return function

    return register


def tells_of_ends(kind: type) -> Callable[[_F], _F]:
    """As `checks_motions`, which a kind has besides: a function (known, ends, size) that is given
    `LANES` configurations one after another, and returns a mask; see `touching_ends`."""

    def register(function: _F) -> _F:
        _OF_ENDS[kind] = function
        return function

    return register


@njit_hot
def motion_is_free(check: Any, a: Any, b: Any) -> bool:
    """Whether a motion is proved free.

    Args:
        check: `MotionCheck.compiled`.
        a, b: float64 (size,), configurations; the motion is the space's shortest way.

    Returns:
        True if the robot is proved to keep more than half the tolerance all along, both ends
        included. False means that somewhere it keeps no more than about the tolerance; of an arm
        that it may be so: unless it is so near to something at a already, no more is asked than
        spheres about its links tell, see `envs.robots.sphere_trees`.
    """
    return told_of_motion(check, a, b) == MOTION_FREE


@njit_hot
def told_of_motion(check: Any, a: Any, b: Any) -> int:
    """`MOTION_FREE` as `motion_is_free`, else what is known instead."""
    return int(_called(check.function, check.known, a, b))


@njit_hot
def touching_ends(check: Any, ends: Any) -> int:
    """Which of many configurations, (LANES, size), are known to touch something: a mask, of which
    bit n is that of the nth. No motion to one of them is free. One question takes about as long as
    one motion."""
    return int(_called_of_ends(check.of_ends, check.known, ends))


@njit_hot
def motion_is_free_either_way(check: Any, a: Any, b: Any) -> bool:
    """`motion_is_free` from a to b or from b to a, which is the same motion: for both ends that a
    planner must come from, or has come from."""
    return motion_is_free(check, a, b) or motion_is_free(check, b, a)


_FUNCTIONS: dict[type, Callable[..., int]] = {}
_OF_ENDS: dict[type, Callable[..., int]] = {}
_COMPILED: dict[type, tuple[Any, Any]] = {}
_TYPES: dict[str, Any] = {}


def _words(value: Any) -> Iterator[int]:
    """A part of a check as Numba lays it out, all of it in words: of an array its owner and parent,
    here none, so that no references are counted; size, size of an item, address, shape, strides."""
    if isinstance(value, tuple):
        for part in value:
            yield from _words(part)
    elif isinstance(value, np.ndarray):
        yield from (0, 0, value.size, value.itemsize, value.ctypes.data)
        yield from value.shape
        yield from value.strides
    elif isinstance(value, float):
        yield struct.unpack("q", struct.pack("d", value))[0]
    else:
        yield int(value)


@intrinsic(prefer_literal=True)
def _known_as(_context: Any, known: Any, kind: Any) -> Any:
    kind_type = _TYPES[kind.literal_value]

    def load(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        layout = context.get_value_type(kind_type)
        return builder.load(builder.bitcast(arguments[0], layout.as_pointer()))

    return kind_type(known, kind), load


known_as: Any = _known_as
"""(known, "Kind") -> what a check of a kind, by its name, knows, in compiled code."""

array_at: Any = numba.carray  # type: ignore[attr-defined]
"""(a, size) -> the array (size,) at a pointer, in compiled code."""


def _call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Calls the function at an address with the memory of arrays, and the size of the last one's
    last axis."""
    word = ir.IntType(64)
    arrays = [
        context.make_array(of)(context, builder, value=value)
        for of, value in zip(signature.args[1:], arguments[1:], strict=True)
    ]
    known, *numbers = [array.data for array in arrays]
    given = [
        builder.bitcast(known, ir.IntType(8).as_pointer()),
        *(builder.bitcast(one, ir.DoubleType().as_pointer()) for one in numbers),
        builder.extract_value(arrays[-1].shape, signature.args[-1].ndim - 1),
    ]
    takes = ir.FunctionType(word, [one.type for one in given])
    return builder.call(builder.inttoptr(arguments[0], takes.as_pointer()), given)


def _asked(_context: Any, function: Any, known: Any, a: Any, b: Any) -> Any:
    return types.int64(types.int64, known, a, b), _call


def _asked_of_ends(_context: Any, function: Any, known: Any, ends: Any) -> Any:
    return types.int64(types.int64, known, ends), _call


_called: Any = intrinsic(_asked)
"""What the function of a kind answers of a motion."""

_called_of_ends: Any = intrinsic(_asked_of_ends)
"""What its function of many configurations answers."""
