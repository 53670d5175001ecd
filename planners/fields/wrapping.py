"""Coordinates that wrap, in compiled code.

`circles` is a `CircleArrays`, or None where nothing wraps: Numba chooses by its type, so that what
is compiled for R^n has nothing of the others in it. See `planners.learning.circles`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from envs.compiled import njit_cached_quick, njit_inline
from planners.learning.circles import Circles


class CircleArrays(NamedTuple):
    """Coordinates that wrap, in single precision.

    Attributes:
        periods: (d,) after which each coordinate is back where it was; of those that do not wrap
            0, and `rates` too.
        rates: (d,) one by each period.
        told: (e,) which coordinate each number of their embedding tells.
    """

    periods: NDArray[np.float32]
    rates: NDArray[np.float32]
    told: NDArray[np.int64]

    @staticmethod
    def of(circles: Circles, dimension: int) -> CircleArrays | None:
        """Those of d coordinates, or None where none wraps."""
        if not circles.places:
            return None
        periods, rates = np.zeros((2, dimension), dtype=np.float32)
        periods[list(circles.places)] = circles.period
        rates[list(circles.places)] = 1 / circles.period
        return CircleArrays(periods, rates, np.array(circles.told(dimension)))


def apart(circles: Any, a: Any, b: Any, k: Any) -> Any:
    """By how much coordinate k of a is more than that of b, (d,) each, the short way."""


def squared_distance(circles: Any, a: Any, b: Any) -> Any:
    """Of a and b (d,)."""


def between(circles: Any, a: Any, b: Any, t: Any) -> Any:
    """Where, (d,), one is at a share t of the short way from a to b."""


# Numba wants what it compiles to be annotated as what stands for it.


@overload(apart, inline="always")
def _apart(circles: Any, a: Any, b: Any, k: Any) -> Any:
    def straight(circles: Any, a: Any, b: Any, k: Any) -> Any:
        return a[k] - b[k]

    def around(circles: Any, a: Any, b: Any, k: Any) -> Any:
        return shortest(circles, a[k] - b[k], k)

    return straight if isinstance(circles, types.NoneType) else around


@overload(squared_distance, inline="always")
def _squared_distance(circles: Any, a: Any, b: Any) -> Any:
    def straight(circles: Any, a: Any, b: Any) -> Any:
        return ((a - b) ** 2).sum()

    def around(circles: Any, a: Any, b: Any) -> Any:
        return squared_distance_around(circles, a, b)

    return straight if isinstance(circles, types.NoneType) else around


@overload(between, inline="always")
def _between(circles: Any, a: Any, b: Any, t: Any) -> Any:
    def straight(circles: Any, a: Any, b: Any, t: Any) -> Any:
        return a + t * (b - a)

    def around(circles: Any, a: Any, b: Any, t: Any) -> Any:
        return between_around(circles, a, b, t)

    return straight if isinstance(circles, types.NoneType) else around


@njit_inline
def shortest(circles: Any, step: Any, k: Any) -> Any:
    """A difference in coordinate k, the short way."""
    return step - circles.periods[k] * np.rint(step * circles.rates[k])


@njit_cached_quick
def squared_distance_around(circles: Any, a: Any, b: Any) -> Any:
    """See `squared_distance`."""
    total = np.float32(0)
    for k in range(len(a)):
        total += shortest(circles, a[k] - b[k], k) ** 2
    return total


@njit_cached_quick
def between_around(circles: Any, a: Any, b: Any, t: Any) -> Any:
    """See `between`."""
    there = np.empty_like(a)
    for k in range(len(a)):
        there[k] = a[k] + t * shortest(circles, b[k] - a[k], k)
    return there


@njit_cached_quick
def embed(circles: Any, x: Any, numbers: Any, slopes: Any) -> None:
    """Writes the numbers (e,) that tell x (d,), and the derivative of each by the coordinate that
    it tells."""
    d = len(x)
    numbers[:d] = x
    slopes[:d] = 1
    for j in range(d, len(circles.told)):
        k = circles.told[j]
        radius = circles.periods[k] / np.float32(2 * math.pi)
        sine, cosine = math.sin(x[k] / radius), math.cos(x[k] / radius)
        numbers[k], slopes[k] = radius * sine, cosine
        numbers[j], slopes[j] = radius * cosine, -sine
