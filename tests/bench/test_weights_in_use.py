"""What was measured with some weights is not shown, or taken for measured, with others."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pandas as pd
import pytest
import told_planners
from conftest import Cli, records_of

import envs
import planners
from bench.storage.store import Store
from envs import Environment
from planners.learning import weight_files

ENV = "c3d:scene=55,boxes=3"


@pytest.fixture(autouse=True)
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Planners that tell their weights, and a cache of their own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for spec in told_planners.SPECS:
        planners.REGISTRY.register(spec)
    yield
    for spec in told_planners.SPECS:
        planners.REGISTRY.unregister(spec.id)


def numbers(folder: Path) -> list[float | None]:
    """What the planner told, by problem, in the rows that a report shows."""
    return [json.loads(stats).get("number") for stats in records_of(folder)["stats"]]


def rows_held(folder: Path) -> int:
    with closing(sqlite3.connect(folder / "run.sqlite")) as store:
        [(count,)] = store.execute("SELECT count(*) FROM records").fetchall()
    return count


GIVEN = "w.safetensors"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planner", "trained", "more"),
    [
        ("told", "told", ()),
        ("told-once", "told-once", ()),
        (f"told:weights={GIVEN}", "told", ("--out", GIVEN)),
    ],
)
@pytest.mark.usefixtures("in_process_workers")
def test_weights_that_were_trained_anew_are_measured_anew(
    planner: str,
    trained: str,
    more: tuple[str, ...],
    bench: Cli,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    run = ("run", "--env", ENV, "--planners", planner, "--problems", 2, "--stop", "first")
    run = (*run, "--out", "run")

    def learn(number: int) -> None:
        monkeypatch.setenv("TOLD_NUMBER", str(number))
        assert bench("train", "--env", ENV, "--planner", trained, *more)[0] == 0

    learn(1)
    assert bench(*run)[0] == 0
    assert numbers(Path("run")) == [1, 1]
    [first] = records_of(Path("run"))["weights"].unique()
    learn(2)
    assert bench("report", "run")[0] == 0
    assert numbers(Path("run")) == [1, 1], "a report is of what was asked for last"
    assert bench(*run)[0] == 0
    assert numbers(Path("run")) == [2, 2]
    assert rows_held(Path("run")) == 4
    learn(1)
    assert bench(*run)[0] == 0
    assert numbers(Path("run")) == [1, 1], "the same numbers are the same weights"
    assert rows_held(Path("run")) == 4, "so nothing is measured twice"
    assert records_of(Path("run"))["weights"].unique() == [first]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_weights_of_a_family_are_those_of_each_of_its_scenes(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = "c3d:scene=56,boxes=3"
    run = ("run", "--env", f"{ENV},{other}", "--planners", "told-once", "--problems", 1)
    for number in (1, 2):
        monkeypatch.setenv("TOLD_NUMBER", str(number))
        assert bench("train", "--env", ENV, "--planner", "told-once")[0] == 0
        assert bench(*run, "--stop", "first", "--out", tmp_path)[0] == 0
        assert numbers(tmp_path) == [number, number]


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_what_is_trained_on_the_spot_is_what_is_measured(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOLD_NUMBER", "3")
    run = ("run", "--env", ENV, "--planners", "told", "--problems", 2, "--stop", "first")
    run = (*run, "--out", tmp_path)
    assert bench(*run, "--no-train")[0] == 3
    assert numbers(tmp_path) == [None, None]
    assert bench(*run)[0] == 0
    assert numbers(tmp_path) == [3, 3]
    file = weight_files.cached_file("told", envs.make(ENV).fingerprint)
    assert set(records_of(tmp_path)["weights"]) == {weight_files.digest(file)}
    before = records_of(tmp_path)
    assert bench(*run)[0] == 0
    pd.testing.assert_frame_equal(records_of(tmp_path), before)


@pytest.mark.slow
def test_weights_that_are_replaced_while_a_run_goes_on_are_not_mixed_with_the_others(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in (1, 2):
        monkeypatch.setenv("TOLD_NUMBER", str(number))
        file = tmp_path / f"{number}.safetensors"
        assert bench("train", "--env", ENV, "--planner", "swaps", "--out", file)[0] == 0
    monkeypatch.setenv("OTHER_WEIGHTS", str(file))
    planner = f"swaps:weights={tmp_path / '1.safetensors'}"
    run = ("run", "--env", ENV, "--planners", planner, "--problems", 4, "--stop", "first")
    assert bench(*run, "--out", tmp_path / "run")[0] == 0
    with Store(tmp_path / "run") as store:
        chosen = store.selection()
        fingerprints = [env["fingerprint"] for env in chosen["envs"]]
        records = store.records(fingerprints, chosen["seed"], chosen["settings_digest"])
    assert records["weights"].nunique() == 1
    assert records["status"].tolist() == ["EXACT_SOLUTION", "CRASH", "ERROR", "ERROR"]
    assert records["error"].str.contains("weights were replaced").tolist() == [0, 0, 1, 1]


def test_a_planner_that_asks_another_has_its_weights_too(c3d: Environment) -> None:
    alone = planners.make("mpnet").weights_digest(c3d)
    assert alone
    assert planners.make("mpnet-hybrid").weights_digest(c3d) == alone, "OMPL has none"
    asks = planners.make("mpnet:fallback=ntfields").weights_digest(c3d)
    assert asks == f"{alone}-{planners.make('ntfields').weights_digest(c3d)}"
    assert planners.make("fmm").weights_digest(c3d) == ""


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_replaying_says_that_the_weights_are_others(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for number in (1, 2):
        monkeypatch.setenv("TOLD_NUMBER", str(number))
        assert bench("train", "--env", ENV, "--planner", "told")[0] == 0
        if number == 1:
            run = ("run", "--env", ENV, "--planners", "told", "--problems", 1, "--stop", "first")
            assert bench(*run, "--out", "run")[0] == 0
    from bench.replay import replay

    assert replay(Path("run"), "told", 0).notes == ("told has other weights than it had then",)
