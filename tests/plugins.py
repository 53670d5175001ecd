"""Packages of strangers, as importlib.metadata finds them on sys.path."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

PLANNER = '''
from envs import Spec
from planners import Planner, PlannerResult, Status


class Straight(Planner):
    """Claims the straight line."""

    def __init__(self, bends: int = 0):
        self.bends = bends

    def solve(self, problem, budget):
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])
'''
"""A file with a planner in it."""


def install(folder: Path, name: str, text: str, points: Mapping[str, str]) -> None:
    """Puts a module `name` into a folder, and the metadata of a distribution of that name whose
    entry points, by "group name", are `points`."""
    (folder / f"{name}.py").write_text(text, encoding="utf-8")
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = []
    for key, value in points.items():
        group, _, point = key.partition(" ")
        lines += [f"[{group}]", f"{point} = {value}"]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
