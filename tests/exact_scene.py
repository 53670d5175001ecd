"""Solids that move among others, how near coal finds them to each other, and when a motion first
takes two of them too near: an independent check of ours, which shares nothing with it but rules."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import coal
import numpy as np
from coal_shapes import ExactSolid
from numpy.typing import NDArray

from envs.problem import Array

_AT_ONCE = 0.01
"""Of a motion: pairs of which only so much more is proved are asked at the same time."""

_MUCH = 0.05
"""Of a motion: where their hulls prove so much, surfaces are not asked."""


class Frames(NamedTuple):
    """Where bodies are, and how fast joints move them, at one time of a motion.

    Attributes:
        turns, shifts: (b, 3, 3) and (b, 3), of the bodies' frames; the first stands still.
        velocities, turning: (m, 3) each, of what is rigidly on each joint: linear, of the point
            that is at the world's origin, and angular, per unit of time.
    """

    turns: Array
    shifts: Array
    velocities: Array
    turning: Array


class Motion(Protocol):
    """Of a robot, in unit time, whose joints move steadily.

    Attributes:
        speeds: (m,) of the joints, not below 0, in radians or metres.
    """

    speeds: Array

    def at(self, t: float) -> Frames: ...


class Joints(NamedTuple):
    """What joints may do to solids.

    Attributes:
        moves: (g, m) of bool, which solids each moves. A joint that another carries comes later.
        turns: (m,) of bool, whether each turns; else it slides.
        reaches: (m, g) the greatest distance of any point of a solid from where the joint's axis
            begins, of those that turn.
    """

    moves: NDArray[np.bool_]
    turns: NDArray[np.bool_]
    reaches: Array


class Near(NamedTuple):
    """Where two solids come too near to each other: the time, their distance, and the pair."""

    t: float
    distance: float
    pair: tuple[int, int]


class ExactScene:
    """Solids on bodies that joints move.

    Args:
        solids: (g,) of all.
        bodies: (g,) that they are on.
        offsets: (g, 4, 4) from their frames to the bodies'.
        joints: what moves them.
        pairs: (p, 2) which must not touch.

    Attributes:
        sides, moved: (s,) and (s, m) of bool, of each solid of each pair what of the joints moves
            it and not the other: a pair is seen from the body on which the two branch.
        turns, centres: (g, 3, 3) and (g, 3), of the solids, where they were taken to last.
    """

    def __init__(
        self,
        solids: Sequence[ExactSolid],
        bodies: Sequence[int],
        offsets: Array,
        joints: Joints,
        pairs: Sequence[tuple[int, int]],
    ) -> None:
        self.solids = solids
        self.joints = joints
        self._bodies = np.array(bodies)
        self._turns, self._shifts = offsets[:, :3, :3], offsets[:, :3, 3]
        self._middles = np.einsum(
            "gij,gj->gi", self._turns, np.array([solid.middle for solid in solids])
        )
        self._halves = np.array([solid.half for solid in solids])
        self._radii = np.array([solid.radius for solid in solids])
        self._request = coal.DistanceRequest()
        self.ask_of(pairs)

    def ask_of(self, pairs: Sequence[tuple[int, int]]) -> None:
        """From now on, whether these (p, 2) touch."""
        self.pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        moves = self.joints.moves
        apart = moves[self.pairs] & ~moves[self.pairs[:, ::-1]]  # (p, 2, m)
        sides = np.concatenate([self.pairs.reshape(-1, 1), apart.reshape(-1, moves.shape[1])], 1)
        sides, which = np.unique(sides, axis=0, return_inverse=True)
        self._side_of = which.reshape(-1, 2)
        self.sides = sides[:, 0].astype(np.int64)
        self.moved = sides[:, 1:].astype(bool)
        bends = [self._bend(*side) for side in zip(self.sides, self.moved, strict=True)]
        self._bends = np.array(bends).reshape(-1, *2 * moves.shape[1:])

    def _bend(self, solid: int, moved: NDArray[np.bool_]) -> Array:
        """By what the speeds of two joints (m, m) are multiplied in the acceleration of a point of
        a solid that some joints move: with z the axes, z x (z' x r) of two that turn, r from the
        outer one's axis to the point, z x z' of one that slides on one that turns, and otherwise
        nothing."""
        joints = self.joints
        m = len(joints.turns)
        arm = np.where(joints.turns, joints.reaches[:, solid], 1.0)
        outer, inner = np.maximum.outer(range(m), range(m)), np.minimum.outer(range(m), range(m))
        found: Array = arm[outer] * joints.turns[inner] * np.outer(moved, moved)
        return found

    def place(self, frames: Frames) -> None:
        """Takes the solids to where their bodies are."""
        turns = frames.turns[self._bodies]
        self.turns = turns @ self._turns
        self._origins = frames.shifts[self._bodies] + np.einsum("gij,gj->gi", turns, self._shifts)
        self.centres = self._origins + np.einsum("gij,gj->gi", turns, self._middles)
        self._placed: dict[int, Any] = {}

    def first_below(self, motion: Motion, floor: float, least: float) -> Near | None:
        """Where a motion first takes two solids to within a distance of each other, if it does.

        By conservative advancement, each pair for itself: what coal finds between two solids at a
        time proves the motion for as long as they cannot have come nearer by more.

        Args:
            floor: the distance.
            least: how far, in the unit of lengths, points move at least from one time that is
                looked at to the next; a pair that is hardly more than `floor` apart is sampled so.
        """
        proved = np.zeros(len(self.pairs))
        bends = self.bends(motion)[self._side_of].sum(axis=1)
        while len(proved) and (t := proved.min()) < 1:
            frames = motion.at(t)
            self.place(frames)
            todo = np.flatnonzero(proved < 1)
            speeds = self.speeds(frames)[self._side_of[todo]].sum(axis=1)
            gaps = self._apart_at_least(self.pairs[todo]) - floor
            proved[todo] = np.maximum(proved[todo], t + _steps(gaps, speeds, bends[todo]))
            for k, speed in zip(todo, speeds, strict=True):
                if proved[k] <= t + _AT_ONCE:
                    pair, bend = self.pairs[k], bends[k]
                    distance = self._distance(pair, _gap(_MUCH, speed, bend) + floor)
                    if distance <= floor:
                        return Near(t, distance, (int(pair[0]), int(pair[1])))
                    step = _steps(np.array([max(distance - floor, least)]), speed, bend)[0]
                    proved[k] = max(proved[k], t + step)
        return None

    def speeds(self, frames: Frames) -> Array:
        """Bounds (s,) on the speeds of points of the solids of sides, where they are."""
        linear = np.einsum("sm,mi->si", self.moved, frames.velocities)
        angular = np.einsum("sm,mi->si", self.moved, frames.turning)
        at_middle = linear + np.cross(angular, self.centres[self.sides])
        turned = np.linalg.norm(angular, axis=1) * self._radii[self.sides]
        found: Array = np.linalg.norm(at_middle, axis=1) + turned
        return found

    def bends(self, motion: Motion) -> Array:
        """Bounds (s,) on the accelerations of the same points, all along a motion."""
        found: Array = np.einsum("sij,i,j->s", self._bends, motion.speeds, motion.speeds)
        return found

    def _apart_at_least(self, pairs: NDArray[np.int64]) -> Array:
        """How far pairs (n, 2) are apart at least: by balls about them, and by a ball about the one
        and a box about the other."""
        a, b = pairs.T
        between = self.centres[a] - self.centres[b]
        reach = self._radii[a] + self._radii[b]
        found: Array = np.linalg.norm(between, axis=1) - reach
        for box, ball in ((a, b), (b, a)):
            along = np.abs(np.einsum("nij,ni->nj", self.turns[box], between))
            beyond = np.linalg.norm(np.maximum(along - self._halves[box], 0), axis=1)
            found = np.maximum(found, beyond - self._radii[ball])
        return found

    def _distance(self, pair: Sequence[int], enough: float) -> float:
        """How far two are apart, or something from `enough` on that is less."""
        a, b = (self.solids[n] for n in pair)
        convex = a.hull is a.geometry and b.hull is b.geometry
        found = self.by_coal(pair, a.hull, b.hull)
        if convex or found >= enough:
            return found
        return self.by_coal(pair, a.geometry, b.geometry)

    def by_coal(self, pair: Sequence[int], a: Any, b: Any) -> float:
        at_a, at_b = (self._transform(n) for n in pair)
        return float(coal.distance(a, at_a, b, at_b, self._request, coal.DistanceResult()))

    def _transform(self, n: int) -> Any:
        if n not in self._placed:
            self._placed[n] = coal.Transform3s(self.turns[n], self._origins[n])
        return self._placed[n]

    def distance(self, frames: Frames) -> float:
        """The least distance of all pairs; not above 0: in contact."""
        self.place(frames)
        least = np.inf
        bounds = self._apart_at_least(self.pairs)
        for k in np.argsort(bounds):
            if bounds[k] >= least:
                break
            least = min(least, self._distance(self.pairs[k], least))
        return float(least)

    def touches(self, frames: Frames) -> bool:
        """Whether anything meets what it must not touch, or is within it."""
        return any(True for _ in self.touching(frames))

    def touching(self, frames: Frames) -> Any:
        """The pairs of which the one meets the other, or is within it."""
        self.place(frames)
        for k in np.flatnonzero(self._apart_at_least(self.pairs) <= 0):
            pair = self.pairs[k]
            if self._distance(pair, 1e-3) <= 0 or self._is_within(*pair):
                yield int(pair[0]), int(pair[1])

    def _is_within(self, a: int, b: int) -> bool:
        """Whether the one is within the other, a mesh, or the other way round, if their surfaces
        do not meet."""
        for mesh, other in ((a, b), (b, a)):
            if self.solids[mesh].surface is not None:
                points = self.solids[other].points @ self.turns[other].T + self._origins[other]
                if self.solids[mesh].encloses((points - self._origins[mesh]) @ self.turns[mesh]):
                    return True
        return False


def _steps(gaps: Array, speeds: Any, bends: Any) -> Array:
    """For how long points that begin at some speed, and are accelerated by no more than `bends`,
    move no farther than the gaps, (n,)."""
    gaps = np.maximum(gaps, 0)
    under = speeds + np.sqrt(speeds**2 + 2 * bends * gaps)
    return np.divide(2 * gaps, under, out=np.where(gaps > 0, np.inf, 0.0), where=under > 0)


def _gap(step: float, speed: float, bend: float) -> float:
    """How far such points may come in a time."""
    return step * speed + bend * step**2 / 2
