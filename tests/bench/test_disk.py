"""Disks that fail: a full one, and folders that may be read only. Nothing is lost, and a line says
what to do."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO

import pytest
from conftest import Cli, records_of

from bench.storage.store import Store

SAME = ["problem", "status", "verdict", "outcome", "length", "path"]
_NAMESPACE = ("unshare", "--user", "--map-root-user", "--mount", "sh", "-euc")
_HAS_NAMESPACES = (
    shutil.which("unshare") is not None
    and subprocess.run([*_NAMESPACE, "true"], capture_output=True, check=False).returncode == 0
)
mounts = pytest.mark.skipif(not _HAS_NAMESPACES, reason="needs to mount file systems")


def run(folder: Path, problems: int) -> list[str]:
    return [
        *("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", str(problems)),
        *("--stop", "first", "--seed", "3", "--out", str(folder)),
    ]


def mounted(script: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """A shell script that may mount; `"$bench"` is the command line, `$1` the first argument."""
    shell = [*_NAMESPACE, f'bench() {{ "{sys.executable}" -m bench "$@"; }}\n{script}', "sh"]
    return subprocess.run(
        [*shell, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=120
    )


def one_line(stderr: str) -> str:
    """The only error, which is no traceback."""
    assert "Traceback" not in stderr
    [line] = [line for line in stderr.splitlines() if line.startswith("bench: error: ")]
    return line


@contextmanager
def no_room_after(folder: Path, pages: int) -> Iterator[None]:
    """A store whose file may not grow beyond some more pages; SQLite says what it says of a full
    disk."""
    true = sqlite3.connect

    def limited(*arguments: object, **named: object) -> sqlite3.Connection:
        connection = true(*arguments, **named)  # type: ignore[call-overload]
        [(held,)] = connection.execute("PRAGMA page_count").fetchall()
        connection.execute(f"PRAGMA max_page_count = {held + pages}")
        return connection

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sqlite3, "connect", limited)
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_store_without_room_keeps_what_it_has_and_goes_on_later(
    bench: Cli, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    assert bench(*run(folder, 2))[0] == 0
    before = records_of(folder)
    with no_room_after(folder, 4):
        code, _, err = bench(*run(folder, 60))
    assert code == 2
    assert "make room and give the same command again: what was finished is kept" in one_line(err)
    with closing(sqlite3.connect(folder / "run.sqlite")) as store:
        [(held,)] = store.execute("SELECT count(*) FROM records").fetchall()
    assert 2 < held < 60
    assert bench(*run(folder, 60))[0] == 0
    after = records_of(folder)
    assert after["measured_at"][:2].tolist() == before["measured_at"].tolist()
    assert bench(*run(tmp_path / "whole", 60))[0] == 0
    assert after[SAME].equals(records_of(tmp_path / "whole")[SAME])


@pytest.mark.slow
@mounts
@pytest.mark.parametrize("size_kb", [4, 60, 200])
def test_a_full_disk_stops_a_run_in_one_line(tmp_path: Path, size_kb: int) -> None:
    done = mounted(
        f"""
        mount -t tmpfs -o size={size_kb}k tmpfs "$1"
        bench {" ".join(run(tmp_path / "small" / "run", 1000))} && exit 99
        code=$?
        cp -r "$1"/. "$2"
        exit $code
        """,
        made(tmp_path / "small"),
        made(tmp_path / "kept"),
    )
    assert done.returncode == 2, done.stderr
    assert "No space left" in one_line(done.stderr) or "is full" in one_line(done.stderr)
    files = [file.name for file in (tmp_path / "kept").rglob("*") if file.is_file()]
    assert not [name for name in files if "part" in name]
    if size_kb == 200:
        with closing(sqlite3.connect(tmp_path / "kept" / "run" / "run.sqlite")) as store:
            assert store.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert store.execute("SELECT count(*) FROM records").fetchone()[0] > 0


@pytest.mark.slow
@mounts
def test_a_read_only_folder_can_be_reported_but_not_added_to(bench: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    assert bench(*run(folder, 2))[0] == 0
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    locked = 'mount --bind "$1" "$1"; mount -o remount,bind,ro "$1";'
    asked = [
        (" ".join(run(folder, 3)), 2),
        (f"report {folder}", 2),
        (f"report {folder} --out {tmp_path / 'report'}", 0),
        (f"replay {folder} --planner rrtconnect --problem 1", 0),
    ]
    for command, expected in asked:
        done = mounted(f"{locked} bench {command}", folder)
        assert done.returncode == expected, done.stderr
        if expected:
            assert "ead-only" in one_line(done.stderr)
    assert (tmp_path / "report" / "summary.md").read_bytes() == before["summary.md"]
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.slow
@mounts
def test_a_killed_run_in_a_read_only_folder_is_not_read_in_part(bench: Cli, tmp_path: Path) -> None:
    folder, copy = tmp_path / "run", made(tmp_path / "copy")
    assert bench(*run(folder, 2))[0] == 0
    with Store(folder) as store:
        store.put_session("of another", {"run_id": "of another"})
        for name in ("run.sqlite", "run.sqlite-wal"):  # as a process leaves them that is killed
            shutil.copy(folder / name, copy / name)
    done = mounted(
        f'mount --bind "$1" "$1"; mount -o remount,bind,ro "$1"; bench compare {copy} {copy}', copy
    )
    assert done.returncode == 2
    assert "copy the folder to where you may write" in one_line(done.stderr)
    assert bench("report", copy)[0] == 0, "a folder that may be written to is read whole"


def made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def listing(output: IO[str]) -> subprocess.CompletedProcess[str]:
    """`bench list`, which cannot write to its output."""
    return subprocess.run(
        [sys.executable, "-m", "bench", "list"],
        stdout=output,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_table_that_cannot_be_printed_is_said_not_to_be() -> None:
    with Path("/dev/full").open("w") as full:
        done = listing(full)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "No space left" in one_line(done.stderr)


def test_a_reader_that_has_gone_has_seen_enough() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        done = listing(pipe)
    assert (done.returncode, done.stderr) == (141, ""), "as of programs that SIGPIPE ends"
