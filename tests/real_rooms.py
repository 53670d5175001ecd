"""The real rooms of the folder of meshes, through the command line, at what is asked of them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import has_data, records_of

from bench.execution.worker_process import ONE_THREAD

ROOMS = ("office_small", "office_large", "meeting_room")


def solved(
    command: list[str], room: str, planners: str, problems: int, out: Path
) -> dict[str, int]:
    """How many of the problems in a room each planner solves, by a command line that runs them."""
    if not has_data(f"rooms/{room}_zup.ply"):
        pytest.skip("BENCH_DATA has no rooms")
    path = Path(os.environ["BENCH_DATA"]) / f"rooms/{room}_zup.ply"
    env = f"mesh:file={path},kind=interior,robot_radius=0.15"
    chosen = ("--env", env, "--planners", planners, "--problems", f"{problems}", "--seed", "2026")
    done = subprocess.run(
        [sys.executable, *command, "run", *chosen, "--stop", "first", "--out", str(out / "run")],
        env={**os.environ, **ONE_THREAD, "XDG_CACHE_HOME": str(out / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    records = records_of(out / "run")
    assert len(records) == problems * records["planner"].nunique()
    counts = (records["outcome"] == "VALID").groupby(records["planner"]).sum()
    return {str(planner): int(count) for planner, count in counts.items()}
