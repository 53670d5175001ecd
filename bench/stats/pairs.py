"""What paired comparisons take: values of two planners on the same problems."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from envs.problem import Array


def flags(first: ArrayLike, second: ArrayLike) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Two arrays (n,) of booleans.

    Raises:
        ValueError: the shapes differ.
    """
    one, other = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    _check_shapes(one.shape, other.shape)
    return one, other


def values(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array]:
    """Two arrays (n,) of finite numbers.

    Raises:
        ValueError: the shapes differ, or a value is not finite.
    """
    one, other = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    _check_shapes(one.shape, other.shape)
    if not (np.isfinite(one) & np.isfinite(other)).all():
        raise ValueError("values must be finite; leave out the problems that were not solved")
    return one, other


def log_ratios(first: Array, second: Array) -> Array:
    """The logarithms (n,) of the second by the first.

    Raises:
        ValueError: a value is not positive.
    """
    if not ((first > 0).all() and (second > 0).all()):
        raise ValueError("a ratio needs positive values")
    ratios: Array = np.log(second / first)
    return ratios


def _check_shapes(first: tuple[int, ...], second: tuple[int, ...]) -> None:
    if first != second or len(first) != 1:
        raise ValueError(f"pairs need arrays (n,) of one length, not {first} and {second}")
