"""MotionBenchMaker's problem sets: of four robots, each problem in a scene of its own."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from envs.errors import InputError, suggestion
from envs.files.fetched import fetch
from envs.files.moveit_request import MotionRequest, read_motion_request
from envs.files.moveit_yaml import read_planning_scene
from envs.files.paths import cache_folder
from envs.files.planning_scene import PlanningScene
from envs.files.problem_archive import ProblemFiles, read_problem_files
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.joint_graph import JointGraph
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import Srdf, read_srdf
from envs.robots.urdf import joint_graph_of, read_urdf
from envs.scenes.motion_bench_maker_sets import SETS
from envs.scenes.problem_set import PosedProblems, ProblemSet, SetScene

URL = (
    "https://raw.githubusercontent.com/KavrakiLab/vamp/"
    "f6de6a72e0725ba08e0829f0a34261a3f465aed7/resources"
)
"""Where the robots and problems are (Apache-2.0)."""

_ARCHIVE = "problems.tar.bz2"


class MotionBenchMaker(ProblemSet):
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
        super().__init__(_Files(robot, set), "mbm", scene - 1 if scene else None)


@dataclass(frozen=True)
class _Files(PosedProblems):
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
    def urdf(self) -> Path:
        return _robot(self._folder).urdf

    @property
    def digest(self) -> str:
        return self._problems.digest

    @property
    def indices(self) -> Sequence[int]:
        return [number - 1 for number in self._problems.numbers]

    def scene(self, index: int) -> SetScene:
        scene = self._planning_scene(index + 1)
        arm = _arm(self._folder, *self._first, scene.allowed.pairs(self._links))
        allows = scene.allowed.touching(self._links, scene.names)
        return SetScene(arm, scene.obstacles, scene.names, allows)

    def _planning_scene(self, number: int) -> PlanningScene:
        text, frames = self._problems.text("scene", number), {self._graph.base: np.eye(4)}
        try:
            return read_planning_scene(text, frames)
        except InputError as error:
            raise InputError(f"{self.name}: scene{number:04d}.yaml: {error}") from error

    def _request(self, number: int) -> MotionRequest:
        text = self._problems.text("request", number)
        try:
            return read_motion_request(text)
        except InputError as error:
            raise InputError(f"{self.name}: request{number:04d}.yaml: {error}") from error

    @cached_property
    def _first(self) -> tuple[str, tuple[tuple[str, float], ...]]:
        """The group of the first request, and where its joints start."""
        first = self._request(self._problems.numbers[0])
        return first.group, tuple(sorted(first.start.items()))

    @cached_property
    def _links(self) -> frozenset[str]:
        """The names of the robot's links."""
        return frozenset((self._graph.base, *self._graph.carriers))

    @property
    def _graph(self) -> JointGraph:
        return _robot(self._folder).graph

    @cached_property
    def _joints(self) -> list[str]:
        """The names of the joints that move, in the order of configurations."""
        arm = self.scene(self.indices[0]).arm
        return [joint.name for joint in arm.tree.coordinates]

    def ends(self, index: int) -> tuple[Array, Array]:
        number = index + 1
        if number not in self._problems.numbers:
            raise InputError(f"mbm: {self.name} has no problem {index}")
        request, names = self._request(number), self._joints
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
        return start, goal[None]

    def _check_still(self, request: MotionRequest, number: int, moving: Sequence[str]) -> None:
        """All problems of a set have the robot whose other joints stand as in the first."""
        for name, value in self._first[1]:
            if name not in moving and request.start.get(name) != value:
                raise InputError(
                    f"{self.name}: request{number:04d}.yaml: joint {name!r} stands elsewhere than "
                    f"in the first request, at {request.start.get(name)} and not at {value:g}"
                )


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
    return _RobotFiles(urdf, read_srdf(srdf), joint_graph_of(urdf))


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
