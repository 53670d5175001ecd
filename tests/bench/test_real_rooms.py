"""The real rooms of the folder of meshes, through the command line, at what is asked of them; time
fields are briefly trained."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import briefly_trained
import pandas as pd
import pytest
from conftest import has_data, records_of

from bench.execution.worker_process import ONE_THREAD

pytestmark = pytest.mark.training(minutes=5)

LEAST = {"fmm": 99, "ntfields": 95, "rrtconnect": 99}
"""Of 100 problems, how many each planner solves: time fields after a 32nd of their training."""


@pytest.mark.parametrize("room", ["office_small", "office_large", "meeting_room"])
def test_of_100_problems_planners_solve_95_or_99(room: str, tmp_path: Path) -> None:
    # In one run: making the problems takes longer than solving them does, but for fmm.
    records = measured(room, tmp_path)
    assert records["planner"].value_counts().to_dict() == dict.fromkeys(LEAST, 100)
    solved = (records["outcome"] == "VALID").groupby(records["planner"]).sum()
    for planner, least in LEAST.items():
        assert solved[planner] >= least, planner


def measured(room: str, out: Path) -> pd.DataFrame:
    """What a command line that runs the planners on 100 problems in a room records."""
    if not has_data(f"rooms/{room}_zup.ply"):
        pytest.skip("BENCH_DATA has no rooms")
    path = Path(os.environ["BENCH_DATA"]) / f"rooms/{room}_zup.ply"
    env = f"mesh:file={path},kind=interior,robot_radius=0.15"
    chosen = ("--env", env, "--planners", ",".join(LEAST), "--problems", "100", "--seed", "2026")
    command = (briefly_trained.__file__, "run", *chosen, "--stop", "first")
    done = subprocess.run(
        [sys.executable, *command, "--out", str(out / "run")],
        env={**os.environ, **ONE_THREAD, "XDG_CACHE_HOME": str(out / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return records_of(out / "run")
