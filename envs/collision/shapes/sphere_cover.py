"""Spheres that cover solids, for clearances of millions of configurations.

All of a solid lies within its spheres, so distances from them are never more than those from the
solid; `slack` bounds how much less they can be where the solid's surface is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass

from envs.errors import InputError
from envs.problem import Array

_MOST_SPHERES = 50_000
"""Of a solid; those of the arms that ship have some dozens."""


@dataclass(frozen=True)
class Spheres:
    """Spheres in a solid's frame: `centers` (m, 3), `radii` (m,)."""

    centers: Array
    radii: Array


def countable(count: float) -> int:
    """A number of spheres.

    Raises:
        InputError: they are too many.
    """
    if count > _MOST_SPHERES:
        raise InputError(
            "a link is so large or so thin that its cover by spheres would take "
            f"{count:.2g} of them, more than {_MOST_SPHERES}; is its size in metres?"
        )
    return int(count)
