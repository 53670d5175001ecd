"""`bench replay` and what of a run it rests on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import plugins
import pytest
from conftest import Cli, Refused

from bench import replay
from bench.execution import machine
from bench.storage.record import decode_path, encode_path
from bench.storage.store_file import TABLES, digest, opened_to_read, opened_to_write

Change = Callable[..., Path]

MOODY = plugins.PLANNER.replace(
    "[problem.start, problem.goal]", "[problem.start, problem.start + {bend}, problem.goal]"
)
"""Goes round a corner that is put into the text."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of planners with and without the reference's lengths, one of them from a file."""
    from bench import cli

    folder = tmp_path_factory.mktemp("replay")
    (folder / "mine.py").write_text(MOODY.format(bend=0.0))
    planners = "fmm:resolution=30,rrtstar,straight"
    code = cli.main(
        ["run", "--env", "c3d", "--planners", planners, "--problems", "3", "--seed", "4"]
        + ["--stop", "match:fmm:resolution=30:0.2", "--out", str(folder / "run")]
        + ["--planner-file", str(folder / "mine.py")]
    )
    assert code == 0
    return folder


@pytest.fixture
def changed(finished: Path, tmp_path: Path) -> Change:
    """A copy of the run whose store is changed by SQL."""

    def call(*statements: str, **values: object) -> Path:
        shutil.copytree(finished / "run", tmp_path / "run")
        with closing(opened_to_write(tmp_path / "run")) as store, store:
            for statement in statements:
                store.execute(statement, values)
            for table, columns in TABLES.items():  # as if it had been stored so
                store.execute(f"UPDATE {table} SET digest = {digest(columns)}")
        return tmp_path / "run"

    return call


@pytest.mark.parametrize(("planner", "problem"), [("rrtstar", 2), ("fmm:order=2,resolution=30", 0)])
def test_an_attempt_comes_out_the_same(
    bench: Cli, finished: Path, planner: str, problem: int
) -> None:
    code, out, err = bench(
        "replay", finished / "run", "--planner", planner, "--problem", problem, "--env", "c3d"
    )
    assert code == 0, out + err
    assert "same path" in out.splitlines()
    rows = [line.split("|") for line in out.splitlines() if line.startswith(("| then", "| now"))]
    assert len(rows) == 2
    lengths = {row[6].strip() for row in rows}
    assert len(lengths) == 1
    assert float(lengths.pop()) > 0


def test_a_path_that_differs_is_shown_where_it_does(
    bench: Cli, finished: Path, changed: Change
) -> None:
    where = "WHERE planner = 'rrtstar' AND problem = 0"
    with closing(opened_to_read(finished / "run")) as store:
        [[stored]] = store.execute(f"SELECT path FROM records {where}").fetchall()
    path = decode_path(stored)
    path[1, 0] += 1e-9
    folder = changed(f"UPDATE records SET path = :path {where}", path=encode_path(path))
    code, out, _ = bench("replay", folder, "--planner", "rrtstar", "--problem", 0)
    assert code == 1
    assert "not the same: the paths differ from waypoint 1 on" in out
    assert f"{path[1, 0]:.17g}" in out


def test_another_verdict_is_told(bench: Cli, changed: Change) -> None:
    folder = changed("UPDATE records SET verdict = 'COLLISION' WHERE planner = 'rrtstar'")
    code, out, _ = bench("replay", folder, "--planner", "rrtstar", "--problem", 0)
    assert code == 1
    assert "not the same: another verdict: COLLISION then, VALID now" in out


def test_where_a_path_collides_is_told(bench: Cli, finished: Path) -> None:
    with closing(opened_to_read(finished / "run")) as store:
        where = "WHERE planner = 'straight' AND verdict = 'COLLISION'"
        [problem, *_] = store.execute(f"SELECT problem FROM records {where}").fetchone()
    asked = ("replay", finished / "run", "--planner", "straight", "--problem", problem)
    code, out, err = bench(*asked, "--planner-file", finished / "mine.py")
    assert code == 0, out + err
    [told] = [line for line in out.splitlines() if "collides" in line]
    assert told.startswith("the new path collides: the robot comes within 0.00")
    assert "(a box), " in told
    assert told.endswith("along the path, at or after waypoint 1"), "which is where the first is"


