"""Problems of arms among solids: their ends, and why a world has too few."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from envs.collision.fcl_model import CollisionModel
from envs.collision.part_scenes import PartScenes
from envs.problem import Array, Problem
from envs.robots import arm_clearance, rrt_connect
from envs.robots.allowed_collisions import FAR
from envs.robots.arm import Arm, RobotArrays
from envs.robots.arm_crowding import causes
from envs.robots.arm_motions import ArmMotions
from envs.scenes.sampled_problems import SampledEnds, SampledProblems
from envs.seeding import derived_seed, stream

_HOPELESS = 20
"""Times that 1024 random configurations hold no end, before a world is found to have none."""

_AT_A_TIME = 64
"""Random pairs of which it is asked whether they may be ends, before any is used."""

_LOOKED_AT = 256
"""Configurations at which the cause is sought."""


class ArmProblems(SampledProblems):
    """An environment whose robot is an arm, and its problems. A subclass says which arm stands
    among what.

    Args:
        kind: names the random streams of the problems, with `seeds`.

    Attributes:
        robot: the arm.
        min_clearance: least clearance of a problem's start and goal, in metres; of links from each
            other less, where they cannot come that far apart (see `kept`).
        min_separation: least distance between them, in radians.
        most_free_of_five: straight lines that may be free among five problems in a row.
    """

    robot: Arm
    min_clearance = 0.02
    min_separation = 1.0
    most_free_of_five = 5
    most_unjoined = 100
    most_fruitless = 2000

    def __init__(self, kind: str, seeds: tuple[int, ...]) -> None:
        self._kind = kind
        self._seeds = seeds

    @property
    @abstractmethod
    def scenes(self) -> PartScenes:
        """The obstacles as compiled code sees them, for each part."""

    @cached_property
    def _motions(self) -> ArmMotions:
        return ArmMotions(self.robot, self.scenes)

    @cached_property
    def _model(self) -> CollisionModel:
        return self.collision_model()

    @cached_property
    def kept(self) -> Array:
        """What parts keep from each other at a problem's ends, (p, p), in metres: `min_clearance`,
        or half of what they come apart beyond what planners must keep."""
        farthest, least = self.robot.link_pairs.farthest, self.planning_tolerance
        half = np.clip((farthest + least) / 2, least, self.min_clearance)
        return np.where(farthest < FAR, half, self.min_clearance)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform, as `min_clearance` and `min_separation` demand, and joined by a long
        search (`ArmMotions.join`); no more straight lines free than `most_free_of_five`."""
        found = self.sampled_ends(n, seed)
        return [
            Problem(start, goal, index, derived_seed(f"{self._kind} planner", seed, index))
            for index, (start, goal) in enumerate(found.pairs)
        ]

    def _random_numbers(self, seed: int) -> np.random.Generator:
        return stream(f"{self._kind} problems", seed, *self._seeds)

    def _cause(self, found: SampledEnds) -> str:
        if self.space.extent <= self.min_separation:
            return (
                f"start and goal must be {self.min_separation:g} apart (in radians, metres where a "
                "joint slides), and the joints' limits are narrower; widen them"
            )
        return (
            f"both ends must keep {self.min_clearance} m clear and be joined by a path, and of "
            f"five straight lines at most {self.most_free_of_five} be free; {self._tightness()}; "
            f"no path joined {found.dropped} pairs of ends; change what is about the arm, or links"
        )

    def _tightness(self) -> str:
        """How many configurations are no ends, and what is too near there."""
        q = self.space.sample(stream("crowding"), _LOOKED_AT)
        tight = 1 - self._may_be_end(q).mean()
        pairs, names = self.checked_pairs(), self.obstacle_names
        near = causes(self.robot, pairs, names, q, self.min_clearance, self.kept)
        if self.allowed is not None and not self.allowed(q).all():
            near.append(
                f"within a mesh or about what lies within in {1 - self.allowed(q).mean():.0%}"
            )
        often = f", most often {', '.join(near)}" if near else ""
        return f"of random configurations {tight:.0%} are too near to something{often}"

    def _take(
        self, found: SampledEnds, rng: np.random.Generator, start: Array, goal: Array
    ) -> bool:
        for_planners = self._is_free_for_planners(start, goal)
        if self._would_be_too_easy(found, start, goal):
            return False
        draws = self.space.sample(rng, rrt_connect.ITERATIONS)
        if not (for_planners or self._motions.join(start, goal, draws, self.planning_tolerance)):
            found.dropped += 1
            return False
        found.pairs.append((start, goal))
        return True

    def _would_be_too_easy(self, found: SampledEnds, start: Array, goal: Array) -> bool:
        """Whether with one more problem the straight lines of more than `most_free_of_five` would
        be free."""
        recent = found.pairs[len(found.pairs) - len(found.pairs) % 5 :]
        if len(recent) < self.most_free_of_five:
            return False
        free = sum(self._is_free(*ends) for ends in recent)
        return free == self.most_free_of_five and self._is_free(start, goal)

    def _is_free(self, start: Array, goal: Array) -> bool:
        """Whether the judge takes a straight line. What is free for planners is free for it, and
        asked in a hundredth of the time."""
        return self._is_free_for_planners(start, goal) or self._model.segment_is_free(start, goal)

    def _candidates(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Pairs that may be ends, until a hundred thousand in a row are refused, or thousands of
        configurations hold no end at all."""
        fruitless, none = 0, 0
        while fruitless < 100 and none < _HOPELESS:
            start, goal = np.split(self.space.sample(rng, 2 * 1024), 2)
            none, fruitless = none + 1, fruitless + 1
            for some in range(0, 1024, _AT_A_TIME):
                a, b = start[some : some + _AT_A_TIME], goal[some : some + _AT_A_TIME]
                keep = self.space.distance(a, b) >= self.min_separation
                keep[keep] &= self._are_clear(a[keep])
                none = 0 if any(map(self._is_outside, a[keep])) else none
                keep[keep] &= self._are_clear(b[keep])
                for ends in zip(a[keep], b[keep], strict=True):
                    if all(map(self._is_outside, ends)):
                        fruitless = 0
                        yield ends

    def _may_be_end(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, d) may be ends of problems."""
        keep = self._are_clear(q)
        keep[keep] = [self._is_outside(one) for one in q[keep]]
        return keep

    def _are_clear(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, d) keep the clearance that problems' ends do."""
        keep = arm_clearance.clearances(self._unpaired, self.scenes, q) >= self.min_clearance
        keep[keep] &= self.robot.links_keep(self.kept, q[keep])
        return keep

    def _is_outside(self, q: Array) -> bool:
        """Whether nothing is wholly within a mesh, at a configuration (d,). Asked one by one, as
        far as it is needed: it may take a millisecond."""
        return self.allowed is None or bool(self.allowed(q[None])[0])

    @cached_property
    def _unpaired(self) -> RobotArrays:
        """The arm whose links may touch each other."""
        arrays = self.robot.arrays
        return arrays._replace(branches=arrays.branches[:0])
