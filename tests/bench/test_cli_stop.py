"""`bench run`: when planners that improve stop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, records_of

from bench.execution.config import make_run_config


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rule", "costs"),
    [("first", {np.inf}), ("limit", {0.0}), ("match:raises", {0.0})],
)
@pytest.mark.usefixtures("in_process_workers")
def test_stop_rules_reach_the_planner(
    rule: str,
    costs: set[float],
    bench: Cli,
    faulty: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counted = tmp_path / "count"
    monkeypatch.setenv("COUNT_FILE", str(counted))
    run = ("run", "--env", "c3d", "--planners", "counts", "--problems", 2, "--stop", rule)
    assert bench(*run, "--out", tmp_path / "out")[0] == 0
    warm_up, *asked = counted.read_text().split("\n")[:-1]
    assert float(warm_up.split()[1]) == np.inf
    assert {float(line.split()[1]) for line in asked} == costs


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_matching_uses_the_judged_length(
    bench: Cli, faulty: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = tmp_path / "count"
    monkeypatch.setenv("COUNT_FILE", str(counted))
    out = tmp_path / "out"
    run = ("run", "--env", "c3d", "--planners", "counts", "--problems", 6, "--out", out)
    assert bench(*run, "--stop", "match:straight:0.5")[0] == 0
    records = records_of(out)
    assert pd.read_csv(out / "summary.csv")["planner"].tolist() == ["straight", "counts"]
    reference = records[records["planner"] == "straight"].set_index("problem")
    assert {"VALID", "COLLISION"} == set(reference["outcome"])
    for line in counted.read_text().split("\n")[1:-1]:
        index, cost = line.split()
        row = reference.loc[int(index)]
        wanted = 1.5 * row["length"] if row["outcome"] == "VALID" else 0.0
        assert float(cost) == pytest.approx(wanted)


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_reference_that_fails_when_measured_anew_sets_no_length(
    bench: Cli, faulty: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = tmp_path / "count"
    monkeypatch.setenv("COUNT_FILE", str(counted))
    run = (
        "run",
        "--env",
        "c3d:boxes=1",
        "--planners",
        "counts",
        "--problems",
        3,
        "--out",
        tmp_path,
    )
    assert bench(*run, "--stop", "match:moody")[0] == 0
    costs = [float(line.split()[1]) for line in counted.read_text().split("\n")[1:-1]]
    assert any(cost > 0 for cost in costs)
    counted.write_text("")
    monkeypatch.setenv("MOODY_FAILS", "1")
    assert bench(*run, "--stop", "match:moody", "--force")[0] == 0
    costs = [float(line.split()[1]) for line in counted.read_text().split("\n")[1:-1]]
    assert costs == [0.0, 0.0, 0.0]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_reference_that_nobody_needs_is_not_run(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "c3d", "--problems", 1, "--out", tmp_path, "--planners")
    assert bench(*run, "ntfields")[0] == 0
    assert list(pd.read_csv(tmp_path / "summary.csv")["planner"]) == ["ntfields"]
    assert bench(*run, "ntfields,bitstar")[0] == 0
    wanted = ["mpnet", "ntfields", "bitstar"]
    assert list(pd.read_csv(tmp_path / "summary.csv")["planner"]) == wanted


def test_the_papers_rule_takes_mpnet_where_it_has_weights(tmp_path: Path) -> None:
    def rule(env: str) -> str:
        return make_run_config(
            env=env,
            planner="rrtstar",
            problems=1,
            seed=0,
            time_limit_s=1,
            stop="paper",
            jobs=1,
            memory_limit_mb=1000,
        ).stop.text

    assert rule("c3d") == rule("c3d:scene=1234") == "match:mpnet:0.05"
    assert rule("c3d:boxes=3") == rule("c3d,c3d:boxes=3") == "match:fmm:0.05"
