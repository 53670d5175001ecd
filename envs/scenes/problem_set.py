"""Sets of problems of one robot, each in a scene of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from envs.collision.shapes import Bodies, PlacedShape
from envs.environment import Environment
from envs.errors import InputError
from envs.problem import Array, Problem
from envs.robots.arm import Arm
from envs.robots.drawn_arm import DrawnArm
from envs.scenes.arm_world import ArmWorld
from envs.seeding import derived_seed

_ROUNDING = 1e-5
"""Radians or metres by which values of problems may be beyond a joint's limit: they are rounded."""

_CLEARANCE = 4e-4
"""Metres that ends keep clear, as far as planners and judge rely on it; the judge decides to a
quarter of it. The nearest of the first 490 problems of MotionBenchMaker's panda and ur5 keep 2.7
and 0.8 mm."""


@dataclass(frozen=True)
class SetScene:
    """What one problem is among.

    Attributes:
        arm: the robot, whose links may touch as its own files and the scene allow.
        obstacles: in the frame of the world, in metres.
        names: of the obstacles.
        allows: whether a link may touch an obstacle, by their names; None if none may any.
    """

    arm: Arm
    obstacles: Sequence[PlacedShape]
    names: Sequence[str]
    allows: Callable[[str, str], bool] | None = None


class PosedProblems(ABC):
    """What the files of a set say."""

    @property
    @abstractmethod
    def name(self) -> str:
        """What messages call it."""

    @property
    @abstractmethod
    def digest(self) -> str:
        """Of all that is in it."""

    @property
    @abstractmethod
    def urdf(self) -> Path:
        """The robot's file."""

    @property
    @abstractmethod
    def indices(self) -> Sequence[int]:
        """Those of its problems, in ascending order, at least one."""

    @abstractmethod
    def scene(self, index: int) -> SetScene:
        """That of a problem.

        Raises:
            InputError: there is none, or it cannot be used.
        """

    @abstractmethod
    def ends(self, index: int) -> tuple[Array, Array]:
        """The start (d,) of a problem and its goals (g, d), of which any will do. They may be
        beyond the joints' limits.

        Raises:
            InputError: there is none, or it cannot be used.
        """

    def statistics(self) -> Mapping[str, float]:
        """What is worth knowing of the set, see `Environment.problem_statistics`."""
        return {}


class _OfSet(ArmWorld):
    """A world whose robot is drawn as its URDF draws it."""

    urdf: Path

    @property
    def robot_name(self) -> str:
        return self.urdf.stem

    @cached_property
    def drawn_robot(self) -> Bodies:
        return DrawnArm(self.robot, self.urdf)


class ProblemSet(_OfSet):
    """A set of problems that others have made, the same whatever the seed, which the planners' own
    are drawn by; or one of its scenes, in which problems are drawn at random.

    Args:
        posed: the set.
        kind: names the random streams.
        alone: the index of the problem whose scene is the only one; None for all.

    Raises:
        InputError: a file of it cannot be used.
    """

    def __init__(self, posed: PosedProblems, kind: str, alone: int | None) -> None:
        self._posed, self.urdf = posed, posed.urdf
        self.scenes_differ = alone is None
        self._last: tuple[int, Environment] | None = None
        if alone is None:
            super().__init__(posed.scene(posed.indices[0]).arm, (), kind)
            self.min_clearance = _CLEARANCE
            self.problem_count = len(posed.indices)
        else:
            scene = posed.scene(alone)
            names, allows = scene.names, scene.allows
            super().__init__(scene.arm, scene.obstacles, kind, (alone + 1,), names, allows)

    def scene_of(self, problem: Problem) -> Environment:
        if not self.scenes_differ:
            return self
        if self._last is None or self._last[0] != problem.index:
            scene = self._posed.scene(problem.index)
            self._last = problem.index, _SceneOfOne(scene, self._kind, problem.index, self.urdf)
        return self._last[1]

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        if not self.scenes_differ:
            return super().sample_problems(n, seed)
        indices = self._posed.indices
        if n > len(indices):
            have = f"{self._posed.name} has {len(indices)} problems"
            raise InputError(f"{self._kind}: {have}, not {n}")
        return self.problems_at(indices[:n], seed)

    def problems_at(self, indices: Sequence[int], seed: int) -> list[Problem]:
        if not self.scenes_differ:
            return super().problems_at(indices, seed)
        return [self._problem(index, seed) for index in indices]

    def _problem(self, index: int, seed: int) -> Problem:
        start, goals = self._posed.ends(index)
        start, goals = _rounded(self.robot, start[None])[0], _rounded(self.robot, goals)
        planner_seed = derived_seed(f"{self._kind} planner", seed, index)
        several = goals if len(goals) > 1 else None
        return Problem(start, goals[0], index, planner_seed, several)

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        if self.scenes_differ:
            return dict(self._posed.statistics())
        return super().problem_statistics(n, seed)

    def definition(self) -> dict[str, Any]:
        definition = {**super().definition(), "class": type(self).__name__}
        if self.scenes_differ:
            definition |= {"problems": self._posed.digest, "obstacles": []}
        return definition


class _SceneOfOne(_OfSet):
    """The scene of one problem."""

    min_clearance = _CLEARANCE

    def __init__(self, scene: SetScene, kind: str, index: int, urdf: Path) -> None:
        self.urdf = urdf
        names, allows = scene.names, scene.allows
        super().__init__(scene.arm, scene.obstacles, kind, (index + 1,), names, allows)


def _rounded(arm: Arm, q: Array) -> Array:
    """Configurations (n, d) with joints within limits that they are beyond by rounding, and those
    that wrap between -pi and pi."""
    q = arm.tree.space.wrapped(q)
    clipped = q.clip(arm.tree.lower, arm.tree.upper)
    return np.where(np.abs(clipped - q) <= _ROUNDING, clipped, q)
