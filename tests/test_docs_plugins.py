"""The planner and the environment that docs/ shows work as written."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import plugins
import pytest
from conftest import Cli
from documents import ROOT, block_after

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@pytest.mark.slow
def test_the_planner_is_short_passes_its_checks_and_solves_problems(
    bench: Cli, tmp_path: Path
) -> None:
    text = block_after("planner")
    assert text.count("\n") < 25
    file = tmp_path / "detours.py"
    file.write_text(text, encoding="utf-8")
    code, out, err = bench("test-planner", f"{file}:Detours", "--time-limit", 1)
    assert code == 0, out + err
    code, out, err = bench(
        *("run", "--env", "c3d", "--planners", "detours", "--planner-file", file),
        *("--problems", 3, "--stop", "first", "--out", tmp_path / "run"),
    )
    assert code == 0, err
    assert pd.read_csv(tmp_path / "run" / "summary.csv")["solved"].tolist() == [3]
    code, out, err = bench(
        *("replay", tmp_path / "run", "--planner", "detours", "--problem", 2),
        *("--planner-file", file),
    )
    assert code == 0, out + err


@pytest.mark.slow
def test_the_environment_is_found_and_planned_in_once_it_is_installed(tmp_path: Path) -> None:
    announced = tomllib.loads(block_after("entry points"))["project"]["entry-points"]
    points = {
        f"{group} {name}": value for group, of in announced.items() for name, value in of.items()
    }
    site = tmp_path / "site"
    site.mkdir()
    plugins.install(site, "slalom", block_after("environment"), points)
    for line in block_after("environment commands").splitlines():
        name, *command = shlex.split(line)
        assert name == "bench"
        done = subprocess.run(
            [sys.executable, "-m", "bench", *command],
            env={**os.environ, "PYTHONPATH": f"{site}{os.pathsep}{ROOT}"},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "slalom.png").stat().st_size > 0
    summary = pd.read_csv(tmp_path / "results" / "runs" / "slalom" / "summary.csv")
    assert summary["env"].tolist() == ["slalom:walls=5"]
    assert summary["solved"].tolist() == [3]
