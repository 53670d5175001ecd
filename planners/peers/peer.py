"""What other programs' planners have in common."""

from __future__ import annotations

import contextlib
from abc import abstractmethod
from functools import cached_property
from importlib import metadata
from typing import Any

import numpy as np

from envs.plain_scene import PlainScene
from envs.problem import Array, Problem
from planners.base import Budget, PlannerResult, Status
from planners.peers.guest import Guest, Installed


class NoPathError(Exception):
    """No path was found; why, in the words of who looked for one."""


class Peer(Guest):
    """A planner of another package, for arms, which it is told of as plain data.

    Args:
        python: see `Guest`.
    """

    improves = False
    plans_from_data = True
    checked_every: float | None = None
    """How far apart the states are that are checked along motions, where that can be said."""

    def lacking(self, found: Installed) -> str | None:
        if not found.missing:
            return None
        return (
            f"{self.distribution} is not installed; {self._advice}, or name an interpreter "
            "that has it: python=PATH"
        )

    @property
    def _advice(self) -> str:
        """How to install it."""
        if self.interpreter:
            return f"{self.interpreter} -m pip install numpy {self.distribution}"
        return f"pip install {self.distribution}"

    def refuses(self, scene: PlainScene) -> str | None:
        """Why it cannot plan in a scene, or None if it can: by default, where what moves is no arm,
        or one that cannot be said in a URDF."""
        if not scene.robot.joints:
            return f"{self.distribution} plans for arms"
        for joint in scene.robot.joints:
            if joint.kind == "spherical":
                return f"no URDF has joints like {joint.name!r}, which is spherical"
        return None

    @cached_property
    def _version(self) -> str:
        """Its name, and the version if it was installed as packages are."""
        with contextlib.suppress(metadata.PackageNotFoundError):
            return f"{self.distribution} {metadata.version(self.distribution)}"
        return self.distribution

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        stats: dict[str, Any] = {"library": self._version}
        if self.checked_every is not None:
            stats["checked_every"] = self.checked_every
        try:
            path = self.planned(problem, budget)
        except NoPathError as error:
            return PlannerResult(_status(str(error)), None, {**stats, "failure": str(error)})
        return PlannerResult(Status.EXACT_SOLUTION, path, stats)

    @abstractmethod
    def planned(self, problem: Problem, budget: Budget) -> Array:
        """A path (k, d).

        Raises:
            NoPathError: it has found none.
        """


def _status(said: str) -> Status:
    """That of an attempt, by what a program says of why it found no path."""
    words = said.lower()
    if "invalid" in words or "collision" in words:
        if "start" in words:
            return Status.INVALID_START
        if "goal" in words:
            return Status.INVALID_GOAL
    return Status.TIMEOUT


def shortest_ways(path: Array, wraps: Any) -> Array:
    """A path (k, d) of numbers that do not wrap, with waypoints between those of which a number
    that wraps would otherwise go the other way round."""
    made = [path[0]]
    for q in path[1:]:
        turn = float(np.abs(np.where(wraps, q - made[-1], 0.0)).max())
        count = int(turn // (0.9 * np.pi)) + 1
        made.extend(np.linspace(made[-1], q, count + 1)[1:])
    return np.array(made)
