"""One fingerprint is one environment, whatever names it was given."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pandas as pd
import pytest
import trimesh
from conftest import Cli
from records import recorded, row

from bench.analysis.regression import Baseline, CheckOptions, check
from bench.analysis.run_results import RunResults
from bench.analysis.summary import common_problems
from bench.judging.metrics import METRICS
from bench.report import planner_arena
from bench.report.html import problems
from envs import InputError


@pytest.fixture
def balls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with one mesh in two more."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        trimesh.creation.icosphere(subdivisions=1).export(tmp_path / name / "b.ply")
    monkeypatch.chdir(tmp_path)
    return tmp_path


RUN = ("--planners", "rrtconnect", "--problems", 2, "--stop", "first")


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_names_of_one_environment_in_a_run_and_after_it(bench: Cli, balls: Path) -> None:
    """Twice in one run, then under another name into the same folder, then joined, and checked."""
    first, dotted, copy = (f"mesh:file={name}/b.ply" for name in ("one", "./one", "two"))
    code, out, err = bench("run", "--env", f"{first},{dotted},{copy}", *RUN, "--out", "a")
    assert code == 0
    assert f"{dotted} is the same environment as {first}" in err
    assert f"{copy} is the same environment as {first}" in err
    assert out.count("| rrtconnect |") == 3, "a row in each of the tables"
    assert pd.read_csv("a/summary.csv")["env"].tolist() == [first]

    again = ("run", "--env", copy, "--planners", "rrtconnect,rrtstar", *RUN[2:], "--out", "a")
    assert bench(*again)[0] == 0
    table = pd.read_csv("a/summary.csv")
    assert table["env"].tolist() == [copy] * 2
    assert table["problems"].tolist() == [2, 2], "what was measured by another name counts"
    with closing(sqlite3.connect("a/run.sqlite")) as store:
        assert store.execute("SELECT count(*) FROM records").fetchone() == (4,), "and only once"

    assert bench("run", "--env", first, "--planners", "bitstar", *RUN[2:], "--out", "b")[0] == 0
    assert bench("report", "a", "b", "--out", "both", "--format", "md,csv,planner-arena")[0] == 0
    joined = pd.read_csv("both/summary.csv")
    assert joined["env"].tolist() == [copy] * 3
    assert "Left out" not in (balls / "both" / "summary.md").read_text()
    (balls / "one" / "b.ply").rename(balls / "moved.ply")
    code, out, _ = bench(
        *("replay", "a", "--planner", "rrtconnect", "--problem", 1),
        *("--env", "mesh:file=moved.ply"),
    )
    assert code == 0
    assert "same path" in out
    code, _, err = bench("replay", "a", "--planner", "rrtconnect", "--problem", 1, "--env", "c3d")
    assert code == 2
    assert "environment of a" in err
    (balls / "moved.ply").rename(balls / "one" / "b.ply")
    code, out, _ = bench("compare", "a", "b", "--planners", "rrtconnect,bitstar")
    assert code == 0

    file = balls / "baseline.csv"
    assert bench("check", "b", "--baseline", file, "--update")[0] == 0
    assert bench("run", "--env", copy, "--planners", "bitstar", *RUN[2:], "--out", "c")[0] == 0
    code, out, _ = bench("check", "c", "--baseline", file, "--alpha", 0.5)
    assert code == 0
    assert f"| `{first}` | `bitstar`" in out
    assert "not in the baseline yet" not in out


def joined() -> RunResults:
    a = recorded([row("p", i, "VALID", solve_s=1.0, length=1.0, env="b.ply") for i in range(3)])
    b = recorded([row("q", i, "VALID", solve_s=1.0, length=2.0, env="./b.ply") for i in range(3)])
    return RunResults.joined([a, b])


def test_runs_of_one_environment_by_two_names_are_of_one(tmp_path: Path) -> None:
    run = joined()
    assert run.order == [("b.ply", "p"), ("b.ply", "q")]
    assert common_problems(run.records, METRICS)["problems"].tolist() == [3, 3]
    assert [s["envs"][0]["id"] for s in run.selections] == ["b.ply"] * 2
    assert len(problems.problem_sets_of(run)) == 1
    planner_arena.write(run, tmp_path / "a.db")
    with closing(sqlite3.connect(tmp_path / "a.db")) as made:
        assert set(made.execute("SELECT name FROM experiments")) == {("b.ply",)}


def test_one_planner_in_one_environment_by_two_names_is_refused() -> None:
    a = recorded([row("p", 0, "VALID", env="b.ply")])
    b = recorded([row("p", 0, "VALID", env="./b.ply")])
    with pytest.raises(InputError, match=r"both have p in b\.ply"):
        RunResults.joined([a, b])


def test_other_problems_of_one_environment_by_two_names_are_refused() -> None:
    a = recorded([row("p", 0, "VALID", env="b.ply")])
    b = recorded([row("q", 0, "VALID", env="./b.ply", problems_seed=3)], seed=3)
    with pytest.raises(InputError, match=r"seed 0.*seed 3|seed 3.*seed 0"):
        RunResults.joined([a, b])


def test_a_baseline_knows_an_environment_by_its_fingerprint() -> None:
    def run(env: str, fingerprint: str = "f") -> Baseline:
        rows = [
            row("p", i, "VALID", length=1.0 + i, env=env, env_fingerprint=fingerprint)
            for i in range(20)
        ]
        return Baseline.of(recorded(rows))

    found = check(run("b.ply"), run("./b.ply"), CheckOptions(0.01))
    assert [f.env for f in found.findings] == ["b.ply"]
    assert found.notes == ()
    other = check(run("b.ply"), run("b.ply", "g"), CheckOptions(0.01))
    assert "the environment is another one" in other.notes[0]
