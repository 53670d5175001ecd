"""A store's SQLite file: made, checked, brought up to date, and its faults put into words."""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from hashlib import blake2b
from pathlib import Path
from urllib.parse import quote

from bench.storage.record import COLUMNS, KEY, Verdict
from envs import InputError
from envs.errors import printable

FILE = "run.sqlite"
TABLES = {
    "records": COLUMNS,
    "sessions": ("run_id", "session"),
    "selection": ("id", "selection"),
}
"""The columns of each table, without the digest of a row, which is its last."""

_APPLICATION_ID = 0x504C4E42  # "PLNB"
_VERSION = 5
_READABLE = (1, 2, 3, 4, _VERSION)
_METRICS_OF_3 = ("length", "safety_margin", "travel_time", "smoothness", "waypoints")
"""Columns of older records whose values are among the metrics now."""

_SINCE_3 = {
    "weights": "''",
    "cpu_s": "NULL",
    "load": "NULL",
    "attempt_memory_mb": "NULL",
    "processor": "''",
}
"""Columns that records of versions 1 and 2 lack, and what stands for them."""

_SINCE_4 = {
    "repeat": "0",
    "metrics": f"metrics_of_3(verdict, solve_s, {', '.join(_METRICS_OF_3)})",
}
"""The same of version 3 and before."""

_SINCE_5 = {"scene_s": "NULL"}
"""The same of version 4 and before."""

_TABLES_OF_A_STORE = f"""
CREATE TABLE records ({", ".join(COLUMNS)}, digest, UNIQUE ({", ".join(KEY)}));
CREATE TABLE sessions (run_id PRIMARY KEY, session, digest);
CREATE TABLE selection (id INTEGER PRIMARY KEY CHECK (id = 1), selection, digest);
PRAGMA application_id = {_APPLICATION_ID};
PRAGMA user_version = {_VERSION};
"""

# In one transaction: killed in between, half of it would be taken for a stranger's file.
_SCHEMA = f"BEGIN;{_TABLES_OF_A_STORE}COMMIT;"


def digest(columns: Sequence[str]) -> str:
    """SQL for the digest of a row with these columns or values, as the database holds them."""
    return f"row_digest({', '.join(columns)})"


def _as_now(table: str, version: int) -> str:
    """SQL for an older table's columns as this version has them."""
    lacking = _lacking(version)
    return ", ".join(
        f"{lacking[column]} AS {column}" if column in lacking else column
        for column in TABLES[table]
    )


def _lacking(version: int) -> dict[str, str]:
    """The columns that records of an older version lack, and what stands for them."""
    since = ((3, _SINCE_3), (4, _SINCE_4), (5, _SINCE_5))
    return {name: sql for first, more in since if version < first for name, sql in more.items()}


def _of_version(version: int, table: str) -> tuple[str, ...]:
    """The columns of a table in a store of some version, in its order, without the digest."""
    if table != "records" or version == _VERSION:
        return TABLES[table]
    lacking = _lacking(version)
    columns: list[str] = []
    for column in COLUMNS:
        if column == "metrics" and column in lacking:  # in columns of their own then
            columns += _METRICS_OF_3
        elif column not in lacking:
            columns.append(column)
    return tuple(columns)


def _taken_over(table: str, version: int) -> str:
    columns = ", ".join(TABLES[table])
    return (
        f"INSERT INTO {table} SELECT {columns}, {digest(TABLES[table])} FROM"
        f" (SELECT {_as_now(table, version)} FROM older_{table} ORDER BY rowid);\n"
        f"DROP TABLE older_{table};\n"
    )


def _bring_up_to_date(version: int) -> str:
    """SQL that makes a store of an older version one of this."""
    return f"""
BEGIN;
{"".join(f"ALTER TABLE {table} RENAME TO older_{table};" for table in TABLES)}
{_TABLES_OF_A_STORE}
{"".join(_taken_over(table, version) for table in TABLES)}
COMMIT;
"""


def _metrics_of_3(verdict: str, solve_s: float | None, *values: float | None) -> str:
    """What `_SINCE_4` says of a record that has some metrics in columns."""
    known = dict(zip(_METRICS_OF_3, values, strict=True))
    if verdict == Verdict.VALID.value:
        return json.dumps({"time_s": solve_s, **known})
    return json.dumps({name: value for name, value in known.items() if value is not None})


def opened_to_write(folder: Path) -> sqlite3.Connection:
    """The store of a folder, both made if missing; an older version's becomes one of this.

    Raises:
        InputError: the folder cannot be used, or the file there is not a store, or is damaged.
    """
    file = folder / FILE
    with in_words(file):
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise InputError(f"{folder} is read-only; choose another --out")
        return _checked(_connected(file, "rwc"), file, _make_ready)


def opened_to_read(folder: Path) -> sqlite3.Connection:
    """The store of a folder, of which nothing is changed; the folder may be read-only.

    Raises:
        InputError: there is none, or it is damaged.
    """
    file = folder / FILE
    if not file.is_file():
        raise InputError(f"{folder} holds no {FILE}; name a folder that `bench run` wrote")
    with in_words(file):
        return _checked(_connected(file, _reading(file)), file, _make_readable)


@contextmanager
def in_words(file: Path) -> Iterator[None]:
    """Says in a line what is wrong with a store's file, or with the disk it is on.

    Raises:
        InputError: in place of SQLite's and the system's errors.
    """
    try:
        yield
    except sqlite3.Error as error:
        raise InputError(_said(file, str(error))) from error
    except OSError as error:
        raise InputError(f"cannot use {file} as a store: {error}") from error


