"""Prints, for the manipulators of example-robot-data, what reading them, drawing them and making 20
problems takes, and how many of these `rrtconnect` solves within 5 s, by the judge:

    PYTHONPATH=. python tests/benchmarks/robots.py [SECONDS [NAME ...]]

Each with nothing about it, and at a table with boxes, in a process of its own, which is ended after
some SECONDS (600): its row then says how far it came. The processor's seconds, but for solutions.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter, process_time
from typing import IO

import numpy as np

import envs
import planners
from bench.cli import main as bench_command
from bench.judging.judge import Judge, Verdict
from envs import Environment, Problem
from envs.robots.named_robots import known_robots
from envs.scenes.arm_world import ArmWorld

PROBLEMS, TIME_LIMIT = 20, 5.0

SCENES = ("empty", "table")

COLUMNS = ("robot", "joints", "scene", "read s", "20 problems s", "solved", "median s", "drawn")


def main(most: float, names: Sequence[str]) -> None:
    print("|", " | ".join(COLUMNS), "|")
    print("|", " | ".join("-" * len(column) for column in COLUMNS), "|")
    for name in names or [robot.name for robot in known_robots()]:
        for scene in SCENES:
            print(f"| {name}", row(name, scene, most), flush=True)


def row(name: str, scene: str, most: float) -> str:
    command = [sys.executable, __file__, "--one", name, scene]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        try:
            code = subprocess.run(command, stdout=out, stderr=err, timeout=most, check=False)
            end = "" if code.returncode == 0 else last_line(err)
        except subprocess.TimeoutExpired:
            end = f"over {most:g} s |"
        out.seek(0)
        return out.read().replace("\n", " ") + end


def last_line(file: IO[str]) -> str:
    file.seek(0)
    return (file.read().strip().splitlines() or ["ended"])[-1] + " |"


def one(name: str, scene: str) -> None:
    """Prints the cells of a robot in a scene, each as soon as it is known."""
    with tempfile.TemporaryDirectory() as folder:
        text = f"arm:robot={name}"
        if scene == "table":
            file = Path(folder) / "scene.yaml"
            file.write_text(table(text))
            text += f",scene={file}"
        begin = process_time()
        env = envs.make(text)
        assert isinstance(env, ArmWorld)
        assert env.robot.pairs is not None  # which are found when they are asked for
        print("|", env.dimension, "|", f"{scene} |", f"{process_time() - begin:.1f} |", flush=True)
        begin = process_time()
        problems = env.sample_problems(PROBLEMS, 0)
        print(f"{process_time() - begin:.1f} |", flush=True)
        solved = sorted(solution_times(env, problems))
        median = f"{solved[len(solved) // 2]:.2f}" if solved else "-"
        print(f"{len(solved)} of {PROBLEMS} | {median} |", flush=True)
        picture = Path(folder) / "drawn.png"
        code = bench_command(["show", "--env", text, "--out", str(picture)])
        print("yes |" if code == 0 and picture.stat().st_size > 0 else "no |")


def table(text: str) -> str:
    """A scene for a robot: a table before its first joint, within reach, and boxes on it."""
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    reach, at = env.robot.extent, env.robot.tree.joints[0].origin[:3, 3]
    solids = [((0.9, 1.2, 0.05), (0.8, 0.0, -0.4))]
    solids += [((0.15, 0.15, 0.3), (0.6, side, -0.22)) for side in (-0.35, 0.0, 0.35)]
    obstacles = [
        {
            "box": [reach * side for side in sides],
            "position": (at + reach * np.array(place)).tolist(),
        }
        for sides, place in solids
    ]
    return json.dumps({"obstacles": obstacles})  # which is YAML


def solution_times(env: Environment, problems: Sequence[Problem]) -> list[float]:
    """Of the problems whose path the judge proves, in seconds."""
    planner, judge = planners.make("rrtconnect"), Judge(env)
    planner.setup(env, seed=0)
    times = []
    for problem in problems:
        begin = perf_counter()
        result = planner.solve(problem, planners.Budget(begin + TIME_LIMIT))
        took = perf_counter() - begin
        if judge(problem, result.path).verdict is Verdict.VALID:
            times.append(took)
    return times


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(*sys.argv[2:])
    else:
        main(float(sys.argv[1]) if sys.argv[1:] else 600.0, sys.argv[2:])
