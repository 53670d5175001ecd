"""Solids that move among others, how near coal finds them to each other, and when a motion first
takes two of them too near: an independent check of ours, which shares nothing with it but rules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import coal
import numpy as np
from coal_shapes import ExactSolid
from exact_steps import (
    Frames,
    Pairs,
    Places,
    Solids,
    advance,
    each_apart_at_least,
    place,
    speeds,
    step_within,
)
from numpy.typing import NDArray

from envs.problem import Array

_AT_ONCE = 0.03
"""Of a motion: pairs of which only so much more is proved are asked at the same time."""

_MUCH = 0.02
"""Of a motion: where their hulls prove so much, surfaces are not asked."""

_ALMOST = 0.9
"""Of the time until two would be too near, if they went on as they did: where what is not proved is
looked at."""

_FARTHEST = 0.05
"""Of a motion: how far ahead of what is proved, at most."""

_SAME = 1e-9
"""Of a motion: nearer times are not told from each other."""


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
        self._moved = Solids(
            np.array(bodies),
            np.ascontiguousarray(offsets[:, :3, :3]),
            np.ascontiguousarray(offsets[:, :3, 3]),
            np.array([solid.middle for solid in solids]),
            np.array([solid.half for solid in solids]),
            np.array([solid.radius for solid in solids]),
        )
        self._request = coal.DistanceRequest()
        self.ask_of(pairs)

    def ask_of(self, pairs: Sequence[tuple[int, int]]) -> None:
        """From now on, whether these (p, 2) touch."""
        self.pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        self._told = [(int(a), int(b)) for a, b in self.pairs]
        moves = self.joints.moves
        apart = moves[self.pairs] & ~moves[self.pairs[:, ::-1]]  # (p, 2, m)
        each = np.concatenate([self.pairs.reshape(-1, 1), apart.reshape(-1, moves.shape[1])], 1)
        each, side_of = np.unique(each, axis=0, return_inverse=True)
        self.sides = each[:, 0].astype(np.int64)
        self.moved = each[:, 1:].astype(bool)
        sets, set_of = np.unique(self.moved, axis=0, return_inverse=True)
        self._asked = Pairs(
            self.pairs, side_of.reshape(-1, 2), self.sides, set_of.reshape(-1), sets
        )
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
        self._take(place(frames, self._moved))

    def _take(self, places: Places) -> None:
        self._places = places
        self._placed: dict[int, Any] = {}

    @property
    def turns(self) -> Array:
        return self._places.turns

    @property
    def centres(self) -> Array:
        return self._places.centres

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
        bends = self._bends_of_pairs(motion)
        while len(proved) and (t := float(proved.min())) < 1:
            for k, speed in self._advance(motion, t, floor, bends, proved):
                distance = self._distance(self._told[k], _gap(_MUCH, speed, bends[k]) + floor)
                if distance <= floor:
                    return Near(t, distance, self._told[k])
                step = step_within(max(distance - floor, least), speed, bends[k])
                proved[k] = max(proved[k], t + step)
        return None

    def soon_below(self, motion: Motion, floor: float, least: float) -> Near | None:
        """As `first_below`, in a fraction of the time where there is something to be found: a pair
        that comes nearer is looked at next where it would almost be too near if it went on like
        that, which nothing proves. So it may miss what is there, and what it finds may not be the
        first; but coal has found it there.
        """
        proved = np.zeros(len(self.pairs))
        bends = self._bends_of_pairs(motion)
        seen: dict[int, tuple[float, float]] = {}
        while len(proved) and (t := float(proved.min())) < 1:
            for k, speed in self._advance(motion, t, floor, bends, proved):
                distance = self._distance(self._told[k], _gap(_MUCH, speed, bends[k]) + floor)
                before = seen.get(k)
                seen[k] = t, distance
                if distance <= floor:
                    return self._begin(motion, k, floor, least, before or seen[k], seen[k])
                step = step_within(max(distance - floor, least), speed, bends[k])
                if before and distance < before[1]:
                    rate = (before[1] - distance) / (t - before[0])
                    step = max(step, min(_ALMOST * (distance - floor) / rate, _FARTHEST))
                proved[k] = max(proved[k], t + step)
        return None

    def _begin(
        self,
        motion: Motion,
        k: int,
        floor: float,
        least: float,
        apart: tuple[float, float],
        near: tuple[float, float],
    ) -> Near:
        """Where a pair comes to within a floor, or less than `least` nearer: between two times, of
        which it is so near at the later one, each with the distance; by secants and halves."""
        pair, halve = self._told[k], False
        while near[1] < floor - least and near[0] - apart[0] > _SAME:
            share = 0.5 if halve else (apart[1] - floor + least / 2) / (apart[1] - near[1])
            t = apart[0] + min(share, 1.0) * (near[0] - apart[0])
            self.place(motion.at(t))
            found = t, self._distance(pair, np.inf)
            if found[1] <= floor:
                near = found
            else:
                apart = found
            halve = not halve
        return Near(*near, pair)

    def _advance(
        self, motion: Motion, t: float, floor: float, bends: Array, proved: Array
    ) -> Iterator[tuple[int, float]]:
        """Takes the solids to where they are at a time, and proves of pairs what balls and boxes
        can; see `exact_steps.advance`.

        Yields:
            The pairs that coal must be asked of, and how fast they may come nearer.
        """
        frames, soon = motion.at(t), t + _AT_ONCE
        found = advance(t, soon, floor, frames, self._asked, self._moved, bends, proved)
        self._take(found[0])
        for k in found[1]:
            yield int(k), float(found[2][k])

    def speeds(self, frames: Frames) -> Array:
        """Bounds (s,) on the speeds of points of the solids of sides, where they are."""
        found: Array = speeds(frames, self._places, self._asked, self._moved)
        return found

    def bends(self, motion: Motion) -> Array:
        """Bounds (s,) on the accelerations of the same points, all along a motion."""
        found: Array = self._bends @ motion.speeds @ motion.speeds
        return found

    def _bends_of_pairs(self, motion: Motion) -> Array:
        """Bounds (p,), see `exact_steps.advance`."""
        found: Array = self.bends(motion)[self._asked.side_of].sum(axis=1)
        return found

    def _apart_at_least(self) -> Array:
        """How far pairs (p,) are apart at least, where solids were taken to last."""
        found: Array = each_apart_at_least(self._places, self._asked, self._moved)
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
            self._placed[n] = coal.Transform3s(self._places.turns[n], self._places.origins[n])
        return self._placed[n]

    def distance(self, frames: Frames) -> float:
        """The least distance of all pairs; not above 0: in contact."""
        self.place(frames)
        least = np.inf
        bounds = self._apart_at_least()
        for k in np.argsort(bounds):
            if bounds[k] >= least:
                break
            least = min(least, self._distance(self._told[k], least))
        return float(least)

    def touches(self, frames: Frames) -> bool:
        """Whether anything meets what it must not touch, or is within it."""
        return any(True for _ in self.touching(frames))

    def touching(self, frames: Frames) -> Any:
        """The pairs of which the one meets the other, or is within it."""
        self.place(frames)
        for k in np.flatnonzero(self._apart_at_least() <= 0):
            pair = self._told[k]
            if self._distance(pair, 1e-3) <= 0 or self._is_within(*pair):
                yield pair

    def _is_within(self, a: int, b: int) -> bool:
        """Whether the one is within the other, a mesh, or the other way round, if their surfaces
        do not meet."""
        for mesh, other in ((a, b), (b, a)):
            if self.solids[mesh].surface is not None:
                turns, origins = self._places.turns, self._places.origins
                points = self.solids[other].points @ turns[other].T + origins[other]
                if self.solids[mesh].encloses((points - origins[mesh]) @ turns[mesh]):
                    return True
        return False


def _gap(step: float, speed: float, bend: float) -> float:
    """How far such points may come in a time."""
    return step * speed + bend * step**2 / 2
