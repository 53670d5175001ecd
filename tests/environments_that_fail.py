"""Environments that break the contract in one way each, which `bench test-env` finds."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from envs import Environment, Problem, Spec
from envs.collision.ball_motions import BallAmongBoxes
from envs.collision.distance_fields import box_arrays
from envs.collision.motion_check import MotionCheck
from envs.collision.shapes import Box
from envs.problem import Array
from envs.robots.point import PointRobot
from envs.scenes.boxes import BoxWorld
from envs.seeding import derived_seed, stream
from envs.spaces import Coordinates, Space


class Faultless(BoxWorld):
    """A point robot between two walls that leave ways about them. Its problems are drawn without a
    proof that they can be solved, which would take longer than all checks.

    Args:
        walls: how many.
    """

    def __init__(self, walls: int = 2) -> None:
        sides = np.array([2.0, 14.0, 20.0])
        places = [[x, 3.0 * (-1) ** i, 0.0] for i, x in enumerate(np.linspace(-5, 5, walls))]
        super().__init__([Box(np.array(place), sides) for place in places], 0.1)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        rng = stream("faultless problems", seed)
        return [
            Problem(self.free(rng), self.free(rng), index, derived_seed("faultless", seed, index))
            for index in range(n)
        ]

    def free(self, rng: np.random.Generator) -> Array:
        """A place that keeps what it must, whatever `clearance` says."""
        while True:
            q = self.space.sample(rng, 1)
            if BoxWorld.clearance(self, q)[0] >= self.min_clearance:
                return q[0]

    def definition(self) -> dict[str, Any]:
        boxes = self.boxes_definition()
        return {"class": type(self).__name__, "boxes": boxes, **self.point_definition()}


class FarTooLarge(Faultless):
    def clearance(self, q: Array) -> Array:
        return super().clearance(q) + 1.3


class TooLarge(Faultless):
    def clearance(self, q: Array) -> Array:
        return super().clearance(q) + 0.2


class TooSmall(Faultless):
    def clearance(self, q: Array) -> Array:
        return super().clearance(q) - 0.2


class WrongInScenes(Faultless):
    """Right by itself, but not in the scenes of its problems."""

    scenes_differ = True

    def scene_of(self, problem: Problem) -> Environment:
        return TooLarge()


class ForgetsAWall(Faultless):
    """Has an obstacle of which only the collision model knows."""

    def __init__(self) -> None:
        super().__init__()
        behind = Box(np.array([8.5, 0.0, 0.0]), np.array([1.0, 18.0, 18.0]))
        self.obstacles = [*self.obstacles, behind]

    def free(self, rng: np.random.Generator) -> Array:
        while True:
            q = super().free(rng)
            if q[0] < 7:
                return q


class ProvesTooMuch(Faultless):
    """Its compiled proofs forget a wall."""

    def motion_check(self, tolerance: float) -> Any:
        boxes = box_arrays(self._boxes[:1])
        return MotionCheck(BallAmongBoxes(*boxes, self.robot.radius, tolerance))


class SearchesTooLittle(Faultless):
    """The judge's search forgets a wall."""

    @property
    def searcher(self) -> Any:
        return Faultless(1).searcher


class Raises(Faultless):
    def clearance(self, q: Array) -> Array:
        raise KeyError("no\nsuch wall")


class NotANumber(Faultless):
    def clearance(self, q: Array) -> Array:
        found = super().clearance(q)
        return np.where(q[:, 0] > 9, np.nan, found)


class Column(Faultless):
    def clearance(self, q: Array) -> Array:
        return super().clearance(q)[:, None]


class WritesToConfigurations(Faultless):
    def clearance(self, q: Array) -> Array:
        found = super().clearance(q)
        q += 1
        return found


class OfTheBatch(Faultless):
    """Says the mean of all configurations that it is asked about."""

    def clearance(self, q: Array) -> Array:
        found = super().clearance(q)
        return np.full(len(q), found.mean())


class Slow(PointRobot):
    """Says that it moves half as far as it does."""

    def motion_bound(self, a: Array, b: Array) -> float:
        return super().motion_bound(a, b) / 2


class SlowRobot(Faultless):
    def __init__(self) -> None:
        super().__init__()
        self.robot = Slow(0.1)


class WiderSpace(Faultless):
    @property
    def space(self) -> Space:
        return Space([Coordinates(2 * self.lower, 2 * self.upper)])


class Chance(Faultless):
    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return super().sample_problems(n, int(np.random.default_rng().integers(2**31)))


class IgnoresSeed(Faultless):
    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return super().sample_problems(n, 0)


class StartsInCollision(Faultless):
    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return [
            Problem(self.obstacles[0].center, p.goal, 3, p.seed) if p.index == 3 else p
            for p in super().sample_problems(n, seed)
        ]


class GoesNowhere(Faultless):
    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return [
            Problem(p.start, p.start, p.index, p.seed) for p in super().sample_problems(n, seed)
        ]


class Unpicklable(Faultless):
    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.Lock()


class LosesItsWalls(Faultless):
    """When it is pickled."""

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "_boxes": []}


class NoJson(Faultless):
    def definition(self) -> dict[str, Any]:
        return {**super().definition(), "bounds": self.lower}


class NanInDefinition(Faultless):
    def definition(self) -> dict[str, Any]:
        return {**super().definition(), "gap": float("nan")}


class Counts(Faultless):
    """Has another definition each time that it is made."""

    made = 0

    def __init__(self) -> None:
        super().__init__()
        Counts.made += 1
        self.number = Counts.made

    def definition(self) -> dict[str, Any]:
        return {**super().definition(), "number": self.number}


class HidesArgument(Faultless):
    def definition(self) -> dict[str, Any]:
        return {"class": "HidesArgument"}


class NoSpeedAtContact(Faultless):
    def speed(self, q: Array) -> Array:
        return np.maximum(super().speed(q) - 0.5, 0.0)


class CannotBeMade(Faultless):
    def __init__(self) -> None:
        raise ZeroDivisionError("walls")


def specs() -> list[Spec]:
    """One for each class, by its name; strangers', as those of packages are."""
    classes = [cls for cls in globals().values() if isinstance(cls, type)]
    theirs = [cls for cls in classes if issubclass(cls, Faultless)]
    return [
        Spec(cls.__name__, f"{__name__}:{cls.__name__}", "to be checked", origin="a test")
        for cls in theirs
    ]
