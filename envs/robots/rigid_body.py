"""Rigid bodies that move in the plane or in space, or only translate."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from envs.collision.shapes import PlacedShape, Solid
from envs.compiled import njit_hot
from envs.problem import Array
from envs.spaces import Coordinates, Rotations, Space


class Placement(ABC):
    """How configurations place a body: its configuration space, and the poses in it.

    Attributes:
        space: first the coordinates of the position, then what turns, if anything does; a radian
            of turning counts as its weight.
    """

    space: Space

    @abstractmethod
    def positions(self, q: Array) -> Array:
        """Where the origin of the body's frame is, (n, 3), at configurations (n, size)."""

    @abstractmethod
    def rotations(self, q: Array) -> Array:
        """From the body's frame to the workspace, (n, 3, 3), at configurations (n, size)."""

    @abstractmethod
    def speeds(self, a: Array, b: Array) -> tuple[float, float]:
        """How fast the origin moves, in workspace units, and the body turns, in radians, in unit
        time on the shortest way between two configurations (size,)."""


class Translation(Placement):
    """R^3: the body does not turn.

    Args:
        lower, upper: (3,) bounds of positions.
    """

    def __init__(self, lower: Array, upper: Array) -> None:
        self.space = Space([Coordinates(lower, upper)])

    def positions(self, q: Array) -> Array:
        return q

    def rotations(self, q: Array) -> Array:
        return np.broadcast_to(np.eye(3), (len(q), 3, 3))

    def speeds(self, a: Array, b: Array) -> tuple[float, float]:
        return math.dist(a, b), 0.0


class InThePlane(Placement):
    """SE(2): x, y and the heading, by which the body's frame is turned about z.

    Args:
        lower, upper: (3,) bounds of positions.
        z: of the plane.
        weight: of a radian, in workspace units.
    """

    def __init__(self, lower: Array, upper: Array, z: float, weight: float) -> None:
        heading = Coordinates([-math.pi], [math.pi], wraps=[True], weight=weight)
        self.space = Space([Coordinates(lower[:2], upper[:2]), heading])
        self._z = z

    def positions(self, q: Array) -> Array:
        return np.column_stack([q[:, :2], np.full(len(q), self._z)])

    def rotations(self, q: Array) -> Array:
        cosine, sine = np.cos(q[:, 2]), np.sin(q[:, 2])
        found = np.zeros((len(q), 3, 3))
        found[:, 0, 0] = found[:, 1, 1] = cosine
        found[:, 1, 0], found[:, 0, 1] = sine, -sine
        found[:, 2, 2] = 1.0
        return found

    def speeds(self, a: Array, b: Array) -> tuple[float, float]:
        turn = abs(math.remainder(b[2] - a[2], 2 * math.pi))
        return math.dist(a[:2], b[:2]), turn


class InSpace(Placement):
    """SE(3): the position, and a unit quaternion x, y, z, w that turns the body's frame.

    Args:
        lower, upper: (3,) bounds of positions.
        weight: of a radian, in workspace units.
    """

    def __init__(self, lower: Array, upper: Array, weight: float) -> None:
        self.space = Space([Coordinates(lower, upper), Rotations(weight)])

    def positions(self, q: Array) -> Array:
        return q[:, :3]

    def rotations(self, q: Array) -> Array:
        found = np.empty((len(q), 3, 3))
        _matrices(np.asarray(q[:, 3:], dtype=np.float64), found)
        return found

    def speeds(self, a: Array, b: Array) -> tuple[float, float]:
        # By the tangent of a quarter of the turn: exact for small turns, where arccos is not.
        u, v = a[3:] / math.hypot(*a[3:]), b[3:] / math.hypot(*b[3:])
        apart, together = math.dist(u, v), math.dist(u, -v)
        turn = 4 * math.atan2(min(apart, together), max(apart, together))
        return math.dist(a[:3], b[:3]), turn


