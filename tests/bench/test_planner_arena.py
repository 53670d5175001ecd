"""The database for Planner Arena, by hand and as Planner Arena's own package reads it."""

from __future__ import annotations

import base64
import json
import math
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest
from plannerarena.database import load_database
from records import recorded, row

from bench.analysis.run_results import RunResults
from bench.report import planner_arena
from bench.storage.record import LATE, Fault, Verdict
from planners import Status

FOUND = (
    "solution_time",
    "solution_length",
    "solution_smoothness",
    "solution_segments",
    "safety_margin",
    "travel_time",
)
PATH = {"length": 10.0, "safety_margin": 0.5, "travel_time": 12.0, "smoothness": 0.1}
SPENT = {"peak_memory_mb": 90.0, "collision_checks": 40, "waypoints": 5}

ROWS = [
    row("a", 0, "VALID", solve_s=1.0, **PATH, **SPENT),
    row("a", 1, "COLLISION", solve_s=0.1, **PATH, **SPENT),
    row("a", 2, "LATE", solve_s=5.5, **PATH, **SPENT),
    row("a", 3, "TIMEOUT", solve_s=5.0, peak_memory_mb=95.0),
    row("a", 4, "KILLED", solve_s=6.0),
    row(
        "b:range=2",
        0,
        "VALID",
        solve_s=2.0,
        **{**PATH, "travel_time": math.inf},
        stats=json.dumps({"cost_history": [[0.5, 14.0], [1.2, 12.0], [1.2, 10.0]]}),
    ),
    row(
        "b:range=2",
        1,
        "COLLISION",
        solve_s=2.0,
        **PATH,
        stats='{"cost_history": [[0.5, 10.0]]}',
    ),
    row("c", 0, "UNSUPPORTED", error="it learns over many scenes"),
]

MADE = ROWS[:-1]
"""What was attempted."""


def read(file: Path, table: str) -> pd.DataFrame:
    with closing(sqlite3.connect(file)) as connection:
        return pd.read_sql(f"SELECT * FROM {table}", connection)


