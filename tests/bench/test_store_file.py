"""Stores that were damaged, or made by an older version."""

from __future__ import annotations

import random
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, records_of
from in_process_worker import in_process
from records import record_of

from bench.analysis.run_results import RunResults
from bench.execution import machine
from bench.judging.metrics import METRICS
from bench.storage.record import COLUMNS, KEY
from bench.storage.store import Store, StoredRecords
from bench.storage.store_file import TABLES, row_digest
from envs import InputError

PAGE = 4096
RUN = ("run", "--env", "c3d", "--planners", "rrtconnect,rrtstar", "--stop", "first", "--seed", 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a finished run."""
    from bench import cli

    folder = tmp_path_factory.mktemp("store") / "run"
    with in_process():
        assert cli.main([str(a) for a in (*RUN, "--problems", 12, "--out", folder)]) == 0
    return folder


def zeros(page: bytes, moments: random.Random) -> bytes:
    return bytes(len(page))


def noise(page: bytes, moments: random.Random) -> bytes:
    return moments.randbytes(len(page))


def one_byte(page: bytes, moments: random.Random) -> bytes:
    at = moments.randrange(len(page))
    return page[:at] + bytes([page[at] ^ (1 << moments.randrange(8))]) + page[at + 1 :]


def half(page: bytes, moments: random.Random) -> bytes:
    return page[: len(page) // 2] + moments.randbytes(len(page) - len(page) // 2)


@pytest.mark.parametrize(
    ("damage", "least_seen"), [(zeros, 0.9), (noise, 0.9), (half, 0.9), (one_byte, 0.2)]
)
def test_a_damaged_page_is_seen_or_does_no_harm(
    folder: Path,
    damage: Callable[[bytes, random.Random], bytes],
    least_seen: float,
    tmp_path: Path,
) -> None:
    """A byte may lie where nothing is stored, or a number that SQLite keeps for itself."""
    whole = (folder / "run.sqlite").read_bytes()
    told = RunResults.read(folder)
    moments = random.Random(5)
    copy = tmp_path / "copy"
    copy.mkdir()
    seen = 0
    for begin in range(0, len(whole), PAGE):
        page = whole[begin : begin + PAGE]
        broken = whole[:begin] + damage(page, moments) + whole[begin + PAGE :]
        (copy / "run.sqlite").write_bytes(broken)
        try:
            read = RunResults.read(copy)
        except InputError as error:
            seen += 1
            assert "\n" not in str(error)
        else:
            assert read.records.equals(told.records)
            assert read.selections == told.selections
            assert read.sessions == told.sessions
    assert seen >= least_seen * (len(whole) // PAGE)


def test_nothing_is_added_to_a_damaged_store(bench: Cli, folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    whole = bytearray((copy / "run.sqlite").read_bytes())
    at = whole.index(b", 3]\n") + 5  # the numbers of a path, of which SQLite knows nothing
    whole[at : at + 8] = bytes(8)
    (copy / "run.sqlite").write_bytes(whole)
    before = {file.name: file.read_bytes() for file in copy.iterdir()}
    for command in ((*RUN, "--problems", 20, "--out", copy), ("report", copy)):
        code, out, err = bench(*command)
        assert (code, out) == (2, "")
        assert err.count("\n") == 1
        assert "is damaged" in err
        assert "put a copy of it back" in err
    assert {file.name: file.read_bytes() for file in copy.iterdir()} == before


def test_a_changed_number_is_seen(folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    with closing(sqlite3.connect(copy / "run.sqlite")) as store, store:
        store.execute("UPDATE records SET solve_s = solve_s / 2 WHERE problem = 3")
    with pytest.raises(InputError, match="2 of its records are not what was stored"):
        StoredRecords(copy)


SINCE_3 = {"weights": "", "cpu_s": None, "load": None, "attempt_memory_mb": None, "processor": ""}
"""Columns of the third version, and what stands for them in older records."""

METRICS_OF_3 = ("length", "safety_margin", "travel_time", "smoothness", "waypoints")
"""What the third version had in columns."""


def columns_of(version: int) -> list[str]:
    """The columns of a record in a store of a version before the fifth."""
    place = COLUMNS.index("metrics")
    metrics = METRICS_OF_3 if version < 4 else ("metrics",)
    columns = [*COLUMNS[:place], *metrics, *COLUMNS[place + 1 :]]
    since_4 = ("repeat",) if version < 4 else ()
    lacking = {"scene_s", *since_4, *(SINCE_3 if version < 3 else ())}
    return [column for column in columns if column not in lacking]


def older_store(version: int, source: Path, copy: Path) -> Path:
    """A copy of a store as an earlier version would hold it; the first had no digests."""
    copy.mkdir()
    digest = ", digest" if version > 1 else ""
    held = {**TABLES, "records": columns_of(version)}
    key = [column for column in KEY if column in held["records"]]
    with closing(sqlite3.connect(copy / "run.sqlite")) as store:
        store.create_function("row_digest", -1, row_digest, deterministic=True)
        store.executescript(
            f"""
            CREATE TABLE records ({", ".join(held["records"])}{digest}, UNIQUE ({", ".join(key)}));
            CREATE TABLE sessions (run_id PRIMARY KEY, session{digest});
            CREATE TABLE selection (id INTEGER PRIMARY KEY CHECK (id = 1), selection{digest});
            PRAGMA application_id = {0x504C4E42};
            PRAGMA user_version = {version};
            """
        )
        store.execute("ATTACH ? AS newer", (str(source / "run.sqlite"),))
        for table, columns in held.items():
            names = ", ".join(
                f"json_extract(metrics, '$.{c}') AS {c}" if c in METRICS_OF_3 else c
                for c in columns
            )
            of_row = f", row_digest({', '.join(columns)})" if version > 1 else ""
            store.execute(
                f"INSERT INTO {table} SELECT *{of_row} FROM (SELECT {names} FROM newer.{table})"
            )
        store.commit()
    return copy


def as_older(records: pd.DataFrame, version: int) -> pd.DataFrame:
    """Records as they are after a store of an earlier version held them."""
    known_then = {"time_s", *METRICS_OF_3} if version < 4 else {metric.name for metric in METRICS}
    unknown = {metric.name for metric in METRICS} - known_then
    lacking = {**(SINCE_3 if version < 3 else {}), **dict.fromkeys(unknown, np.nan)}
    return records.assign(**lacking).drop(columns="metrics")


def known(records: pd.DataFrame) -> pd.DataFrame:
    """Without the text that metrics are stored as."""
    return records.drop(columns="metrics")


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_an_older_store_is_read_as_it_is(folder: Path, version: int, tmp_path: Path) -> None:
    older = older_store(version, folder, tmp_path / "older")
    before = (older / "run.sqlite").read_bytes()
    records = RunResults.read(older).records
    wanted = as_older(records_of(folder), version)
    pd.testing.assert_frame_equal(known(records)[list(wanted)], wanted)
    assert (older / "run.sqlite").read_bytes() == before
    assert [file.name for file in older.iterdir()] == ["run.sqlite"]


@pytest.mark.slow
@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.usefixtures("in_process_workers")
def test_a_run_goes_on_in_an_older_store(
    bench: Cli, folder: Path, version: int, tmp_path: Path
) -> None:
    older = older_store(version, folder, tmp_path / "older")
    assert bench(*RUN, "--problems", 13, "--out", older)[0] == 0
    records = records_of(older)
    assert len(records) == 2 * 13
    kept = known(records[records["problem"] < 12]).reset_index(drop=True)
    # Metrics that there were none of are computed from the paths, except of the attempt itself.
    told = known(records_of(folder)).assign(**(SINCE_3 if version < 3 else {}))
    assert kept[list(told)].astype(object).equals(told.astype(object)), "not measured again"
    new = records[records["problem"] == 12]
    assert (new["processor"] == machine.processor()).all()
    assert older_sessions(older) == older_sessions(folder)


def older_sessions(folder: Path) -> object:
    """The first of a store's sessions."""
    with StoredRecords(folder) as store:
        return store.sessions()[0]


def test_what_was_damaged_before_is_not_taken_over(
    bench: Cli, folder: Path, tmp_path: Path
) -> None:
    older = older_store(2, folder, tmp_path / "older")
    with closing(sqlite3.connect(older / "run.sqlite")) as store, store:
        store.execute("UPDATE records SET solve_s = solve_s / 2 WHERE problem = 3")
    before = (older / "run.sqlite").read_bytes()
    for command in ((*RUN, "--problems", 20, "--out", older), ("report", older)):
        code, _, err = bench(*command)
        assert code == 2
        assert "2 of its records are not what was stored" in err
    assert (older / "run.sqlite").read_bytes() == before


def test_records_with_other_weights_stand_side_by_side_in_a_store_that_was_older(
    folder: Path, tmp_path: Path
) -> None:
    older = older_store(2, folder, tmp_path / "older")
    with Store(older) as store:
        values = records_of(folder).iloc[0].to_dict()
        store.put(record_of({**values, "weights": "another"}))
        store.put(record_of({**values, "weights": "another"}))
        rows = store.records(
            [values["env_fingerprint"]], values["problems_seed"], values["settings"]
        )
        of_planner = rows[rows["planner"] == values["planner"]]
        assert of_planner["weights"].value_counts().to_dict() == {"": 12, "another": 1}


@pytest.mark.parametrize("version", [0, 6, 99])
def test_a_store_of_an_unknown_version_is_left_alone(
    bench: Cli, folder: Path, version: int, tmp_path: Path
) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    with closing(sqlite3.connect(copy / "run.sqlite")) as store:
        store.execute(f"PRAGMA user_version = {version}")
    before = (copy / "run.sqlite").read_bytes()
    for command in ((*RUN, "--problems", 20, "--out", copy), ("report", copy)):
        code, _, err = bench(*command)
        assert code == 2
        assert f"version {version}, this program knows 1 to 5; use the program that made it" in err
    assert (copy / "run.sqlite").read_bytes() == before


def test_what_is_kept_does_not_depend_on_the_store_being_closed(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put_selection({"a": 1})
        with StoredRecords(tmp_path) as reader:
            assert reader.selection() == {"a": 1}