def _said(file: Path, error: str) -> str:
    if "full" in error or "I/O" in error:
        return (
            f"cannot write to {file}: {error}; make room and give the same command again: "
            "what was finished is kept"
        )
    if "malformed" in error:
        return _damaged(file, error)
    return f"cannot use {file} as a store: {error}"


def _damaged(file: Path, what: str) -> str:
    return f"{file} is damaged: {what}; put a copy of it back, or choose another folder"


def _reading(file: Path) -> str:
    """How SQLite is to open a store to read it. Beside a store of this kind it makes small files,
    which a read-only folder does not let it; without them it must know that nobody writes."""
    with closing(_connected(file, "rw")) as connection:
        try:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
            return "rw"
        except sqlite3.OperationalError:
            waiting = file.with_name(f"{FILE}-wal")
            if waiting.is_file() and waiting.stat().st_size:
                raise InputError(
                    f"{file} ends in {waiting.name}, which cannot be read in a read-only folder; "
                    "copy the folder to where you may write"
                ) from None
            return "ro&immutable=1"


def _connected(file: Path, mode: str) -> sqlite3.Connection:
    if file.is_file() and file.stat().st_size:
        _check_magic(file)
    # Threads take turns, see `bench.storage.store`.
    uri = f"file:{quote(bytes(file.absolute()))}?mode={mode}"
    connection = sqlite3.connect(uri, uri=True, check_same_thread=False, timeout=30)
    connection.create_function("row_digest", -1, row_digest, deterministic=True)
    connection.create_function("metrics_of_3", -1, _metrics_of_3, deterministic=True)
    connection.execute("PRAGMA trusted_schema = OFF")  # a stranger's file calls no functions
    return connection


def row_digest(*values: float | str | bytes | None) -> str:
    """What `digest` computes in the database."""
    return blake2b(repr(values).encode(), digest_size=8).hexdigest()


def _check_magic(file: Path) -> None:
    """SQLite itself would take a file of a few bytes for an empty database."""
    with file.open("rb") as opened:
        if not opened.read(16).startswith(b"SQLite format 3\0"):
            raise InputError(f"cannot use {file} as a store: it is another kind of file")


def _checked(
    connection: sqlite3.Connection,
    file: Path,
    prepare: Callable[[sqlite3.Connection, Path], None],
) -> sqlite3.Connection:
    """The connection, if the file is a store and whole; else it is closed."""
    try:
        prepare(connection, file)
    except BaseException:
        connection.close()
        raise
    return connection


def _make_ready(connection: sqlite3.Connection, file: Path) -> None:
    version = _version(connection, file)
    if version is None:
        connection.executescript(_SCHEMA)
    else:
        _check(connection, file, version)
        if version < _VERSION:
            connection.executescript(_bring_up_to_date(version))
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")


def _make_readable(connection: sqlite3.Connection, file: Path) -> None:
    version = _version(connection, file)
    if version is None:
        raise InputError(f"{file} holds no run yet")
    _check(connection, file, version)
    if version < _VERSION:
        # In this connection only: the file is not changed.
        connection.execute("PRAGMA temp_store = MEMORY")
        connection.execute(
            f"CREATE TEMP VIEW records AS SELECT {_as_now('records', version)} FROM main.records"
        )


def _version(connection: sqlite3.Connection, file: Path) -> int | None:
    """Of a store; None for a database in which nothing was made yet."""
    [tables] = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if tables == 0:
        return None
    [application] = connection.execute("PRAGMA application_id").fetchone()
    if application != _APPLICATION_ID:
        raise InputError(f"{file} is not a store of this program; choose another folder")
    _check_contents(connection, file)
    version: int
    [version] = connection.execute("PRAGMA user_version").fetchone()
    if version not in _READABLE:
        raise InputError(
            f"{file} is a store of version {version}, this program knows {_READABLE[0]} to "
            f"{_READABLE[-1]}; use the program that made it, or choose another folder"
        )
    return version


def _check_contents(connection: sqlite3.Connection, file: Path) -> None:
    """Refuses what would act by itself when rows are read or put: triggers, views and the like. A
    store holds its tables and SQLite's own indices of them."""
    for kind, name, sql in connection.execute("SELECT type, name, sql FROM sqlite_master"):
        of_a_store = name in TABLES and str(sql).upper().startswith("CREATE TABLE")
        if not (of_a_store if kind == "table" else kind == "index" and sql is None):
            raise InputError(
                f"{file} holds {printable(f'{kind} {name!r}')}, which is none of a store's: "
                "do not use it, or remove that"
            )


def _check(connection: sqlite3.Connection, file: Path, version: int) -> None:
    """Raises InputError if the store is damaged, as far as its version lets one see that."""
    _check_pages(connection, file)
    if version > 1:
        _check_rows(connection, file, version)


def _check_pages(connection: sqlite3.Connection, file: Path) -> None:
    """SQLite's own look at all pages and indices."""
    found = [text for (text,) in connection.execute("PRAGMA integrity_check(1)")]
    if found != ["ok"]:
        raise InputError(_damaged(file, " ".join(found[0].split())))


def _check_rows(connection: sqlite3.Connection, file: Path, version: int) -> None:
    """What the pages hold is what was put there, which SQLite does not check."""
    for table in TABLES:
        held = digest(_of_version(version, table))
        [wrong] = connection.execute(
            f"SELECT count(*) FROM {table} WHERE digest IS NOT {held}"
        ).fetchone()
        if wrong:
            raise InputError(_damaged(file, f"{wrong} of its {table} are not what was stored"))
