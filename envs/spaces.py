"""Configuration spaces: products of coordinates, some of which wrap, and of rotations in space.

A configuration is a row of numbers: those of each part, one after the other. The distance of two
configurations is the weighted sum of the parts' distances, as in OMPL's compound spaces, and the
shortest way between them is followed in all parts at once.

The coordinates of one part are measured together (Euclidean), so that a space of one part in which
nothing wraps is R^n, where distances are those of the numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from envs.space_parts import Coordinates, Factor, Kind, Part, Rotations

__all__ = ["Coordinates", "Factor", "Kind", "Part", "Rotations", "Space"]


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
