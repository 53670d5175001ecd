"""Stores that strangers hand over with something in them that acts by itself."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from conftest import Refused
from records import record_of, row

from bench.storage.store import Store
from bench.storage.store_file import row_digest

ACTING = {
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON sessions BEGIN DELETE FROM records; END",
    "a trigger with escapes": 'CREATE TRIGGER "\x1b[2J" AFTER INSERT ON sessions'
    " BEGIN DELETE FROM records; END",
    "a trigger on what was asked for": "CREATE TRIGGER t BEFORE INSERT ON selection"
    " BEGIN UPDATE records SET solved = 1; END",
    "a view": "CREATE VIEW v AS SELECT * FROM records",
    "a view in a table's place": "ALTER TABLE records RENAME TO others;"
    "CREATE VIEW records AS SELECT * FROM others",
    "another table": "CREATE TABLE more (a)",
    "a virtual table": "DROP TABLE sessions; CREATE VIRTUAL TABLE sessions USING fts5(run_id)",
    "an index of expressions": "CREATE INDEX i ON records (abs(solved))",
}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    with Store(folder) as store:
        store.put(record_of(row("p", 0, "VALID")))
    return folder


@pytest.mark.parametrize("acting", ACTING)
def test_it_is_refused_unread_and_unwritten(
    store: Path, acting: str, refused: Refused, tmp_path: Path
) -> None:
    folder = tmp_path / "given"
    shutil.copytree(store, folder)
    file = folder / "run.sqlite"
    with closing(sqlite3.connect(file)) as connection:
        connection.executescript(ACTING[acting])
        rows = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    for command in (
        ("report", folder),
        ("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", 1, "--out", folder),
    ):
        error = refused(*command)
        assert "which is none of a store's" in error
        assert "\x1b" not in error
    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("SELECT count(*) FROM sqlite_master").fetchone() == rows


def test_a_store_that_calls_functions_by_itself_is_refused(
    store: Path, refused: Refused, tmp_path: Path
) -> None:
    """Such as a digest that computes itself, and so fits whatever the row says."""
    folder = tmp_path / "given"
    shutil.copytree(store, folder)
    with closing(sqlite3.connect(folder / "run.sqlite")) as connection:
        connection.create_function("row_digest", -1, row_digest, deterministic=True)
        connection.executescript(
            "DROP TABLE sessions; CREATE TABLE sessions (run_id PRIMARY KEY, session,"
            " digest GENERATED ALWAYS AS (row_digest(run_id, session)));"
            "INSERT INTO sessions VALUES ('r', '{}');"
        )
    assert "unsafe use of row_digest()" in refused("report", folder)
