"""Stores that were damaged, or made by an older version."""

from __future__ import annotations

import random
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from conftest import Cli, records_of

from bench.record import COLUMNS, KEY
from bench.report.recorded import RecordedRun
from bench.store import Store, StoredRecords
from bench.store_file import TABLES
from envs import InputError

PAGE = 4096
RUN = ("run", "--env", "c3d", "--planners", "rrtconnect,rrtstar", "--stop", "first", "--seed", 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a finished run."""
    from bench import cli

    folder = tmp_path_factory.mktemp("store") / "run"
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
    told = RecordedRun.read(folder)
    moments = random.Random(5)
    copy = tmp_path / "copy"
    copy.mkdir()
    seen = 0
    for begin in range(0, len(whole), PAGE):
        page = whole[begin : begin + PAGE]
        broken = whole[:begin] + damage(page, moments) + whole[begin + PAGE :]
        (copy / "run.sqlite").write_bytes(broken)
        try:
            read = RecordedRun.read(copy)
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
        store.execute("UPDATE records SET length = length / 2 WHERE problem = 3")
    with pytest.raises(InputError, match="2 of its records are not what was stored"):
        StoredRecords(copy)


def as_of_version_1(folder: Path, copy: Path) -> Path:
    """A copy as the first version of the store would hold it: without digests."""
    copy.mkdir()
    with closing(sqlite3.connect(copy / "run.sqlite")) as store:
        store.executescript(
            f"""
            CREATE TABLE records ({", ".join(COLUMNS)}, UNIQUE ({", ".join(KEY)}));
            CREATE TABLE sessions (run_id PRIMARY KEY, session);
            CREATE TABLE selection (id INTEGER PRIMARY KEY CHECK (id = 1), selection);
            PRAGMA application_id = {0x504C4E42};
            PRAGMA user_version = 1;
            """
        )
        store.execute("ATTACH ? AS newer", (str(folder / "run.sqlite"),))
        for table, columns in TABLES.items():
            names = ", ".join(columns)
            store.execute(f"INSERT INTO {table} SELECT {names} FROM newer.{table}")
        store.commit()
    return copy


def test_an_older_store_is_read_as_it_is(folder: Path, tmp_path: Path) -> None:
    older = as_of_version_1(folder, tmp_path / "older")
    before = (older / "run.sqlite").read_bytes()
    assert RecordedRun.read(older).records.equals(records_of(folder))
    assert (older / "run.sqlite").read_bytes() == before


def test_a_run_goes_on_in_an_older_store(bench: Cli, folder: Path, tmp_path: Path) -> None:
    older = as_of_version_1(folder, tmp_path / "older")
    assert bench(*RUN, "--problems", 13, "--out", older)[0] == 0
    records = records_of(older)
    assert len(records) == 2 * 13
    kept = records[records["problem"] < 12].reset_index(drop=True)
    assert kept.equals(records_of(folder)), "what it held was not measured again"


@pytest.mark.parametrize("version", [0, 3, 99])
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
        assert f"version {version}, this program knows 1 and 2; use the program that made it" in err
    assert (copy / "run.sqlite").read_bytes() == before


def test_what_is_kept_does_not_depend_on_the_store_being_closed(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put_selection({"a": 1})
        with StoredRecords(tmp_path) as reader:
            assert reader.selection() == {"a": 1}
