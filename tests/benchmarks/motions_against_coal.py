"""Compares our checks of motions with Pinocchio and coal, and prints a table:

    python tests/benchmarks/motions_against_coal.py --motions 1000 --seed 0 --out FILE [NAME ...]

Over 50 kinematic trees, 20 more whose links may touch some obstacles, and 12 rigid bodies made at
random, and all real robots that have a name or are in BENCH_DATA; or those that are named, as
"tree 3". Each motion that is accepted is looked at
all along: in steps that coal's distances prove, and where these are hardly more than they must be,
in steps of a thousandth of the tolerance.

What is found is added to FILE, a line for 100 random motions of a robot; what FILE has already of
the same seed is not done again, so that a long run goes in pieces. Several processes may share
FILE, each with a part of the robots: `--part 1/2` and `--part 2/2`. Once all is done, the same
command prints the table of the whole file at once.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

from compared_robots import compared_robots, comparison  # noqa: E402
from motion_agreement import Agreement  # noqa: E402

BLOCK = 100

_COLUMNS = [f.name for f in fields(Agreement) if f.name != "cases"]


def main(names: Sequence[str], motions: int, seed: int, file: Path) -> None:
    done = {(row["robot"], row["block"]) for row in _rows(file, seed)}
    for number, name in enumerate(names, start=1):
        blocks = [n for n in range(-(-motions // BLOCK)) if (name, n) not in done]
        print(f"{number} of {len(names)}: {name}, {len(blocks)} blocks", flush=True)
        for block, found in _compare(name, blocks, seed):
            with file.open("a") as out:
                row = {"robot": name, "seed": seed, "block": block, **asdict(found)}
                out.write(json.dumps(row) + "\n")
            for case in found.cases:
                print(f"{name}: {case}", flush=True)
    print(table(_rows(file, seed)))


def _part(text: str) -> slice:
    """Of "1/2": each second of a sequence, from the first on."""
    number, _, count = text.partition("/")
    if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
        raise argparse.ArgumentTypeError(f"{text!r} is no part such as 1/2, the first of two")
    return slice(int(number) - 1, None, int(count))


def _compare(name: str, blocks: Iterable[int], seed: int) -> Iterator[tuple[int, Agreement]]:
    with tempfile.TemporaryDirectory() as folder:
        compare = comparison(name, Path(folder)) if blocks else None
        for block in blocks:
            assert compare is not None
            numbers = [seed, block, *name.encode()]
            yield block, compare(BLOCK, np.random.default_rng(numbers))


def _rows(file: Path, seed: int) -> list[dict[str, Any]]:
    """Of a seed, what a file has."""
    lines = file.read_text().splitlines() if file.exists() else []
    return [row for row in map(json.loads, lines) if row["seed"] == seed]


def table(rows: Sequence[dict[str, Any]]) -> str:
    """In Markdown, a row a robot and one for all."""
    robots = {row["robot"]: Agreement() for row in rows}
    for row in rows:
        robots[row["robot"]] += Agreement(**{f.name: row[f.name] for f in fields(Agreement)})
    robots["all"] = sum(robots.values(), Agreement())
    lines = ["| robot | " + " | ".join(_COLUMNS) + " |", "|---" * (1 + len(_COLUMNS)) + "|"]
    for name, found in robots.items():
        counts = (f"{getattr(found, column):.0f}" for column in _COLUMNS)
        lines.append(f"| {name} | " + " | ".join(counts) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="of robots; all by default")
    parser.add_argument("--motions", type=int, default=1000, help="of each robot")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--part", type=_part, default="1/1", help="of the robots, as 1/2; all by default"
    )
    parser.add_argument("--out", type=Path, required=True, help="where what is found is added")
    given = parser.parse_args()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    robots = (given.names or compared_robots())[given.part]
    main(robots, given.motions, given.seed, given.out)
