"""MotionBenchMaker's problem sets: of four robots, each problem in a scene of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from envs.environment import Environment
from envs.errors import InputError, suggestion
from envs.files.fetched import fetch
from envs.files.moveit_scene import (
    MotionRequest,
    PlanningScene,
    read_motion_request,
    read_planning_scene,
)
from envs.files.paths import cache_folder
from envs.files.problem_archive import ProblemFiles, read_problem_files
from envs.problem import Array, Problem
from envs.robots.arm import Arm
from envs.robots.joint_graph import JointGraph
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import Srdf, read_srdf
from envs.robots.urdf import read_urdf
from envs.robots.urdf_elements import parsed
from envs.scenes.arm_world import ArmWorld
from envs.scenes.motion_bench_maker_sets import SETS
from envs.seeding import derived_seed

URL = (
    "https://raw.githubusercontent.com/KavrakiLab/vamp/"
    "f6de6a72e0725ba08e0829f0a34261a3f465aed7/resources"
)
"""Where the robots and problems are (Apache-2.0)."""

_ARCHIVE = "problems.tar.bz2"

_ROUNDING = 1e-5
"""Radians or metres by which values of problems may be beyond a joint's limit: they are rounded."""

_CLEARANCE = 4e-4
"""Metres that ends keep clear, as far as planners and judge rely on it; the judge decides to a
quarter of it. The nearest of panda's and ur5's first 490 problems keep 2.7 and 0.8 mm."""


class MotionBenchMaker(ArmWorld):
    """A set of MotionBenchMaker (Chamzas et al., "MotionBenchMaker: A Tool to Generate and
    Benchmark Motion Planning Datasets", IEEE RA-L 7(2), 2022), or one of its scenes.

    The problems of a set are those of its requests, whatever the seed, which the planners' own are
    drawn by: the problem with index k is that of request k + 1. Each lives in the scene of that
    number: the robot, with its own allowed collisions and the scene's, among boxes and cylinders.
    Joints of no planning group stand as in the first request.

    Args:
        robot: "panda", "ur5", "fetch" or "baxter".
        set: of its problems, see `SETS`.
        scene: the number of a scene, which is then the only one, and whose problems are drawn at
            random (see `ArmWorld.sample_problems`); 0 for all.

    Raises:
        InputError: there is no such robot, set or scene, or its files are not at hand.
    """

    def __init__(self, robot: str = "panda", set: str = "bookshelf_small", scene: int = 0) -> None:
        if robot not in SETS:
            raise InputError(f"mbm: no robot is called {robot!r}; {suggestion(robot, SETS)}")
        if set not in SETS[robot]:
            raise InputError(f"mbm: {robot} has no set {set!r}; {suggestion(set, SETS[robot])}")
        self._files = _Files(robot, set)
        self.scenes_differ = scene == 0
        shown = self._files.scene(scene) if scene else None
        if shown is None:
            super().__init__(self._files.arm(self._files.first_scene), (), "mbm")
            self.min_clearance = _CLEARANCE
            self.problem_count = len(self._files.numbers)
        else:
            arm, allows = self._files.arm(shown), self._files.allows(shown)
            super().__init__(arm, shown.obstacles, "mbm", (scene,), shown.names, allows)
        self._last: tuple[int, Environment] | None = None

    def scene_of(self, problem: Problem) -> Environment:
        if not self.scenes_differ:
            return self
        if self._last is None or self._last[0] != problem.index:
            number = self._files.number(problem.index)
            self._last = problem.index, _Scene(self._files, number)
        return self._last[1]

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        if not self.scenes_differ:
            return super().sample_problems(n, seed)
        numbers = self._files.numbers
        if n > len(numbers):
            raise InputError(f"mbm: {self._files.name} has {len(numbers)} problems, not {n}")
        return self.problems_at([number - 1 for number in numbers[:n]], seed)

    def problems_at(self, indices: Sequence[int], seed: int) -> list[Problem]:
        if not self.scenes_differ:
            return super().problems_at(indices, seed)
        ends = ((index, self._files.ends(self._files.number(index))) for index in indices)
        return [
            Problem(start, goal, index, derived_seed("mbm planner", seed, index))
            for index, (start, goal) in ends
        ]

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        return {} if self.scenes_differ else super().problem_statistics(n, seed)

    def definition(self) -> dict[str, Any]:
        definition = {**super().definition(), "class": "MotionBenchMaker"}
        if self.scenes_differ:
            definition |= {"problems": self._files.digest, "obstacles": []}
        return definition


class _Scene(ArmWorld):
    """The scene of one problem."""

    min_clearance = _CLEARANCE

    def __init__(self, files: _Files, number: int) -> None:
        scene = files.scene(number)
        arm, allows = files.arm(scene), files.allows(scene)
        super().__init__(arm, scene.obstacles, "mbm", (number,), scene.names, allows)


