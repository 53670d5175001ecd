"""Configuration spaces: products of coordinates, some of which wrap, and of rotations in space.

A configuration is a row of numbers: those of each part, one after the other. The distance of two
configurations is the weighted sum of the parts' distances, as in OMPL's compound spaces, and the
shortest way between them is followed in all parts at once.

The coordinates of one part are measured together (Euclidean), so that a space of one part in which
nothing wraps is R^n, where distances are those of the numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
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


def _of_circles(part: Part) -> NDArray[np.bool_]:
    found = np.zeros(part.size, dtype=np.bool_)
    for factor in part.factors():
        found[factor.places] = factor.kind is Kind.CIRCLE
    return found


class Space:
    """A product of parts.

    Args:
        parts: in the order of a configuration's numbers.

    Attributes:
        size: int, how many numbers a configuration has.
        dimension: int, degrees of freedom.
        is_flat: bool, whether it is R^n: the shortest way is the straight line of the numbers.
        weights: float64 (dimension,), by which velocities count, those of their parts.
        lower, upper: float64 (size,), between which the numbers of a configuration are.
        extent: float, the greatest distance of two configurations in it.
        kinds: what it is a product of.
        wraps: (size,) of bool, which of the numbers are of a circle.

    Example:
        >>> plane = Coordinates([0, 0], [10, 10])
        >>> heading = Coordinates([-np.pi], [np.pi], wraps=[True], weight=0.5)
        >>> se2 = Space([plane, heading])
        >>> a, b = np.array([[1.0, 2.0, 3.0]]), np.array([[4.0, 6.0, -3.0]])
        >>> se2.distance(a, b).round(3)
        array([5.142])
        >>> se2.interpolate(a, b, np.array([0.5])).round(3)
        array([[ 2.5  ,  4.   , -3.142]])
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        self.parts = tuple(parts)
        self.size = sum(part.size for part in self.parts)
        self.dimension = sum(part.dimension for part in self.parts)
        self.is_flat = len(self.parts) == 1 and self.parts[0].is_flat
        self.weights = np.repeat([p.weight for p in self.parts], [p.dimension for p in self.parts])
        self.lower: Array = np.concatenate([part.lower for part in self.parts])
        self.upper: Array = np.concatenate([part.upper for part in self.parts])
        self.extent = sum(part.weight * part.extent for part in self.parts)
        self.kinds = frozenset(f.kind for part in self.parts for f in part.factors())
        self.wraps = np.concatenate([_of_circles(part) for part in self.parts])

    def difference(self, a: Array, b: Array) -> Array:
        """The velocities, float64 (n, dimension), of the shortest ways between configurations
        (n, size) in unit time; where two ways are equally short, of either."""
        found = [p.difference(x, y) for p, x, y in self._pairs(a, b)]
        return np.concatenate(found, axis=-1)

    def distance(self, a: Array, b: Array) -> Array:
        """Distances (n,) of configurations (n, size)."""
        found = [part.weight * part.distance(x, y) for part, x, y in self._pairs(a, b)]
        total: Array = sum(found[1:], found[0])
        return total

    def interpolate(self, a: Array, b: Array, t: Array) -> Array:
        """Configurations (n, size) at shares t (n,), from 0 to 1, of the shortest ways between
        (n, size); at 0 and 1 exactly the ends."""
        share = np.asarray(t, dtype=np.float64)[..., None]
        there = [p.advance(x, share * p.difference(x, y)) for p, x, y in self._pairs(a, b)]
        found: Array = np.concatenate(there, axis=-1)
        return np.where(share == 0, a, np.where(share == 1, b, found))

    def between(self, a: Array, b: Array, t: float) -> Array:
        """`interpolate` for one pair (size,), without a word about the ends: certified checks ask
        for many places, one at a time."""
        if self.is_flat:
            straight: Array = a + t * (b - a)
            return straight
        return np.concatenate(
            [p.advance(x, t * p.difference(x, y)) for p, x, y in self._pairs(a, b)]
        )

    def middle(self, a: Array, b: Array) -> Array:
        """Half way between configurations (n, size), (n, size)."""
        if self.is_flat:
            half: Array = (a + b) / 2
            return half
        return self.interpolate(a, b, np.full(len(a), 0.5))

    def length(self, waypoints: Array) -> float:
        """Of a path of waypoints (k, size) that are joined by shortest ways."""
        return float(self.distance(waypoints[:-1], waypoints[1:]).sum())

    def unwrapped(self, waypoints: Array) -> Array:
        """A path of waypoints (k, size) whose numbers, from the first on, change as the shortest
        ways lead: beyond the bounds of coordinates that wrap. For whoever takes motions to be
        straight; of a space without rotations."""
        if self.is_flat:
            return waypoints
        steps = self.difference(waypoints[:-1], waypoints[1:])
        return np.concatenate([waypoints[:1], waypoints[:1] + np.cumsum(steps, axis=0)])

    def wrapped(self, q: Array) -> Array:
        """The same places as (n, size), whose numbers may be beyond the bounds of coordinates that
        wrap, with these between their bounds."""
        if self.is_flat:
            return q
        still = [np.zeros((*q.shape[:-1], part.dimension)) for part in self.parts]
        there = [p.advance(x, v) for (p, x, _), v in zip(self._pairs(q, q), still, strict=True)]
        return np.concatenate(there, axis=-1)

    def contains(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, size) are in it, but for rounding, (n,) of bool."""
        inside = [part.contains(x) for part, x, _ in self._pairs(q, q)]
        return np.asarray(np.logical_and.reduce(inside))

    def sample(self, rng: np.random.Generator, n: int) -> Array:
        """Uniform configurations, float64 (n, size)."""
        return np.concatenate([part.sample(rng, n) for part in self.parts], axis=-1)

    def narrowed(self, lower: Array, upper: Array) -> Space:
        """The same between narrower bounds (size,) of the coordinates that do not wrap."""
        between = self._pairs(lower, upper)
        return Space([part.narrowed(low, high) for part, low, high in between])

    def __str__(self) -> str:
        """What it is a product of, with weights other than 1, as in "R^3 x 0.5 SO(3)"."""
        named = ((part.weight, str(part)) for part in self.parts)
        return " x ".join(name if w == 1 else f"{w:.3g} {name}" for w, name in named)

    def definition(self) -> list[dict[str, Any]]:
        """All that defines it, as JSON data."""
        return [part.definition() for part in self.parts]

    @cached_property
    def places(self) -> list[slice]:
        """Where the numbers of each part are in a configuration."""
        ends = np.cumsum([part.size for part in self.parts]).tolist()
        return [slice(end - part.size, end) for part, end in zip(self.parts, ends, strict=True)]

    def _pairs(self, a: Array, b: Array) -> list[tuple[Part, Array, Array]]:
        """The parts, and their numbers of configurations (n, size)."""
        return [(p, a[..., at], b[..., at]) for p, at in zip(self.parts, self.places, strict=True)]
