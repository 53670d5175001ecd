"""Records on disk: SQLite in `DIR/run.sqlite`, one transaction a row, one run at a time in it.

A transaction is the system's when it is committed, so that nothing of it is lost by whatever ends
this process. That it is on the disk, for the case that the machine loses its power, costs a hundred
times as much, and is seen to for all rows together every now and then.
"""

from __future__ import annotations

import fcntl
import json
import math
import os
import sqlite3
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, TypeVar

import pandas as pd

from bench.storage.record import COLUMNS, KEY, Fault, Record, with_metrics
from bench.storage.store_file import FILE, TABLES, digest, in_words, opened_to_read, opened_to_write
from envs import InputError

S = TypeVar("S", bound="StoredRecords")

FORCED_EVERY_S = 1.0
"""How much of a run, in seconds, the machine may take with it at most when it loses its power."""

_KEY_OF_SKIPPED = tuple(column for column in KEY if column != "weights")
_DROP_SKIPPED = (
    f"DELETE FROM records WHERE {' AND '.join(f'{column} = ?' for column in _KEY_OF_SKIPPED)}"
    " AND status = ?"
)


class StoredRecords:
    """The records of a folder, to be read; nothing in it is changed. All methods are safe to use
    from several threads, and raise `InputError`, in one line, if file or disk fail them.

    Raises:
        InputError: the folder has no store, or not one of this program's, or a damaged one.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE
        self._lock = threading.Lock()
        self._connection = self._opened(folder)

    def _opened(self, folder: Path) -> sqlite3.Connection:
        return opened_to_read(folder)

    @property
    def folder(self) -> Path:
        """That they are in."""
        return self._file.parent

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        tb: TracebackType | None,
    ) -> None:
        self._connection.close()

    def records(
        self,
        env_fingerprints: Sequence[str],
        problems_seed: int,
        settings: str,
        versions: Mapping[str, int] | None = None,
        weights: Mapping[str, Mapping[str, str]] | None = None,
    ) -> pd.DataFrame:
        """All records of some environments, a seed and a digest of settings, in order, with a
        column for each metric that any of them has a value of (`with_metrics`).

        Args:
            versions: of planners; what others or other versions of them did is left out. By
                default nothing is.
            weights: their digests by fingerprint and planner, "" where none is given; what was done
                with others is left out. By default nothing is.
        """
        marks = ", ".join("?" * len(env_fingerprints))
        rows = self._rows(
            f"SELECT {', '.join(COLUMNS)} FROM records WHERE env_fingerprint IN ({marks})"
            " AND problems_seed = ? AND settings = ? ORDER BY planner, problem, repeat, weights",
            (*env_fingerprints, problems_seed, settings),
        )
        found: pd.DataFrame = pd.DataFrame(rows, columns=list(COLUMNS))
        if versions is not None:
            found = found[found["planner_version"] == found["planner"].map(versions)]
        if weights is not None:
            whose = zip(found["env_fingerprint"], found["planner"], strict=True)
            wanted = [weights.get(env, {}).get(planner, "") for env, planner in whose]
            found = found[found["weights"] == wanted]
        return with_metrics(found)

    def selection(self) -> dict[str, Any]:
        """What was asked for last.

        Raises:
            InputError: nothing yet.
        """
        rows = self._rows("SELECT selection FROM selection")
        if not rows:
            raise InputError(f"{self._file} holds no run yet")
        chosen: dict[str, Any] = json.loads(rows[0][0])
        return chosen

    def sessions(self) -> list[dict[str, Any]]:
        """All sessions that measured something, oldest first."""
        rows = self._rows("SELECT session FROM sessions ORDER BY rowid")
        return [json.loads(text) for (text,) in rows]

    def _rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        with self._lock, in_words(self._file):
            return self._connection.execute(query, values).fetchall()


class Store(StoredRecords):
    """The records of a folder, which is made if missing, to be read and added to."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._forced = -math.inf

    def _opened(self, folder: Path) -> sqlite3.Connection:
        return opened_to_write(folder)

    def put(self, record: Record) -> None:
        """Adds a record at once, in place of one with the same key, or of one that says that there
        were no weights to attempt it with. Whatever ends this process, it is there; see
        `FORCED_EVERY_S`."""
        forced = monotonic() >= self._forced + FORCED_EVERY_S
        skipped = [getattr(record, column) for column in _KEY_OF_SKIPPED] + [Fault.SKIPPED.value]
        self._put("records", astuple(record), (_DROP_SKIPPED, skipped), forced=forced)

    def add_metrics(self, metrics: Sequence[tuple[Sequence[Any], str]]) -> None:
        """Replaces the metrics of records, by their keys, in one transaction."""
        where = " AND ".join(f"{column} = ?" for column in KEY)
        columns = digest(TABLES["records"])
        with self._lock, in_words(self._file), self._connection:
            for key, text in metrics:
                for change, values in (("metrics = ?", [text]), (f"digest = {columns}", [])):
                    statement = f"UPDATE records SET {change} WHERE {where}"
                    self._connection.execute(statement, [*values, *key])

    def put_selection(self, selection: dict[str, Any]) -> None:
        """Notes what was asked for last, which is what `bench report` shows."""
        self._put("selection", (1, json.dumps(selection)))

    def put_session(self, run_id: str, session: dict[str, Any]) -> None:
        """Notes when, where and at what cost some records were measured."""
        self._put("sessions", (run_id, json.dumps(session)))

    def _put(
        self,
        table: str,
        values: Sequence[Any],
        *before: tuple[str, Sequence[Any]],
        forced: bool = True,
    ) -> None:
        """Adds a row, in one transaction with what must be done before it: statements with their
        values. `forced` sees to it that it is on the disk, with all that came earlier."""
        marks = [f"?{i + 1}" for i in range(len(TABLES[table]))]
        with self._lock, in_words(self._file):
            # FULL writes out the whole log, whose end alone NORMAL would leave to the system.
            self._connection.execute(f"PRAGMA synchronous = {'FULL' if forced else 'NORMAL'}")
            with self._connection:
                for statement, bound in before:
                    self._connection.execute(statement, bound)
                self._connection.execute(
                    f"INSERT OR REPLACE INTO {table} VALUES ({', '.join(marks)}, {digest(marks)})",
                    values,
                )
            if forced:
                self._forced = monotonic()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Holds a folder, which is made if missing, for one run. However the process ends, the lock
    ends with it: it is the system's, on the folder itself, and leaves nothing behind.

    Raises:
        InputError: another run holds it, or it cannot be used.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise InputError(f"cannot use {folder} for a run: {error}") from error
    try:
        _lock(held, folder)
        yield
    finally:
        os.close(held)


def _lock(held: int, folder: Path) -> None:
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"another run is writing to {folder}; wait until it ends, or choose another --out"
        ) from None
    except OSError as error:
        raise InputError(f"{folder} cannot be locked for a run: {error}") from error
