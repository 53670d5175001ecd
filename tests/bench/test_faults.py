"""Every way of failing is one row in the table and costs the others nothing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import planners_that_fail
import psutil
import pytest
from conftest import Cli, records_of

import envs
from envs import Spec

PROBLEMS = 2


@pytest.mark.slow(minutes=1)
def test_every_fault_has_its_own_outcome(
    bench: Cli,
    faulty: list[str],
    tmp_path: Path,
    new_children: Callable[[], list[psutil.Process]],
) -> None:
    reference = "fmm:resolution=30"
    code, out, err = bench(
        *("run", "--env", "c3d", "--planners", ",".join([*planners_that_fail.EXPECTED, reference])),
        *("--problems", PROBLEMS, "--seed", 3, "--time-limit", 0.5, "--stop", f"match:{reference}"),
        *("--memory-limit", 1000, "--out", tmp_path),
    )
    assert code == 0, err
    summary = pd.read_csv(tmp_path / "summary.csv").set_index("planner")
    for id, (_, outcome) in planners_that_fail.EXPECTED.items():
        assert json.loads(summary.loc[id, "status_counts"]) == {outcome: PROBLEMS}, id
        assert summary.loc[id, "solved"] == 0
        assert np.isnan(summary.loc[id, "time_s_mean"]), "failures have no mean time"
        assert f"| {id} " in out
    assert summary.loc[reference, "problems"] == PROBLEMS
    assert summary.loc[reference, "solved"] == PROBLEMS
    assert not new_children(), "no process may be left behind"
    assert not planners_that_fail.children_left()


@pytest.mark.slow
def test_errors_tell_what_happened(bench: Cli, faulty: list[str], tmp_path: Path) -> None:
    names = "raises,segfault,hangs,raises-in-setup,unsupporting,out-of-bounds"
    bench(
        *("run", "--env", "c3d", "--planners", names, "--problems", 1, "--stop", "first"),
        *("--time-limit", 0.3, "--out", tmp_path),
    )
    errors = records_of(tmp_path).set_index("planner")["error"]
    assert "I do not feel like planning" in errors["raises"]
    assert "SIGSEGV" in errors["segfault"]
    assert "planners_that_fail.py" in errors["segfault"], "names the line that crashed"
    assert "ignored its deadline" in errors["hangs"]
    assert "in solve" in errors["hangs"], "names where it hung"
    assert "no weights here" in errors["raises-in-setup"]
    assert "Sundays" in errors["unsupporting"]
    assert "waypoint 1 of 3" in errors["out-of-bounds"]


@pytest.mark.slow
def test_what_a_planner_prints_stays_out_of_the_table(
    bench: Cli, faulty: list[str], tmp_path: Path
) -> None:
    code, out, err = bench(
        *("run", "--env", "c3d", "--planners", "prints", "--problems", 3, "--stop", "first"),
        *("--out", tmp_path),
    )
    assert code == 0
    assert "hello" not in out + err
    assert "library" not in out + err
    assert len(records_of(tmp_path)) == 3


@pytest.mark.slow
def test_a_valid_path_after_the_limit_is_late(
    bench: Cli, faulty: list[str], tmp_path: Path
) -> None:
    bench(
        *("run", "--env", "c3d:boxes=1", "--planners", "late", "--problems", 2),
        *("--stop", "first", "--time-limit", 0.2, "--out", tmp_path),
    )
    records = records_of(tmp_path)
    valid = records["verdict"] == "VALID"
    assert valid.any()
    assert set(records.loc[valid, "outcome"]) == {"LATE"}
    assert (records["solved"] == 0).all()


def test_an_environment_that_differs_from_process_to_process_is_an_error(
    bench: Cli, faulty: list[str], tmp_path: Path
) -> None:
    unsteady = Spec("unsteady", "planners_that_fail:UnsteadyWorld", "differs every time")
    envs.REGISTRY.register(unsteady)
    try:
        bench(
            *("run", "--env", "unsteady", "--planners", "straight", "--problems", 2),
            *("--stop", "first", "--out", tmp_path),
        )
    finally:
        envs.REGISTRY.unregister("unsteady")
    records = records_of(tmp_path)
    assert set(records["outcome"]) == {"ERROR"}
    assert "not the same in every process" in records["error"][0]


COMPILES = """
import time

from planners import Planner, PlannerResult, Status


class Compiles(Planner):
    \"\"\"As one that Numba compiles, piece by piece.\"\"\"

    left = 2

    def setup(self, env, *, seed):
        pass

    def solve(self, problem, budget):
        while self.left and budget.remaining() > 0:
            self.left -= 1
            time.sleep(1.8)
        if budget.remaining() <= 0:
            return PlannerResult(Status.TIMEOUT)
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])
"""


@pytest.mark.slow
def test_what_compiles_on_the_warm_up_problem_is_killed_neither_there_nor_later(
    bench: Cli, tmp_path: Path
) -> None:
    file = tmp_path / "compiles.py"
    file.write_text(COMPILES)
    code, _, err = bench(
        *("run", "--env", "c3d:boxes=1", "--planners", "compiles", "--planner-file", file),
        *("--problems", 3, "--time-limit", 0.3, "--stop", "first", "--out", tmp_path / "run"),
    )
    assert code == 0, err
    records = records_of(tmp_path / "run")
    assert set(records["status"]) == {"EXACT_SOLUTION"}
    assert set(records["warm"]) == {1}
    assert records["solve_s"].max() < 0.2