def test_runs_are_counted_by_problems_that_there_are(tmp_path: Path) -> None:
    """The sets of MotionBenchMaker leave numbers out."""
    run = recorded(ROWS)
    [selection] = run.selections
    [env] = selection["envs"]
    counted = {**selection, "envs": [{**env, "problems": 5, "count": 3}], "repeats": 2}
    planner_arena.write(replace(run, selections=(counted,)), tmp_path / "a.db")
    assert read(tmp_path / "a.db", "experiments")["runcount"].tolist() == [6]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The database of `ROWS`."""
    planner_arena.write(recorded(ROWS), tmp_path / "planner_arena.db")
    return tmp_path / "planner_arena.db"


def test_nothing_is_left_beside_it(file: Path) -> None:
    assert list(file.parent.iterdir()) == [file]


def test_an_environment_is_an_experiment_with_its_settings(tmp_path: Path) -> None:
    session = {
        "run_id": "r",
        "wall_s": 10.0,
        "machine": {"system": "Linux", "processor": "a fast one"},
        "versions": {"plannerbench": "0.1.0"},
        "git": "abc",
    }
    rows = [*ROWS, row("a", 0, "VALID", env="box", measured_at="2025-12-31T00:00:00")]
    settings = {"time_limit_s": 5.0, "stop": "limit", "jobs": 1, "memory_limit_mb": 4096}
    run = replace(recorded(rows, settings=settings, seed=7), sessions=(session,))
    planner_arena.write(run, tmp_path / "a.db")
    experiments = read(tmp_path / "a.db", "experiments").set_index("name")
    assert experiments.index.tolist() == ["c3d", "box"]
    c3d = experiments.loc["c3d"]
    assert (c3d["timelimit"], c3d["memorylimit"], c3d["runcount"], c3d["seed"]) == (5, 4096, 5, 7)
    assert (c3d["totaltime"], c3d["version"]) == (10, "plannerbench 0.1.0")
    assert (c3d["hostname"], c3d["date"]) == ("Linux", "2026-01-01T00:00:00")
    assert experiments.loc["box", "date"] == "2025-12-31T00:00:00"
    assert json.loads(c3d["cpuinfo"])["processor"] == "a fast one"
    assert json.loads(c3d["setup"])["settings"] == settings
    assert json.loads(c3d["setup"])["not_attempted"] == {"c": "it learns over many scenes"}


def test_every_outcome_is_a_status(file: Path) -> None:
    enums = read(file, "enums")
    assert (enums["name"] == "status").all()
    assert enums["value"].tolist() == list(range(len(enums)))
    words = {LATE} | {word.value for kind in (Verdict, Status, Fault) for word in kind}
    assert set(enums["description"]) == words - {Status.EXACT_SOLUTION.value}


def test_every_attempt_is_a_run_and_its_status_the_outcome(file: Path) -> None:
    runs, enums = read(file, "runs"), read(file, "enums")
    configs = read(file, "plannerConfigs").set_index("id")
    assert len(runs) == len(MADE), "rates are of what was attempted"
    told = runs["status"].map(enums.set_index("value")["description"])
    assert told.tolist() == [r["outcome"] for r in MADE]
    assert runs["plannerid"].map(configs["name"]).tolist() == [r["planner"] for r in MADE]
    assert "c" not in configs["name"].tolist()
    assert json.loads(configs["settings"].iloc[1]) == {"id": "b:range=2", "version": 1}
    assert runs["solved"].tolist() == [r["solved"] for r in MADE]
    correct = runs["correct_solution"].astype(object).where(runs["correct_solution"].notna(), None)
    assert correct.tolist() == [1, 0, 0, None, None, 1, 0]


def test_of_a_path_that_was_not_judged_nobody_knows_whether_it_is_correct(tmp_path: Path) -> None:
    made = [row("a", 0, "VALID"), {**row("a", 1, "NOT_JUDGED"), "verdict": "NOT_JUDGED"}]
    planner_arena.write(recorded(made), tmp_path / "planner_arena.db")
    correct = read(tmp_path / "planner_arena.db", "runs")["correct_solution"]
    assert correct[0] == 1
    assert pd.isna(correct[1])


def test_only_verified_successes_have_a_solution(file: Path) -> None:
    runs = read(file, "runs")
    unsolved = runs[runs["solved"] == 0]
    assert len(unsolved) == 5
    assert unsolved[list(FOUND)].isna().all().all()
    first = runs.iloc[0]
    assert first[list(FOUND)].tolist() == [1.0, 10.0, 0.1, 4, 0.5, 12.0]
    assert pd.isna(runs.loc[5, "travel_time"]), "infinite is unknown"


def test_what_an_attempt_costs_is_there_even_if_it_failed(file: Path) -> None:
    runs = read(file, "runs")
    assert runs["time"].tolist() == [r["solve_s"] for r in MADE]
    assert runs["memory"].tolist()[:4] == [90, 90, 90, 95]
    assert runs["collision_checks"].tolist()[:3] == [40, 40, 40]


def test_progress_is_the_best_length_so_far_of_verified_successes(file: Path) -> None:
    runs, progress = read(file, "runs"), read(file, "progress")
    [solved] = progress["runid"].unique()
    assert solved == runs["id"].iloc[5]
    assert progress["time"].is_monotonic_increasing
    assert (progress["time"].min(), progress["time"].max()) == (0.5, 2.0)
    assert np.diff(progress["time"]).max() < 0.051
    before, at = progress["time"] < 1.2, progress["time"] == 1.2
    assert (progress["best_cost"][before] == 14).all()
    assert progress["best_cost"][at].tolist() == [10], "the best of two at once"
    assert (progress["best_cost"][~before] == 10).all()


def test_the_tables_are_those_of_ompls_script(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        tables = {
            table: {name: kind for _, name, kind, *_ in connection.execute(f"PRAGMA {table}")}
            for table in (
                f"table_info({name})"
                for name in ("experiments", "plannerConfigs", "enums", "runs", "progress")
            )
        }
        assert not connection.execute("PRAGMA foreign_key_check").fetchall()
    experiments, configs, enums, runs, progress = tables.values()
    assert list(experiments) == [
        *("id", "name", "totaltime", "timelimit", "memorylimit", "runcount", "version"),
        *("hostname", "cpuinfo", "date", "seed", "setup"),
    ]
    assert list(configs) == ["id", "name", "settings"]
    assert list(enums) == ["name", "value", "description"]
    assert list(runs)[:4] == ["id", "experimentid", "plannerid", "time"]
    kinds = {name: runs[name] for name in ("time", "status", "solved", "solution_segments")}
    assert list(kinds.values()) == ["REAL", "ENUM", "BOOLEAN", "INTEGER"]
    assert progress == {"runid": "INTEGER", "time": "REAL", "best_cost": "REAL"}


def test_runs_that_are_joined_are_told_apart(tmp_path: Path) -> None:
    """The same environment and a newer version of a planner, with another time limit."""
    other = recorded(
        [row("d", 0, "VALID", solve_s=1.0, run_id="s", planner_version=2)],
        settings={"time_limit_s": 9.0, "stop": "limit", "jobs": 1},
    )
    planner_arena.write(RunResults.joined([recorded(ROWS), other]), tmp_path / "a.db")
    experiments, runs = read(tmp_path / "a.db", "experiments"), read(tmp_path / "a.db", "runs")
    assert experiments["name"].tolist() == ["c3d", "c3d"]
    assert experiments["timelimit"].tolist() == [5, 9]
    assert runs["experimentid"].tolist() == [1] * len(MADE) + [2]
    assert load_database(tmp_path / "a.db")["problem_names"] == ["c3d"]


def test_it_is_written_afresh(file: Path) -> None:
    planner_arena.write(recorded(ROWS[:1]), file)
    assert len(read(file, "runs")) == 1


def test_a_full_disk_leaves_what_was_there(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, connect = file.read_bytes(), sqlite3.connect

    def without_room(*arguments: Any) -> sqlite3.Connection:
        connection = connect(*arguments)
        connection.execute("PRAGMA max_page_count = 12")
        return connection

    monkeypatch.setattr(sqlite3, "connect", without_room)
    many = [row("a", problem, "TIMEOUT", solve_s=5.0) for problem in range(2000)]
    with pytest.raises(OSError, match="full"):
        planner_arena.write(recorded(many), file)
    assert file.read_bytes() == before
    assert list(file.parent.iterdir()) == [file]


def test_planner_arena_knows_what_it_reads(file: Path) -> None:
    data = load_database(file)
    assert data["problem_names"] == ["c3d"]
    assert data["parameters"] == []
    assert data["attributes"] == [name.replace("_", " ") for name in read(file, "runs")][3:]
    runs = data["runs"]
    for attribute in data["attributes"]:
        assert runs.schema[attribute].is_numeric(), f"{attribute} has a plot"
    assert runs.schema["solution length"] == pl.Float64
    assert len(data["enums"].filter(pl.col("name") == "status")) == len(planner_arena.STATUSES)
    assert runs["experiment"].to_list() == ["c3d"] * len(MADE)
    assert runs["version"].unique().to_list() == ["plannerbench 0.0.0"]
    assert runs["solution length"].null_count() == 5
    assert data["progress"].columns == ["runid", "time", "best cost"]


def improving() -> list[dict[str, Any]]:
    """Attempts of two planners that go on improving, and of one that fails."""
    rng = np.random.default_rng(0)
    rows = [row("c", problem, "TIMEOUT", solve_s=5.0) for problem in range(4)]
    for planner in ("a", "b"):
        for problem in range(4):
            history = np.column_stack(
                [np.sort(rng.uniform(0.01, 4, 9)), np.sort(rng.uniform(10, 20, 9))[::-1]]
            ).tolist()
            stats = json.dumps({"cost_history": history})
            solution = {**PATH, "length": history[-1][1]}
            rows.append(row(planner, problem, "VALID", solve_s=4.9, stats=stats, **solution))
    return rows


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:render.download is deprecated")  # by its own code, as below
@pytest.mark.filterwarnings("ignore:The 'mode.copy_on_write' option is deprecated")
@pytest.mark.filterwarnings("ignore:unclosed file .*help.md:ResourceWarning")
@pytest.mark.filterwarnings("ignore:stat_boxplot . Removed:plotnine.exceptions.PlotnineWarning")
@pytest.mark.parametrize("attribute", ["solution length", "status"])
def test_planner_arena_plots_it(attribute: str, tmp_path: Path) -> None:
    import arena_app

    planner_arena.write(recorded(improving()), tmp_path / "a.db")
    start = arena_app.start_values(["a", "b", "c"], "c3d", "plannerbench 0.0.0")
    shown = arena_app.outputs(tmp_path / "a.db", {**start, "performance-attribute": attribute})
    for output in ("performance-plot", "progress-plot", "progress-plot_num_measurements"):
        picture = base64.b64decode(shown[output]["src"].partition(",")[2])
        assert picture.startswith(b"\x89PNG"), output
    missing = shown["performance-missing_data_table"]["payload"]["data"]
    of_c = 4 if attribute == "solution length" else 0
    assert missing == [["a", 0, 4], ["b", 0, 4], ["c", of_c, 4]]
