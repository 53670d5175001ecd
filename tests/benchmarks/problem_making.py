"""Prints what making 50 problems takes, the processor's seconds: of the manipulators of
example-robot-data with nothing about them and at a table, and, given their folder, of
MotionBenchMaker's robots in a scene of each set. With a digest of the problems, which tells whether
they are the same as before:

    PYTHONPATH=. python tests/benchmarks/problem_making.py [--data FOLDER] [ENVIRONMENT ...]

Each in a process of its own, which is ended after ten minutes. Environments that are named are all
that is measured; one of a robot may end in " at a table", as in "arm:robot=so101 at a table".
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time

import envs
from envs.robots.named_robots import known_robots
from envs.scenes.motion_bench_maker_sets import SETS
from tests.benchmarks.robots import table

PROBLEMS, MOST = 50, 600.0

COLUMNS = ("environment", "read s", f"{PROBLEMS} problems s", "digest")


def main(names: Sequence[str], data: str | None) -> None:
    if data:
        os.environ["BENCH_DATA"] = data
    print("|", " | ".join(COLUMNS), "|")
    print("|", " | ".join("-" * len(column) for column in COLUMNS), "|")
    for name in names or [*robots(), *(sets() if data else ())]:
        print(f"| {name} |", row(name), flush=True)


def robots() -> Iterator[str]:
    for robot in known_robots():
        yield f"arm:robot={robot.name}"
        yield f"arm:robot={robot.name} at a table"


def sets() -> Iterator[str]:
    for robot, names in SETS.items():
        yield from (f"mbm:robot={robot},set={name},scene=1" for name in names)


def row(name: str) -> str:
    try:
        ended = subprocess.run(
            [sys.executable, __file__, "--one", name],
            capture_output=True,
            text=True,
            timeout=MOST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"over {MOST:g} s |"
    if ended.returncode:
        return (ended.stderr.strip().splitlines() or ["ended"])[-1] + " |"
    return ended.stdout.strip()


def one(name: str) -> None:
    """Prints the cells of an environment."""
    with tempfile.TemporaryDirectory() as folder:
        text, _, at_table = name.partition(" at a ")
        if at_table:
            file = Path(folder) / "scene.yaml"
            file.write_text(table(text))
            text += f",scene={file}"
        begin = process_time()
        env = envs.make(text)
        read = process_time()
        problems = env.sample_problems(PROBLEMS, 0)
        made = process_time()
    ends = b"".join(end.tobytes() for problem in problems for end in (problem.start, problem.goal))
    digest = hashlib.sha256(ends).hexdigest()[:12]
    print(f"{read - begin:.1f} | {made - read:.1f} | {digest} |")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2])
    else:
        parser = argparse.ArgumentParser()
        parser.add_argument("names", nargs="*", metavar="ENVIRONMENT")
        parser.add_argument("--data")
        args = parser.parse_args()
        main(args.names, args.data)