class RigidBody:
    """A body of solids. See `envs.collision.shapes.Robot`.

    Args:
        parts: its solids, in the body's frame.
        placement: how configurations place it.

    Raises:
        ValueError: there are no parts.

    Example:
        >>> import numpy as np
        >>> from envs.collision.shapes import Box, PlacedShape
        >>> bar = PlacedShape(Box([0, 0, 0], [2, 0.2, 0.2]), np.eye(4))
        >>> where = InThePlane(np.full(3, -5.0), np.full(3, 5.0), z=0.0, weight=1.0)
        >>> body = RigidBody([bar], where)
        >>> [pose] = body.poses(np.array([1.0, 2.0, np.pi / 2]))
        >>> (pose @ [1, 0, 0, 1]).round(3)
        array([1., 3., 0.])
    """

    pairs: tuple[tuple[int, int], ...] = ()

    def __init__(self, parts: Sequence[PlacedShape], placement: Placement) -> None:
        if not parts:
            raise ValueError("a body needs at least one solid")
        self.parts = tuple(parts)
        self.placement = placement
        self._turns = np.array([part.pose[:3, :3] for part in parts])
        self._shifts = np.array([part.pose[:3, 3] for part in parts])

    @property
    def shapes(self) -> tuple[Solid, ...]:
        return tuple(part.solid for part in self.parts)

    @property
    def moving(self) -> int:
        return len(self.parts)

    @cached_property
    def radius(self) -> float:
        """Of a ball about the origin of its frame that holds it."""
        return radius_of(self.parts)

    @cached_property
    def cover(self) -> Cover:
        """Spheres that cover it, and reach out of its sides by little."""
        return Cover.of(self.parts, SLACK * _coarse_radius(self.parts))

    @cached_property
    def rate_bound(self) -> float:
        """Positions move all points alike, a radian moves none by more than the radius; on the way
        both add up, as distances do."""
        position, *turns = self.placement.space.parts
        bounds = [1 / position.weight, *(self.radius / turn.weight for turn in turns)]
        return max(bounds)

    def poses(self, q: Array) -> Array:
        [turn], [shift] = self.placement.rotations(q[None]), self.placement.positions(q[None])
        turns, shifts = turn @ self._turns, self._shifts @ turn.T + shift
        return np.concatenate([turns, shifts[:, :, None]], axis=2)

    def motion_bound(self, a: Array, b: Array) -> float:
        moved, turned = self.placement.speeds(a, b)
        return moved + turned * self.radius

    def trace(self, q: Array) -> Array:
        return self.placement.positions(q)[:, None]

    def placed(self, points: Array, q: Array) -> Array:
        """Where points (m, 3) of the body's frame are, (n, m, 3), at configurations (n, size)."""
        turned = points @ np.swapaxes(self.placement.rotations(q), 1, 2)
        there: Array = turned + self.placement.positions(q)[:, None]
        return there


@njit_hot
def _matrices(quaternions: Any, found: Any) -> None:
    """Writes the matrices (n, 3, 3) of quaternions x, y, z, w (n, 4), whose lengths are made 1:
    those of judged paths may be off by 1e-6."""
    for n in range(len(quaternions)):
        x, y, z, w = quaternions[n, 0], quaternions[n, 1], quaternions[n, 2], quaternions[n, 3]
        double = 2.0 / (x * x + y * y + z * z + w * w)
        found[n, 0, 0] = 1.0 - double * (y * y + z * z)
        found[n, 0, 1] = double * (x * y - z * w)
        found[n, 0, 2] = double * (x * z + y * w)
        found[n, 1, 0] = double * (x * y + z * w)
        found[n, 1, 1] = 1.0 - double * (x * x + z * z)
        found[n, 1, 2] = double * (y * z - x * w)
        found[n, 2, 0] = double * (x * z - y * w)
        found[n, 2, 1] = double * (y * z + x * w)
        found[n, 2, 2] = 1.0 - double * (x * x + y * y)


SLACK = 0.02
"""By how much spheres that cover a body may reach out of its sides, as a share of its radius."""


@dataclass(frozen=True, eq=False)
class Cover:
    """Spheres that cover a body.

    Attributes:
        centers, radii: (m, 3) in the body's frame and (m,).
    """

    centers: Array
    radii: Array

    @staticmethod
    def of(parts: Sequence[PlacedShape], slack: float) -> Cover:
        """See `Solid.sphere_cover`."""
        covers = [part.solid.sphere_cover(slack) for part in parts]
        placed = [
            cover.centers @ part.pose[:3, :3].T + part.pose[:3, 3]
            for cover, part in zip(covers, parts, strict=True)
        ]
        radii = np.concatenate([cover.radii for cover in covers])
        return Cover(np.concatenate(placed), radii)


def radius_of(parts: Sequence[PlacedShape]) -> float:
    """Of a ball about the origin that holds some solids; larger than need be by little."""
    coarse = _coarse_radius(parts)
    cover = Cover.of(parts, SLACK * coarse)
    fine = float((np.linalg.norm(cover.centers, axis=1) + cover.radii).max())
    return min(coarse, fine)


def _coarse_radius(parts: Sequence[PlacedShape]) -> float:
    """By the spheres that hold each of the solids."""
    farthest = 0.0
    for part in parts:
        middle, radius = part.solid.bounding_sphere()
        middle = part.pose[:3, :3] @ middle + part.pose[:3, 3]
        farthest = max(farthest, float(np.linalg.norm(middle)) + radius)
    return farthest
