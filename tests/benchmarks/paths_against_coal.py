"""Looks with Pinocchio and coal at paths of a run that the judge accepted, all along, and prints a
table, and each place where something touches:

    python tests/benchmarks/paths_against_coal.py RUN [RUN ...] --paths 200

Of each robot of MotionBenchMaker that a run has, so many paths are taken, evenly from all sets,
planners and problems. Which links may touch obstacles, and which each other besides what the SRDF
has, is read from the scenes by our code, all else by Pinocchio and from the URDF. Needs the sets in
BENCH_DATA.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

from exact_robots import ExactArm, RobotFiles, numbered  # noqa: E402
from motion_agreement import ROUNDING  # noqa: E402

import bench  # noqa: E402
import envs  # noqa: E402
from envs.files.moveit_request import read_motion_request  # noqa: E402
from envs.files.moveit_yaml import read_planning_scene  # noqa: E402
from envs.files.problem_archive import ProblemFiles, read_problem_files  # noqa: E402
from envs.scenes.arm_world import ArmWorld  # noqa: E402
from envs.scenes.motion_bench_maker import robot_folder  # noqa: E402

_FINER = 1000
"""What coal's distances do not prove is sampled in steps of the tolerance over this."""

_STATE = "as posed"


@dataclass
class Looked:
    """Counts of a robot's paths."""

    paths: int = 0
    motions: int = 0
    touching: int = 0
    too_near: int = 0


def main(runs: Sequence[Path], most: int) -> None:
    accepted = pd.concat([bench.load(run).paths for run in runs])
    accepted = accepted[accepted["outcome"] == "VALID"]
    robots = [_arguments_of(env)["robot"] for env in accepted["env"]]
    found: dict[str, Looked] = {}
    for robot, paths in accepted.groupby(robots, sort=False):
        found[str(robot)] = _look_at(str(robot), _some(paths, most))
    print("| robot | paths | motions | touching | nearer than half the tolerance |")
    print("|---|---|---|---|---|")
    for robot, looked in found.items():
        counts = looked.paths, looked.motions, looked.touching, looked.too_near
        print(f"| {robot} | {' | '.join(map(str, counts))} |")


def _some(paths: pd.DataFrame, most: int) -> pd.DataFrame:
    """Those that are looked at, in the order of their scenes."""
    ordered = paths.sort_values(["env", "problem", "planner"], kind="stable")
    chosen = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round())
    return ordered.iloc[chosen.astype(int)]


def _look_at(robot: str, paths: pd.DataFrame) -> Looked:
    looked = Looked()
    with tempfile.TemporaryDirectory() as folder:
        for (env, index), some in paths.groupby(["env", "problem"], sort=False):
            scene, exact = _scene(env, int(index), Path(folder))
            for planner, path in zip(some["planner"], some["path"], strict=True):
                _count(looked, f"{env}, problem {index}, {planner}", scene, exact, path)
            print(f"{robot}: {looked.paths} of {len(paths)}", file=sys.stderr, flush=True)
    return looked


def _count(
    looked: Looked, name: str, scene: ArmWorld, exact: ExactArm, path: Sequence[Sequence[float]]
) -> None:
    looked.paths += 1
    for a, b in pairwise(np.asarray(path)):
        looked.motions += 1
        motion, step = exact.motion(a, b), scene.tolerance / _FINER
        near = exact.first_below(motion, scene.tolerance / 2 - ROUNDING, step)
        touches = exact.touches(exact.frames(a))
        if near or touches:
            touches = touches or exact.first_below(motion, ROUNDING, step) is not None
            looked.touching += touches
            looked.too_near += not touches
            print(f"{name}: {a.tolist()} to {b.tolist()}, {near}", flush=True)


def _scene(env: str, index: int, folder: Path) -> tuple[ArmWorld, ExactArm]:
    """The scene of a problem, by our code and by Pinocchio."""
    problem_set = envs.make(env)
    [problem] = problem_set.problems_at([index], 0)
    scene = problem_set.scene_of(problem)
    assert isinstance(scene, ArmWorld)
    links, allowed = scene.robot.links, scene.may_touch
    pairs = np.argwhere(allowed) if allowed is not None else ()
    coordinates = [joint.name for joint in scene.robot.tree.coordinates]
    contacts = {(links[part], int(n)) for part, n in pairs}
    exact = ExactArm(_files(env, folder), coordinates, scene.obstacles, contacts)
    named = numbered(links)
    ours = {frozenset((named[i], named[j])) for i, j in scene.robot.pairs}
    told = _allowed_by_scene(env, index, scene)
    differ = [pair for pair in exact.leave_out_all_but(ours) if _links_of(pair) not in told]
    assert not differ, f"{env}: of these pairs only one check asks: {differ}"
    return scene, exact


def _links_of(pair: frozenset[str]) -> frozenset[str]:
    """Of two links' solids, by the names that `numbered` gives these."""
    return frozenset(name.rsplit(" ", 1)[0] for name in pair)


def _allowed_by_scene(env: str, index: int, scene: ArmWorld) -> frozenset[frozenset[str]]:
    """The pairs of links that a problem's scene allows to touch besides the SRDF."""
    base = scene.robot.tree.links[0].name
    text = _problems_of(env).text("scene", index + 1)
    return read_planning_scene(text, {base: np.eye(4)}).allowed.pairs(set(scene.robot.links))


def _problems_of(env: str) -> ProblemFiles:
    arguments = _arguments_of(env)
    archive = robot_folder(arguments["robot"]) / "problems.tar.bz2"
    return read_problem_files(archive, f"{arguments['set']}_{arguments['robot']}")


def _files(env: str, folder: Path) -> RobotFiles:
    """A robot's files, with a state in which all joints are where the first request has them."""
    robot = _arguments_of(env)["robot"]
    of_robot, problems = robot_folder(robot), _problems_of(env)
    request = read_motion_request(problems.text("request", problems.numbers[0]))
    tree = ElementTree.parse(of_robot / f"{robot}.srdf")
    state = ElementTree.SubElement(tree.getroot(), "group_state", name=_STATE, group=request.group)
    for name, value in request.start.items():
        ElementTree.SubElement(state, "joint", name=name, value=repr(value))
    srdf = folder / f"{robot}.srdf"
    tree.write(srdf)
    return RobotFiles(of_robot / f"{robot}.urdf", srdf, _STATE)


def _arguments_of(env: str) -> dict[str, str]:
    """Those of an environment of MotionBenchMaker's, by name: `robot`, `set`."""
    entry = envs.REGISTRY.entry(env)
    return {**entry.spec.arguments, **entry.arguments}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--paths", type=int, default=200)
    return parser.parse_args()


if __name__ == "__main__":
    told = _arguments()
    main(told.runs, told.paths)
