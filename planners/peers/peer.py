"""What other programs' planners have in common."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import subprocess
import sys
from abc import abstractmethod
from functools import cached_property, lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from envs.errors import InputError
from envs.plain_scene import PlainScene
from envs.problem import Array, Problem
from planners.base import Budget, Planner, PlannerResult, Status

_LOOK_S = 60.0  # for another Python to say whether it has a package


class NoPathError(Exception):
    """No path was found; why, in the words of who looked for one."""


class Peer(Planner):
    """A planner of another package, for arms.

    Class attributes:
        package: that is imported.
        distribution: what it is installed as.

    Args:
        python: the interpreter that has the package, by its path; by default this one.

    Raises:
        InputError: there is no such file.
    """

    improves = False
    plans_from_data = True
    package: ClassVar[str]
    distribution: ClassVar[str]

    def __init__(self, python: str = "") -> None:
        if python:
            file = os.path.abspath(Path(python).expanduser())  # noqa: PTH100  links are kept
            if not os.access(file, os.X_OK) or Path(file).is_dir():
                raise InputError(f"{self.distribution}: python={python} is no program; name one")
            self.interpreter = file

    def unsupported(self, env: Any) -> str | None:
        """Of plain data."""
        if not self._is_there:
            return (
                f"{self.distribution} is not installed; {self._advice}, or name an interpreter "
                "that has it: python=PATH"
            )
        return self.refuses(env)

    @property
    def _advice(self) -> str:
        """How to install it."""
        if self.interpreter:
            return f"{self.interpreter} -m pip install numpy {self.distribution}"
        return f"pip install {self.distribution}"

    @property
    def _is_there(self) -> bool:
        """Whether the interpreter has the package."""
        if not self.interpreter or self.interpreter == sys.executable:
            return importlib.util.find_spec(self.package) is not None
        return _has(self.interpreter, self.package)

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
        stats = {"library": self._version}
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


@lru_cache(maxsize=32)
def _has(interpreter: str, package: str) -> bool:
    """Whether another Python has NumPy and a package."""
    code = f"import importlib.util as u; print(all(map(u.find_spec, ('numpy', {package!r}))))"
    asked = [interpreter, "-I", "-c", code]
    try:
        said = subprocess.run(asked, capture_output=True, text=True, timeout=_LOOK_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return said.stdout.strip() == "True"


def shortest_ways(path: Array, wraps: Any) -> Array:
    """A path (k, d) of numbers that do not wrap, with waypoints between those of which a number
    that wraps would otherwise go the other way round."""
    made = [path[0]]
    for q in path[1:]:
        turn = float(np.abs(np.where(wraps, q - made[-1], 0.0)).max())
        count = int(turn // (0.9 * np.pi)) + 1
        made.extend(np.linspace(made[-1], q, count + 1)[1:])
    return np.array(made)
