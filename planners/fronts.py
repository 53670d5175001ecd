"""Fronts that leave a source and when they arrive on the nodes of a grid: solvers of the Eikonal
equation by fast marching, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
import skfmm

from envs.errors import UnknownNameError
from envs.problem import Array


class Medium(NamedTuple):
    """What fronts go through: the same for every source.

    Attributes:
        speed: (n0, n1, ...) on the nodes, positive, an axis a dimension. Along an axis that wraps
            the node after the last is the first.
        spacing: (d,) from a node to the next, in lengths.
        wraps: of each axis, whether it does.
        order: of the finite differences, 1 or 2.
    """

    speed: Array
    spacing: Array
    wraps: tuple[bool, ...]
    order: int


class Source(NamedTuple):
    """Where a front starts: on a sphere about a place, which need not be a node.

    Attributes:
        place: (d,) in spacings from the first node.
        speed: there.
        radius: of the sphere, in lengths.
        outside: (n0, n1, ...) how far the nodes are from the sphere, negative within.
    """

    place: Array
    speed: float
    radius: float
    outside: Array


class FrontSolver(Protocol):
    """How arrival times are found.

    Attributes:
        goes_round: whether fronts go on where an axis wraps.
    """

    goes_round: ClassVar[bool]

    def arrival_times(self, medium: Medium, source: Source, until: float) -> Array:
        """Times (n0, n1, ...) after the front has left its sphere, negative within.

        They may be NaN on nodes at which it arrives later than `until`. Those that are not do not
        depend on `until`.
        """


class ScikitFmm:
    """scikit-fmm: starts from the sphere as a level set, within which the source's own speed holds:
    nodes there may lie in a wall, and would draw paths away from the source. Follows the front no
    farther than it is asked to."""

    goes_round: ClassVar[bool] = True

    def arrival_times(self, medium: Medium, source: Source, until: float) -> Array:
        """See `FrontSolver`."""
        found = skfmm.travel_time(
            source.outside,
            medium.speed,
            dx=medium.spacing,
            order=medium.order,
            narrow=until if until < np.inf else 0.0,  # its word for all of them
            periodic=medium.wraps,
        )
        times = np.asarray(found) if until == np.inf else np.ma.filled(found, np.nan)
        whole: Array = np.where(source.outside < 0, source.outside / source.speed, times)
        return whole


SKFMM = ScikitFmm()


def _eikonalfm() -> FrontSolver:
    from planners.factored_fronts import FactoredFronts  # whose package may be missing

    return FactoredFronts()


_SOLVERS: dict[str, Callable[[], FrontSolver]] = {
    "skfmm": lambda: SKFMM,
    "eikonalfm": _eikonalfm,
}


def solver_named(name: str) -> FrontSolver:
    """The solver of that name.

    Raises:
        InputError: there is none, or its package is not installed.
    """
    if name not in _SOLVERS:
        raise UnknownNameError("solver", name, _SOLVERS)
    return _SOLVERS[name]()
