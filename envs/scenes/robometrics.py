"""Problem sets of robometrics: Franka's Panda among boxes and cylinders, each problem in a scene of
its own and with a list of goals."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from envs.collision.shapes import PlacedShape
from envs.errors import InputError, suggestion, tell_once
from envs.files.robometrics_file import RobometricsFile, RobometricsProblem, read_robometrics
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.named_robots import robot_named
from envs.robots.planning_group import PlanningGroup
from envs.robots.robot_description import RobotDescription
from envs.robots.srdf import Srdf, read_srdf
from envs.robots.urdf import joint_graph_of, read_urdf
from envs.scenes.motion_bench_maker import robot_folder
from envs.scenes.problem_set import PosedProblems, ProblemSet, SetScene
from envs.scenes.robometrics_scenes import SCENES

_JOINTS = tuple(f"panda_joint{n}" for n in range(1, 8))
"""In the order of configurations."""

_FINGERS = ("panda_finger_joint1", "panda_finger_joint2")

_OPENINGS = {"mb": 0.04, "mpinets": 0.025}
"""Where the fingers stand, in metres, by set: as cuRobo, whose inverse kinematics found the goals,
has them."""

_NAMED = 5
"""Problems that a line names."""


class Robometrics(ProblemSet):
    """A set of robometrics (fishbotics/robometrics, MIT), or the problems of one scene's name, or
    the scene of one problem.

    The sets are `mb`, made from MotionBenchMaker's by inverse kinematics, and `mpinets`, that of
    "Motion Policy Networks" (Fishman et al., CoRL 2022). A problem's index is its place in the
    file, or with a scene its place among those of that name. A path to any of its goals will do.
    Problems without goals are left out, which a line says.

    Args:
        set: "mb" or "mpinets", which says where the fingers stand.
        file: a copy of mb_set.yaml or mpinets_set.yaml, or a file of that form; without one it is
            sought in the folder robometrics of that which `BENCH_DATA` names.
        scene: the name of a scene; all by default.
        problem: the index of a problem, whose scene is then the only one and has problems that are
            drawn at random (see `ArmWorld.sample_problems`); -1 for the file's own.
        urdf: the robot, whose joints are called `panda_joint1` and so on; by default
            MotionBenchMaker's Panda, whose fingers are fixed (wider open than those of the sets).
        srdf: the file that says which of its links may touch.
        robot: the name of a robot instead, as for `arm`.

    Raises:
        InputError: a file cannot be used, or does not have what is named.
    """

    def __init__(
        self,
        set: str = "mb",
        file: str = "",
        scene: str = "",
        problem: int = -1,
        urdf: str = "",
        srdf: str = "",
        robot: str = "",
    ) -> None:
        if set not in SCENES:
            raise InputError(f"robometrics: no set is called {set!r}; {suggestion(set, SCENES)}")
        panda = _Panda.of(urdf, srdf, robot, _OPENINGS[set])
        posed = _Posed(read_robometrics(_file(set, file)), set, scene, panda)
        if problem != -1 and problem not in posed.indices:
            raise InputError(f"robometrics: {posed.name} has no problem {problem} with goals")
        super().__init__(posed, "robometrics", None if problem == -1 else problem)


def _file(set: str, file: str) -> Path:
    if file:
        return Path(file)
    data = os.environ.get("BENCH_DATA")
    wanted = Path(data or "", "robometrics", f"{set}_set.yaml")
    if not data or not wanted.is_file():
        raise InputError(
            f"robometrics: file={set}_set.yaml is needed, a copy of that in robometrics/content/"
            "dataset of github.com/fishbotics/robometrics, which is in Git LFS; or put it into the "
            "folder robometrics of one that BENCH_DATA names"
        )
    return wanted


@dataclass(frozen=True)
class _Panda:
    """A robot and where its fingers stand, in metres."""

    description: RobotDescription
    opening: float

    @staticmethod
    def of(urdf: str, srdf: str, robot: str, opening: float) -> _Panda:
        if urdf and robot:
            raise InputError("robometrics: urdf and robot both say which robot; give one of them")
        semantics = Path(srdf) if srdf else None
        if urdf:
            return _Panda(RobotDescription(urdf, Path(urdf), semantics), opening)
        if robot:
            named = robot_named(robot)
            described = RobotDescription(robot, named.urdf, semantics or named.srdf)
            return _Panda(described, opening)
        folder = robot_folder("panda")
        own = RobotDescription("panda", folder / "panda.urdf", semantics or folder / "panda.srdf")
        return _Panda(own, opening)

    @property
    def arm(self) -> Arm:
        return _arm(self.description.urdf, self.description.srdf, self.opening)


@lru_cache(maxsize=4)
def _arm(urdf: Path, srdf: Path | None, opening: float) -> Arm:
    """The robot, made once for all scenes."""
    semantics = read_srdf(srdf) if srdf else Srdf()
    movable = joint_graph_of(urdf).movable
    fingers = {name: opening for name in _FINGERS if name in movable}
    group = PlanningGroup(semantics, joints=_JOINTS, pose=fingers)
    tree, parts = read_urdf(urdf, group)
    return Arm(tree, parts, True, semantics.allowed([link.name for link in tree.links]))


@dataclass(frozen=True)
class _Posed(PosedProblems):
    """The problems of a file, or those of a scene's name.

    Attributes:
        set: whose they are.
        only: the name; "" for all.
    """

    content: RobometricsFile
    set: str
    only: str
    panda: _Panda

    @property
    def name(self) -> str:
        return self.only or self.content.file.name

    @property
    def urdf(self) -> Path:
        return self.panda.description.urdf

    @property
    def digest(self) -> str:
        return f"{self.content.digest}{f' {self.only}' if self.only else ''}"

    @cached_property
    def _problems(self) -> Sequence[RobometricsProblem]:
        self._check_set()
        chosen = [self.only] if self.only else list(self.content.scenes)
        of_scenes = (self.content.problems(name, len(_JOINTS)) for name in chosen)
        found = [problem for problems in of_scenes for problem in problems]
        without = [index for index, problem in enumerate(found) if len(problem.goals) == 0]
        if len(without) == len(found):
            raise InputError(f"{self.content.file}: no problem of {self.name} has a goal_ik")
        if without:
            self._tell_of_those_without_goals(without)
        return found

    def _check_set(self) -> None:
        """That the file is not of another set, whose fingers stand elsewhere."""
        for other, names in SCENES.items():
            if other != self.set and self.content.scenes.keys() & set(names):
                raise InputError(
                    f"{self.content.file} has scenes of the set {other!r}; say set={other}"
                )

    def _tell_of_those_without_goals(self, without: Sequence[int]) -> None:
        named = ", ".join(map(str, without[:_NAMED]))
        more = f" and {len(without) - _NAMED} more" if len(without) > _NAMED else ""
        tell_once(
            f"{self.content.file}: problems of {self.name} without goals (goal_ik) are left out: "
            f"{named}{more}"
        )

    @cached_property
    def indices(self) -> Sequence[int]:
        return [n for n, problem in enumerate(self._problems) if len(problem.goals) > 0]

    def scene(self, index: int) -> SetScene:
        problem = self._problem(index)
        arm, base = self.panda.arm, self._frame(problem.frame)
        placed = [PlacedShape(one.solid, base @ one.pose) for one in problem.obstacles]
        return SetScene(arm, placed, problem.names)

    def _problem(self, index: int) -> RobometricsProblem:
        if index not in self.indices:
            raise InputError(f"robometrics: {self.name} has no problem {index}")
        return self._problems[index]

    def _frame(self, name: str) -> Array:
        """The pose (4, 4) of a link's frame, in the robot's."""
        still = {link.name: link.offset for link in self.panda.arm.tree.links if link.body == 0}
        if name and name not in still:
            raise InputError(
                f"{self.content.file}: its world_frame {name!r} is no link that stands still; "
                f"{suggestion(name, still)}"
            )
        return still[name] if name else np.eye(4)

    def ends(self, index: int) -> tuple[Array, Array]:
        problem = self._problem(index)
        order = [_JOINTS.index(joint.name) for joint in self.panda.arm.tree.coordinates]
        return problem.start[order], problem.goals[:, order]

    def statistics(self) -> Mapping[str, float]:
        without = len(self._problems) - len(self.indices)
        negative = sum(problem.buffer < 0 for problem in self._problems)
        counted = {"problems_without_goals": without, "negative_collision_buffers": negative}
        return {name: count for name, count in counted.items() if count}