@pytest.mark.slow
def test_a_planner_of_a_file_is_replayed_with_its_file(
    bench: Cli, finished: Path, tmp_path: Path
) -> None:
    asked = ("replay", finished / "run", "--planner", "straight", "--problem", 1)
    code, out, err = bench(*asked, "--planner-file", finished / "mine.py")
    assert code == 0, out + err
    code, _, err = bench(*asked)
    assert code == 2
    assert "name that by --planner-file" in err
    (tmp_path / "mine.py").write_text(MOODY.format(bend=0.5))
    code, out, _ = bench(*asked, "--planner-file", tmp_path / "mine.py")
    assert code == 1
    assert "the paths differ from waypoint 1 on" in out
    assert "straight was another version" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--planner", "rrtsta", "--problem", 0), "did you mean 'rrtstar'"),
        (("--planner", "prmstar", "--problem", 0), "unknown planner of"),
        (("--planner", "rrtstar", "--problem", 3), "has no problem 3: it has 0 to 2"),
        (("--planner", "rrtstar", "--problem", -1), "has no problem -1"),
        (("--planner", "rrtstar", "--problem", 0, "--env", "box"), "unknown environment of"),
    ],
)
def test_what_the_run_does_not_have_is_refused(
    refused: Refused, finished: Path, arguments: tuple[object, ...], said: str
) -> None:
    assert said in refused("replay", finished / "run", *arguments)


def test_a_world_or_rules_that_changed_are_refused(refused: Refused, changed: Change) -> None:
    folder = changed(
        "UPDATE selection SET selection = replace(selection, "
        "json_extract(selection, '$.envs[0].fingerprint'), 'f00f00')",
        "UPDATE records SET env_fingerprint = 'f00f00'",
    )
    error = refused("replay", folder, "--planner", "rrtstar", "--problem", 0)
    assert "its fingerprint was f00f00 and is" in error


def test_rules_that_changed_are_refused(refused: Refused, changed: Change) -> None:
    folder = changed("UPDATE selection SET selection = json_set(selection, '$.settings.rules', 0)")
    error = refused("replay", folder, "--planner", "rrtstar", "--problem", 0)
    assert "measured by rules 0" in error


def test_a_folder_without_a_run_is_refused(refused: Refused, tmp_path: Path) -> None:
    error = refused("replay", tmp_path, "--planner", "rrtstar", "--problem", 0)
    assert "holds no run.sqlite" in error


@pytest.mark.parametrize(
    ("then", "now", "said"),
    [
        (None, None, ""),
        ([[0.0], [1.0]], None, "a path then only"),
        (None, [[0.0], [1.0]], "a path now only"),
        ([[0.0], [1.0]], [[0.0], [1.0]], ""),
        ([[0.0], [1.0]], [[0.0], [1.0], [2.0]], "ends at waypoint 1"),
        ([[0.0], [np.nan]], [[0.0], [np.nan]], ""),
        ([[0.0, 1.0], [1.0, 1.0]], [[0.0], [1.0]], "differ from waypoint 0"),
    ],
)
def test_differences_of_paths(
    then: list[list[float]] | None, now: list[list[float]] | None, said: str
) -> None:
    arrays = [None if path is None else np.array(path) for path in (then, now)]
    found = replay._path_difference(*arrays)
    assert said in found
    assert bool(said) == bool(found)


def test_the_manifest_names_what_a_replay_needs(finished: Path) -> None:
    manifest = json.loads((finished / "run" / "manifest.json").read_text())
    assert manifest["seed"] == 4
    assert manifest["settings"]["stop"] == "match:fmm:resolution=30:0.2"
    [session] = manifest["sessions"]
    assert set(session["thread_variables"].values()) == {"1"}
    assert "OMP_NUM_THREADS" in session["thread_variables"]
    assert session["machine"]["usable_cpus"]
    assert session["order"]["seed"] == 4
    assert session["git"] == machine.describe()["git"]
    assert session["versions"]["numpy"] == np.__version__
