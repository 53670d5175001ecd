"""`bench run` from end to end: files, resuming, stop rules, interruption."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, records_of

from bench.storage.record import decode_path

PLANNERS = "fmm:resolution=40,rrtconnect,rrtstar"


def small_run(folder: Path, *more: object) -> list[object]:
    return [
        *("run", "--env", "c3d", "--planners", PLANNERS, "--problems", 12, "--seed", 5),
        *("--stop", "match:fmm:resolution=40", "--out", folder, *more),
    ]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small run of three planners, made through the command itself."""
    folder = tmp_path_factory.mktemp("run")
    command = [sys.executable, "-m", "bench", *map(str, small_run(folder))]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout == (folder / "summary.md").read_text() + "\n"
    return folder


def test_the_four_files(finished: Path) -> None:
    names = {path.name for path in finished.iterdir()}
    assert names == {"run.sqlite", "summary.csv", "summary.md", "manifest.json"}


def test_the_summary_has_its_columns_and_means_what_it_says(finished: Path) -> None:
    summary = pd.read_csv(finished / "summary.csv")
    wanted = [
        "env",
        "planner",
        "problems",
        "solved",
        "success_rate",
        "success_low",
        "success_high",
        "time_s_mean",
        "time_s_std",
        "time_s_median",
        "length_mean",
        "length_std",
        "safety_margin_mean",
        "safety_margin_std",
        "setup_s",
        "train_s",
        "status_counts",
    ]
    assert set(wanted) <= set(summary.columns)
    assert summary["planner"].tolist() == ["fmm:resolution=40", "rrtconnect", "rrtstar"]
    assert (summary["env"] == "c3d").all()
    assert (summary["problems"] == 12).all()
    records = records_of(finished)
    for row in summary.itertuples():
        own = records[records["planner"] == row.planner]
        valid = own[own["verdict"] == "VALID"]
        assert row.solved == len(valid)
        assert row.success_rate == pytest.approx(len(valid) / 12)
        assert row.success_low <= row.success_rate <= row.success_high
        assert row.time_s_mean == pytest.approx(valid["solve_s"].mean())
        assert row.length_std == pytest.approx(valid["length"].std())
        assert row.safety_margin_mean == pytest.approx(valid["safety_margin"].mean())
        assert json.loads(row.status_counts)["VALID"] == len(valid)


def test_every_attempt_left_a_row_with_its_path(finished: Path) -> None:
    records = records_of(finished)
    assert len(records) == 36
    assert (
        records.groupby("planner")["problem"].apply(list).map(sorted).tolist()
        == [list(range(12))] * 3
    )
    for row in records.itertuples():
        path = decode_path(row.path)
        assert path.shape == (row.waypoints, 3)
        assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() == pytest.approx(row.length)
        assert row.peak_memory_mb > 10
        assert row.setup_s > 0
        assert row.travel_time >= row.length - 1e-9
    sampling = records[records["planner"] != "fmm:resolution=40"]
    assert (sampling["collision_checks"] > 0).all()


def test_planners_that_improve_match_the_reference(finished: Path) -> None:
    records = records_of(finished).set_index(["planner", "problem"])["length"]
    reference = records["fmm:resolution=40"]
    assert (records["rrtstar"] <= 1.05 * reference + 1e-9).all()


def test_the_manifest_names_what_was_run_where(finished: Path) -> None:
    manifest = json.loads((finished / "manifest.json").read_text())
    assert manifest["planners"] == PLANNERS.split(",")
    assert manifest["seed"] == 5
    assert manifest["settings"]["stop"] == "match:fmm:resolution=40:0.05"
    assert manifest["envs"][0]["id"] == "c3d"
    [session] = manifest["sessions"]
    assert session["attempts"] == 36
    assert session["versions"]["ompl"] == "1.7.0"
    assert session["machine"]["physical_cores"] >= 1
    assert 0 < manifest["overhead_share"] < 1
    spent = session["setup_s"] + session["solve_s"]
    assert manifest["overhead_share"] == pytest.approx(1 - spent / session["wall_s"], abs=1e-3)


def test_a_second_call_measures_nothing_and_prints_the_same(finished: Path, bench: Cli) -> None:
    before = (finished / "summary.csv").read_bytes(), records_of(finished)
    manifest = (finished / "manifest.json").read_bytes()
    code, out, _ = bench(*small_run(finished))
    assert code == 0
    assert out == (finished / "summary.md").read_text() + "\n"
    assert (finished / "summary.csv").read_bytes() == before[0]
    assert (finished / "manifest.json").read_bytes() == manifest
    pd.testing.assert_frame_equal(records_of(finished), before[1])


