"""Records on disk: SQLite in `DIR/run.sqlite`, one transaction a row."""

from __future__ import annotations

import json
import sqlite3
import threading
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from types import TracebackType
from typing import Any

import pandas as pd

from bench.record import COLUMNS, KEY, Record
from envs import InputError

FILE = "run.sqlite"
_APPLICATION_ID = 0x504C4E42  # "PLNB"
_VERSION = 1

# In one transaction: killed in between, half of it would be taken for a stranger's file.
_SCHEMA = f"""
BEGIN;
CREATE TABLE records ({", ".join(COLUMNS)}, UNIQUE ({", ".join(KEY)}));
CREATE TABLE sessions (run_id PRIMARY KEY, session);
CREATE TABLE selection (id INTEGER PRIMARY KEY CHECK (id = 1), selection);
PRAGMA application_id = {_APPLICATION_ID};
PRAGMA user_version = {_VERSION};
COMMIT;
"""


class Store:
    """The records of a folder. Safe to use from several threads.

    Args:
        folder: made if missing, unless `create` is False.

    Raises:
        InputError: the folder cannot be used, or the file there is not a store of this version.
    """

    def __init__(self, folder: Path, *, create: bool = True) -> None:
        self._file = folder / FILE
        if not create and not self._file.is_file():
            raise InputError(f"{folder} holds no {FILE}; name a folder that `bench run` wrote")
        self._lock = threading.Lock()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if self._file.is_file() and self._file.stat().st_size:
                self._check_magic()
            self._connection = sqlite3.connect(self._file, check_same_thread=False, timeout=30)
        except (OSError, sqlite3.Error) as error:
            raise InputError(f"cannot use {self._file} as a store: {error}") from error
        try:
            self._open()
        except sqlite3.Error as error:
            self._connection.close()
            raise InputError(f"cannot use {self._file} as a store: {error}") from error
        except InputError:
            self._connection.close()
            raise

    def _check_magic(self) -> None:
        """SQLite itself would take a file of a few bytes for an empty database."""
        with self._file.open("rb") as file:
            if not file.read(16).startswith(b"SQLite format 3\0"):
                raise InputError(f"cannot use {self._file} as a store: it is another kind of file")

    def _open(self) -> None:
        [application] = self._connection.execute("PRAGMA application_id").fetchone()
        [version] = self._connection.execute("PRAGMA user_version").fetchone()
        [tables] = self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if tables == 0:
            self._connection.executescript(_SCHEMA)
        elif application != _APPLICATION_ID:
            raise InputError(f"{self._file} is not a store of this program; choose another --out")
        elif version != _VERSION:
            raise InputError(
                f"{self._file} is a store of version {version}, this program writes {_VERSION}; "
                "choose another --out"
            )
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = FULL")

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        tb: TracebackType | None,
    ) -> None:
        self._connection.close()

    def put(self, record: Record) -> None:
        """Adds a record at once and for good, in place of one with the same key."""
        marks = ", ".join("?" * len(COLUMNS))
        with self._lock, self._connection:
            self._connection.execute(
                f"INSERT OR REPLACE INTO records VALUES ({marks})", astuple(record)
            )

    def records(
        self,
        env_fingerprints: Sequence[str],
        problems_seed: int,
        settings: str,
        versions: Mapping[str, int] | None = None,
    ) -> pd.DataFrame:
        """All records of some environments, a seed and a digest of settings, in order.

        Args:
            versions: of planners; what others or other versions of them did is left out. By
                default nothing is.
        """
        marks = ", ".join("?" * len(env_fingerprints))
        with self._lock:
            rows = self._connection.execute(
                f"SELECT * FROM records WHERE env_fingerprint IN ({marks})"
                " AND problems_seed = ? AND settings = ? ORDER BY planner, problem",
                (*env_fingerprints, problems_seed, settings),
            ).fetchall()
        found: pd.DataFrame = pd.DataFrame(rows, columns=list(COLUMNS))
        if versions is not None:
            found = found[found["planner_version"] == found["planner"].map(versions)]
        return found

    def put_selection(self, selection: dict[str, Any]) -> None:
        """Notes what was asked for last, which is what `bench report` shows."""
        with self._lock, self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO selection VALUES (1, ?)", (json.dumps(selection),)
            )

    def selection(self) -> dict[str, Any]:
        """What was asked for last.

        Raises:
            InputError: nothing yet.
        """
        row = self._connection.execute("SELECT selection FROM selection").fetchone()
        if row is None:
            raise InputError(f"{self._file} holds no run yet")
        chosen: dict[str, Any] = json.loads(row[0])
        return chosen

    def put_session(self, run_id: str, session: dict[str, Any]) -> None:
        """Notes when, where and at what cost some records were measured."""
        with self._lock, self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO sessions VALUES (?, ?)", (run_id, json.dumps(session))
            )

    def sessions(self) -> list[dict[str, Any]]:
        """All sessions that measured something, oldest first."""
        rows = self._connection.execute("SELECT session FROM sessions ORDER BY rowid")
        return [json.loads(text) for (text,) in rows]
