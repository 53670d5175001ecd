"""`bench compare` through the command line, on runs stored in folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, Refused
from records import record_of, row

from bench.analysis.comparison import COLUMNS as COMPARED
from bench.storage.store import Store

PLANNERS = {"fmm": 1.0, "rrtstar": 2.0, "rrtconnect:range=2": 1.5}


def stored(
    folder: Path, scale: float = 1.0, planners: tuple[str, ...] = tuple(PLANNERS), **others: Any
) -> Path:
    """A folder as `bench run` leaves it, of ten problems in c3d."""
    selection = {
        "envs": [
            {"id": others.get("env", "c3d"), "fingerprint": others.get("env_fingerprint", "f")}
        ],
        "planners": list(planners),
        "problems": 10,
        "seed": others.get("problems_seed", 0),
        "settings": {"time_limit_s": 5.0, "stop": "first", "jobs": 1},
        "settings_digest": "s",
    }
    with Store(folder) as store:
        store.put_selection(selection)
        for planner in planners:
            for i in range(10):
                length = scale * PLANNERS[planner] * (10 + i)
                measured = {"solve_s": length / 100, "length": length, "safety_margin": 0.1}
                of_row = {k: v for k, v in others.items() if k != "session"}
                store.put(record_of(row(planner, i, "VALID", **measured, **of_row)))
        session = {"run_id": "r", "machine": {"processor": "X"}, **others.get("session", {})}
        store.put_session("r", session)
    return folder


def test_times_do_not_compare_if_variables_make_libraries_slower(
    bench: Cli, tmp_path: Path
) -> None:
    slow = {"speed_variables": {"NUMBA_DISABLE_JIT": "1"}}
    a, b = stored(tmp_path / "a"), stored(tmp_path / "b", session=slow)
    code, out, _ = bench("compare", a, b)
    assert code == 0
    [line] = [line for line in out.splitlines() if "Not comparable" in line]
    assert "NUMBA_DISABLE_JIT" in line
    same = stored(tmp_path / "same", session={"speed_variables": {}})
    assert "Not comparable" not in bench("compare", a, same)[1]


def test_two_runs(bench: Cli, tmp_path: Path) -> None:
    a, b = stored(tmp_path / "a"), stored(tmp_path / "b", 0.5)
    file = tmp_path / "table.csv"
    code, out, _ = bench("compare", a, b, "--out", file)
    assert code == 0
    assert f"A: `{a}`" in out
    assert out.count("| better") == 6, "time and length of three planners"
    table = pd.read_csv(file)
    assert tuple(table.columns) == COMPARED
    assert len(table) == 12
    lengths = table[table["measure"] == "length"]
    assert lengths["value_a"].tolist() == [scale * 14.5 for scale in PLANNERS.values()]
    assert lengths["estimate"].tolist() == [0.5] * 3
    assert lengths["p"].to_numpy() == pytest.approx(np.full(3, 2 / 2**10))
    assert set(table["folder_b"]) == {str(b)}
    counts = table.loc[table["measure"] == "success", ["only_a", "only_b"]]
    assert (counts == 0).all(axis=None)


def test_two_planners_of_one_run(bench: Cli, tmp_path: Path) -> None:
    a = stored(tmp_path / "a")
    code, out, _ = bench("compare", a, "--planners", "fmm,rrtstar")
    assert code == 0
    assert out.startswith(f"A and B: `{a}`")
    assert "2 [2, 2]" in out
    assert out.count("| worse") == 2
    assert bench("compare", a, "--planners", "rrt*,rrtconnect:range=2")[0] == 0, "as everywhere"


def test_metrics_have_the_names_that_checks_have(
    bench: Cli, refused: Refused, tmp_path: Path
) -> None:
    a = stored(tmp_path / "a")
    two = ("compare", a, "--planners", "fmm,rrtstar", "--metrics")
    assert bench(*two, "margin,time")[1] == bench(*two, "safety_margin,time_s")[1]
    assert "unknown metric 'margn'; did you mean 'margin'" in refused(*two, "margn")


def test_named_planners_of_two_runs(bench: Cli, tmp_path: Path) -> None:
    a, b = stored(tmp_path / "a"), stored(tmp_path / "b")
    code, out, _ = bench("compare", a, b, "--planners", "fmm")
    assert (code, out.count("| fmm ")) == (0, 8)
    assert "rrtstar" not in out
    code, out, _ = bench("compare", a, b, "--planners", "rrtstar,fmm")
    assert code == 0
    assert "0.5 [0.5, 0.5]" in out


def test_planners_that_no_longer_exist_still_compare(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(PLANNERS, "gone", 1.0)
    a = stored(tmp_path / "a", planners=("gone", "fmm"))
    assert bench("compare", a, "--planners", "gone,fmm")[0] == 0


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("fmn,rrtstar", "has no 'fmn'; did you mean 'fmm'?"),
        ("fmm,rrtsta", "has no 'rrtsta'; did you mean 'rrtstar'?"),
        ("fmm,prmstar", "has no 'prmstar'"),
        ("fmm", "name two planners of that run"),
        ("fmm,fmm", "name two planners of that run"),
        ("all", "name two planners of that run, from fmm, rrtstar, rrtconnect:range=2"),
        ("fmm,rrtstar,fmm", "name two planners of that run"),
        ("", "name two planners of that run"),
    ],
)
def test_misnamed_planners(named: str, said: str, refused: Refused, tmp_path: Path) -> None:
    assert said in refused("compare", stored(tmp_path / "a"), "--planners", named)


def test_three_planners_of_two_runs(refused: Refused, tmp_path: Path) -> None:
    a, b = stored(tmp_path / "a"), stored(tmp_path / "b")
    assert "one of each run" in refused("compare", a, b, "--planners", "fmm,rrtstar,fmm")


@pytest.mark.parametrize(
    ("others", "said"),
    [
        ({"env_fingerprint": "g"}, "fingerprint is f in A, g in B"),
        ({"problems_seed": 3}, "seed is 0 in A, 3 in B"),
        ({"env": "box", "env_fingerprint": "g"}, "box (fingerprint g, seed 0): only in B"),
    ],
)
def test_runs_that_share_nothing(
    others: dict[str, Any], said: str, refused: Refused, tmp_path: Path
) -> None:
    a, b = stored(tmp_path / "a"), stored(tmp_path / "b", **others)
    error = refused("compare", a, b, "--out", "table.csv")
    assert "nothing to compare" in error
    assert said in error


def test_folders_without_a_run(refused: Refused, tmp_path: Path) -> None:
    assert "holds no run.sqlite" in refused("compare", stored(tmp_path / "a"), tmp_path / "b")
    assert not (tmp_path / "b").exists()


def test_a_table_that_cannot_be_written(refused: Refused, tmp_path: Path) -> None:
    a = stored(tmp_path / "a")
    assert "cannot write" in refused("compare", a, a, "--out", tmp_path / "no" / "table.csv")


def test_a_third_run(refused: Refused, tmp_path: Path) -> None:
    assert "unknown argument" in refused("compare", tmp_path, tmp_path, tmp_path)