def test_report_repeats_the_table_elsewhere(finished: Path, bench: Cli, tmp_path: Path) -> None:
    code, out, _ = bench("report", finished, "--format", "csv", "--out", tmp_path)
    assert code == 0
    assert "rrtstar" in out
    assert [p.name for p in tmp_path.iterdir()] == ["summary.csv"]
    assert (tmp_path / "summary.csv").read_bytes() == (finished / "summary.csv").read_bytes()


def test_show_draws_the_scene_and_the_paths(finished: Path, bench: Cli, tmp_path: Path) -> None:
    paths = ("--paths", finished)
    for name, more in (
        ("plain", ()),
        ("paths", paths),
        ("one", (*paths, "--planners", "rrtstar", "--problem", 3)),
    ):
        file = tmp_path / f"{name}.png"
        assert bench("show", "--env", "c3d", *more, "--out", file)[0] == 0
        assert file.read_bytes().startswith(b"\x89PNG")
    assert len({path.read_bytes() for path in tmp_path.iterdir()}) == 3
    code, _, err = bench("show", "--env", "c3d", *paths, "--planners", "fmt", "--out", "x.png")
    assert code == 2
    assert "no path" in err


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_more_problems_only_add_to_what_is_there(
    bench: Cli, faulty: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = tmp_path / "count"
    monkeypatch.setenv("COUNT_FILE", str(counted))
    out = tmp_path / "out"
    run = ("run", "--env", "c3d", "--planners", "counts", "--stop", "first", "--out", out)

    def asked() -> list[int]:
        lines = counted.read_text().split("\n")[:-1]
        counted.write_text("")
        return [int(line.split()[0]) for line in lines[1:]]  # the first one is the warm-up

    assert bench(*run, "--problems", 3)[0] == 0
    assert asked() == [0, 1, 2]
    assert bench(*run, "--problems", 13)[0] == 0
    assert asked() == list(range(3, 13))
    assert bench(*run, "--problems", 13)[0] == 0
    assert counted.read_text() == ""
    assert bench(*run, "--problems", 2, "--force")[0] == 0
    assert asked() == [0, 1]
    assert bench(*run, "--problems", 2, "--seed", 9)[0] == 0
    assert asked() == [0, 1], "another seed has other problems"
    sessions = json.loads((out / "manifest.json").read_text())["sessions"]
    assert [s["attempts"] for s in sessions] == [2], "only those that measured what is shown"
    assert bench(*run, "--problems", 2, "--time-limit", 3)[0] == 0
    assert asked() == [0, 1], "another time limit is another measurement"


@pytest.mark.slow
def test_two_at_a_time_give_the_same_problems_and_verdicts(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "c3d,c3d:scene=1", "--planners", "rrtconnect,bitstar", "--problems", 11)
    tables = []
    for jobs in (1, 2):
        code, _, err = bench(*run, "--stop", "first", "--jobs", jobs, "--out", tmp_path / str(jobs))
        if code == 2 and "physical cores" in err:
            pytest.skip("this machine has one core")
        assert code == 0
        records = records_of(tmp_path / str(jobs))
        assert len(records) == 44
        tables.append(records[["env", "planner", "problem", "seed", "outcome", "length"]])
    pd.testing.assert_frame_equal(*tables)


@pytest.mark.usefixtures("in_process_workers")
def test_nothing_measured_is_exit_3(bench: Cli, faulty: list[str], tmp_path: Path) -> None:
    run = ("run", "--env", "c3d", "--planners", "unsupporting", "--problems", 1, "--stop", "first")
    code, out, _ = bench(*run, "--out", tmp_path)
    assert code == 3
    assert "UNSUPPORTED 1" in out
    assert "setup:" not in out, "it says so by itself, and nothing failed"


def test_all_leaves_out_what_supports_nothing(
    bench: Cli, faulty: list[str], tmp_path: Path
) -> None:
    import planners
    from bench.execution.config import make_run_config

    config = make_run_config(
        env="c3d",
        planner="all",
        problems=1,
        seed=0,
        time_limit_s=1,
        stop="first",
        jobs=1,
        memory_limit_mb=1000,
    )
    ids = {entry.id for entry in config.planners}
    assert "unsupporting" not in ids
    listed = {spec.id for spec in planners.REGISTRY.specs() if spec.in_all}
    assert ids == listed - {"unsupporting"}
    assert "ntfields" in ids
    assert "ntfields-paper" not in ids


def test_too_many_problems_for_a_scene_write_nothing(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("envs.scenes.cluttered.Cluttered3D.min_clearance", 15.0)
    code, _, err = bench("run", "--env", "c3d", "--planners", "fmm", "--out", tmp_path / "out")
    assert code == 2
    assert "fewer boxes or problems" in err
    assert not (tmp_path / "out").exists()