@dataclass(frozen=True)
class _Files:
    """What the files of a robot and of a set say."""

    robot: str
    set: str

    @property
    def name(self) -> str:
        return f"{self.set}_{self.robot}"

    @cached_property
    def _folder(self) -> Path:
        return robot_folder(self.robot)

    @cached_property
    def _problems(self) -> ProblemFiles:
        return read_problem_files(self._folder / _ARCHIVE, self.name)

    @property
    def numbers(self) -> Sequence[int]:
        return self._problems.numbers

    @property
    def digest(self) -> str:
        return self._problems.digest

    def number(self, index: int) -> int:
        """Of the request of a problem."""
        if index + 1 not in self.numbers:
            raise InputError(f"mbm: {self.name} has no problem {index}")
        return index + 1

    def scene(self, number: int) -> PlanningScene:
        text = self._problems.text("scene", number)
        try:
            return read_planning_scene(text, _robot(self._folder).graph.base)
        except InputError as error:
            raise InputError(f"{self.name}: scene{number:04d}.yaml: {error}") from error

    def request(self, number: int) -> MotionRequest:
        text = self._problems.text("request", number)
        try:
            return read_motion_request(text)
        except InputError as error:
            raise InputError(f"{self.name}: request{number:04d}.yaml: {error}") from error

    @cached_property
    def _first(self) -> tuple[str, tuple[tuple[str, float], ...]]:
        """The group of the first request, and where its joints start."""
        first = self.request(self.numbers[0])
        return first.group, tuple(sorted(first.start.items()))

    @cached_property
    def first_scene(self) -> PlanningScene:
        return self.scene(self.numbers[0])

    @property
    def links(self) -> frozenset[str]:
        """The names of the robot's links."""
        graph = _robot(self._folder).graph
        return frozenset((graph.base, *graph.carriers))

    def arm(self, scene: PlanningScene) -> Arm:
        """The robot, whose links may touch as its own files and a scene allow."""
        return _arm(self._folder, *self._first, scene.allowed.pairs(self.links))

    def allows(self, scene: PlanningScene) -> Callable[[str, str], bool]:
        """Whether a link may touch an object of a scene, by their names. A name that is a link's
        stands for that alone."""
        objects = frozenset(scene.names) - self.links
        return lambda link, name: name in objects and scene.allowed.allows(link, name)

    def ends(self, number: int) -> tuple[Array, Array]:
        """Start and goal of a request, (d,) each, which may be beyond the joints' limits."""
        request, arm = self.request(number), self.arm(self.first_scene)
        names = [joint.name for joint in arm.tree.coordinates]
        self._check_still(request, number, names)
        for what, values in (("start", request.start), ("goal", request.goal)):
            missing = [name for name in names if name not in values]
            if missing:
                raise InputError(
                    f"{self.name}: request{number:04d}.yaml: its {what} does not say where joint "
                    f"{missing[0]!r} of {request.group!r} is"
                )
        start, goal = (
            np.array([values[name] for name in names]) for values in (request.start, request.goal)
        )
        return _rounded(arm, start), _rounded(arm, goal)

    def _check_still(self, request: MotionRequest, number: int, moving: Sequence[str]) -> None:
        """All problems of a set have the robot whose other joints stand as in the first."""
        for name, value in self._first[1]:
            if name not in moving and request.start.get(name) != value:
                raise InputError(
                    f"{self.name}: request{number:04d}.yaml: joint {name!r} stands elsewhere than "
                    f"in the first request, at {request.start.get(name)} and not at {value:g}"
                )


def _rounded(arm: Arm, q: Array) -> Array:
    """A configuration (d,) with its joints within limits that they are beyond by rounding, and
    those that wrap between -pi and pi."""
    q = arm.tree.space.wrapped(q)
    clipped = q.clip(arm.tree.lower, arm.tree.upper)
    return np.where(np.abs(clipped - q) <= _ROUNDING, clipped, q)


@dataclass(frozen=True)
class _RobotFiles:
    """What a robot's files say.

    Attributes:
        graph: its links and joints.
    """

    urdf: Path
    srdf: Srdf
    graph: JointGraph


@lru_cache(maxsize=4)
def _robot(folder: Path) -> _RobotFiles:
    urdf, srdf = folder / f"{folder.name}.urdf", folder / f"{folder.name}.srdf"
    return _RobotFiles(urdf, read_srdf(srdf), JointGraph(parsed(urdf)[0]))


@lru_cache(maxsize=4)
def _arm(
    folder: Path,
    group: str,
    values: tuple[tuple[str, float], ...],
    allowed: frozenset[frozenset[str]],
) -> Arm:
    """The robot, made once for all scenes in which the same links may touch."""
    robot = _robot(folder)
    others = set(robot.graph.movable) - robot.srdf.joints_of(group, robot.graph)
    still = {name: value for name, value in values if name in others}
    tree, parts = read_urdf(robot.urdf, PlanningGroup(robot.srdf, group, pose=still))
    own = robot.srdf.allowed([link.name for link in tree.links])
    return Arm(tree, parts, True, own | allowed)


def robot_folder(name: str) -> Path:
    """Where the files of a robot are: in the folder that `BENCH_DATA` names, where they are read as
    they are, or in the user's cache, for which what is missing is fetched.

    Raises:
        InputError: they are in neither and cannot be fetched.
    """
    data = os.environ.get("BENCH_DATA")
    if data and (Path(data) / "mbm" / name / _ARCHIVE).is_file():
        return Path(data) / "mbm" / name
    kept = cache_folder() / "mbm" / name
    instead = f", or the whole folder at mbm/{name} in one that BENCH_DATA names"
    fetch(kept, f"{URL}/{name}", _digests(name), instead)
    return kept


def _digests(robot: str) -> dict[str, str]:
    """SHA-256 of a robot's files by their names: what it collides with, groups, and problems."""
    listed = (Path(__file__).with_name("motion_bench_maker_files.txt")).read_text("utf-8")
    pairs = (line.split(" ") for line in listed.splitlines())
    return {
        name.removeprefix(f"{robot}/"): digest
        for name, digest in pairs
        if name.startswith(f"{robot}/")
    }
