"""The parts that configuration spaces are products of: coordinates, some of which wrap, and
rotations in space. `envs.spaces` has them, too."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from envs.problem import Array

_TURN = 2 * math.pi

_ROUNDING = 1e-9
"""Of the extent: by how much a coordinate may be out of bounds."""

_UNIT = 1e-6
"""By how much the length of a quaternion may differ from 1."""


class Kind(Enum):
    """Spaces that others are products of."""

    REALS = "R^n"
    CIRCLE = "S^1"
    ROTATIONS = "SO(3)"


@dataclass(frozen=True, eq=False)
class Factor:
    """What a part is a product of.

    Attributes:
        kind: what it is.
        places: (n,) of int, which of the part's numbers are its; one of a circle, four of
            rotations.
    """

    kind: Kind
    places: NDArray[np.int64]


class Part(ABC):
    """A part of a space, in which distances are measured together.

    Attributes:
        size: int, how many numbers of a configuration are its.
        dimension: int, its degrees of freedom.
        weight: float > 0, by which its distances count in the space's.
        is_flat: bool, whether the shortest way is along the difference of the numbers.
        lower, upper: float64 (size,), between which its numbers are.
        extent: float, the greatest distance of two places in it, without the weight.
    """

    size: int
    dimension: int
    weight: float
    is_flat: bool
    lower: Array
    upper: Array
    extent: float

    @abstractmethod
    def difference(self, a: Array, b: Array) -> Array:
        """The velocities, float64 (n, dimension), of the shortest ways from (n, size) to (n, size)
        in unit time; where two ways are equally short, of either."""

    @abstractmethod
    def advance(self, a: Array, velocity: Array) -> Array:
        """Where one is, float64 (n, size), who has gone from (n, size) for unit time at velocities
        (n, dimension)."""

    @abstractmethod
    def sample(self, rng: np.random.Generator, n: int) -> Array:
        """Uniform places, float64 (n, size)."""

    @abstractmethod
    def contains(self, q: Array) -> NDArray[np.bool_]:
        """Whether (n, size) are places in it, but for rounding, (n,) of bool."""

    @abstractmethod
    def definition(self) -> dict[str, Any]:
        """All that defines it, as JSON data."""

    @abstractmethod
    def factors(self) -> list[Factor]:
        """What it is a product of: at most one of kind REALS, which comes first."""

    @abstractmethod
    def __str__(self) -> str:
        """Its name, without the weight."""

    def narrowed(self, lower: Array, upper: Array) -> Part:
        """The same between narrower bounds (size,), as far as it has any that can be narrowed; by
        default it has none."""
        return self

    def distance(self, a: Array, b: Array) -> Array:
        """Distances (n,) of places (n, size), without the weight."""
        found: Array = np.linalg.norm(self.difference(a, b), axis=-1)
        return found


class Coordinates(Part):
    """Coordinates in a box, of which some may wrap: angles without limits.

    Args:
        lower, upper: (d,) bounds, finite, which may be equal; of a coordinate that wraps they are
            one turn apart, and the same place.
        wraps: (d,) of bool, which do; by default none.
        weight: see `Part`.

    Raises:
        ValueError: the bounds make no such box.

    Example:
        >>> heading = Coordinates([-np.pi], [np.pi], wraps=[True])
        >>> heading.difference(np.array([[3.0]]), np.array([[-3.0]])).round(3)
        array([[0.283]])
    """

    def __init__(
        self,
        lower: ArrayLike,
        upper: ArrayLike,
        wraps: ArrayLike | None = None,
        weight: float = 1.0,
    ) -> None:
        self.lower = np.array(lower, dtype=np.float64)
        self.upper = np.array(upper, dtype=np.float64)
        self.wraps = np.array(np.zeros_like(self.lower) if wraps is None else wraps, dtype=np.bool_)
        self.weight = weight
        self._check()
        self.size = self.dimension = len(self.lower)
        self.is_flat = not self.wraps.any()
        spans = np.where(self.wraps, _TURN / 2, self.upper - self.lower)
        self.extent = float(np.linalg.norm(spans))

    def _check(self) -> None:
        shapes = {self.lower.shape, self.upper.shape, self.wraps.shape}
        if len(shapes) > 1 or self.lower.ndim != 1 or not len(self.lower):
            raise ValueError(f"lower, upper and wraps must be (d,), not {sorted(shapes)}")
        if not (
            np.isfinite(self.lower) & np.isfinite(self.upper) & (self.lower <= self.upper)
        ).all():
            raise ValueError("no lower bound may be above the upper one, and all must be finite")
        extent = (self.upper - self.lower)[self.wraps]
        if not np.allclose(extent, _TURN, rtol=0, atol=1e-9):
            raise ValueError(f"bounds of coordinates that wrap must be 2 pi apart, not {extent}")

    def difference(self, a: Array, b: Array) -> Array:
        step: Array = np.subtract(b, a)
        if not self.is_flat:
            # Exact where less than half a turn is taken off nothing.
            turns = np.rint(step[..., self.wraps] / _TURN)
            step[..., self.wraps] -= _TURN * turns
        return step

    def advance(self, a: Array, velocity: Array) -> Array:
        there: Array = np.add(a, velocity)
        if not self.is_flat:
            lower, upper = self.lower[self.wraps], self.upper[self.wraps]
            angle = there[..., self.wraps]
            # A tiny step below the lower bound may be rounded to the upper one: the same place.
            there[..., self.wraps] = np.clip(
                angle - _TURN * np.floor((angle - lower) / _TURN), lower, upper
            )
        return there

    def sample(self, rng: np.random.Generator, n: int) -> Array:
        return rng.uniform(self.lower, self.upper, (n, self.size))

    def contains(self, q: Array) -> NDArray[np.bool_]:
        slack = _ROUNDING * (self.upper - self.lower)
        inside = (q >= self.lower - slack) & (q <= self.upper + slack)
        return np.asarray(inside.all(axis=-1))

    def definition(self) -> dict[str, Any]:
        return {
            "coordinates": [self.lower.tolist(), self.upper.tolist()],
            "wraps": np.flatnonzero(self.wraps).tolist(),
            "weight": self.weight,
        }

    def factors(self) -> list[Factor]:
        straight = np.flatnonzero(~self.wraps)
        circles = [Factor(Kind.CIRCLE, place) for place in np.flatnonzero(self.wraps)[:, None]]
        return [Factor(Kind.REALS, straight), *circles] if len(straight) else circles

    def __str__(self) -> str:
        circles = int(self.wraps.sum())
        straight = [f"R^{self.size - circles}"] if circles < self.size else []
        wrapped = ["S^1" if circles == 1 else f"T^{circles}"] if circles else []
        return " x ".join(straight + wrapped)

    def narrowed(self, lower: Array, upper: Array) -> Coordinates:
        """The same between narrower bounds (size,), but where it wraps."""
        low, high = np.maximum(lower, self.lower), np.minimum(upper, self.upper)
        return Coordinates(
            np.where(self.wraps, self.lower, low),
            np.where(self.wraps, self.upper, high),
            self.wraps,
            self.weight,
        )


class Rotations(Part):
    """SO(3), as unit quaternions x, y, z, w, of which q and -q are the same. A distance is the
    angle in radians by which one has to turn, twice that of OMPL's SO3StateSpace; velocities are
    in the frame that turns.

    Example:
        >>> turned = np.array([[0, 0, np.sqrt(0.5), np.sqrt(0.5)]])
        >>> Rotations().distance(np.array([[0, 0, 0, 1.0]]), turned).round(3)
        array([1.571])
    """

    size = 4
    dimension = 3
    is_flat = False
    lower = np.full(4, -1.0)
    upper = np.full(4, 1.0)
    extent = math.pi

    def __init__(self, weight: float = 1.0) -> None:
        self.weight = weight

    def difference(self, a: Array, b: Array) -> Array:
        turn = _product(_conjugate(a), b)
        turn = np.where(turn[..., 3:] < 0, -turn, turn)  # q and -q: the shorter way
        sine = np.linalg.norm(turn[..., :3], axis=-1, keepdims=True)
        angle = 2 * np.arctan2(sine, turn[..., 3:])
        # Turned by little: the angle by its sine comes to 2 before both are too small to divide.
        share = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 1e-12)
        found: Array = turn[..., :3] * share
        return found

    def advance(self, a: Array, velocity: Array) -> Array:
        angle = np.linalg.norm(velocity, axis=-1, keepdims=True)
        # sin(angle / 2) / angle, also at 0: np.sinc(x) is sin(pi x) / (pi x).
        by = np.concatenate([velocity * np.sinc(angle / _TURN) / 2, np.cos(angle / 2)], axis=-1)
        there = _product(a, by)
        unit: Array = there / np.linalg.norm(there, axis=-1, keepdims=True)
        return unit

    def sample(self, rng: np.random.Generator, n: int) -> Array:
        drawn = rng.normal(size=(n, 4))
        unit: Array = drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)
        return unit

    def contains(self, q: Array) -> NDArray[np.bool_]:
        return np.asarray(np.abs(np.linalg.norm(q, axis=-1) - 1) <= _UNIT)

    def definition(self) -> dict[str, Any]:
        return {"rotations": "xyzw", "weight": self.weight}

    def factors(self) -> list[Factor]:
        return [Factor(Kind.ROTATIONS, np.arange(4))]

    def __str__(self) -> str:
        return "SO(3)"


def _conjugate(q: Array) -> Array:
    inverse: Array = q * np.array([-1.0, -1.0, -1.0, 1.0])
    return inverse


def _product(a: Array, b: Array) -> Array:
    """Of quaternions (n, 4): first b, then a."""
    u, s = a[..., :3], a[..., 3:]
    v, t = b[..., :3], b[..., 3:]
    scalar = s * t - (u * v).sum(axis=-1, keepdims=True)
    return np.concatenate([s * v + t * u + np.cross(u, v), scalar], axis=-1)
