"""Tables on terminals that are narrower than they are."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Cli
from hypothesis import given
from hypothesis import strategies as st
from in_process_worker import in_process

from bench.cli.terminal import fitted
from bench.report import markdown

ROWS = [
    {"env": "c3d", "planner": r"a|b", "n": "3", "length": "1.00", "margin": "0.10"},
    {"env": "c3d", "planner": "p", "n": "12", "length": "-", "margin": "-"},
]
TABLE = markdown.table(ROWS)


def test_what_has_room_is_left_as_it_is() -> None:
    text = f"Before.\n\n{TABLE}\n\nAfter | this."
    assert fitted(text, len(TABLE.split("\n")[0])) == text
    assert fitted("no table", 1) == "no table"


def test_columns_are_left_out_from_the_right_and_named_below() -> None:
    lines = fitted(f"{TABLE}\n\nAfter.", 27).split("\n")
    assert lines[0] == "| env   | planner   |   n |"
    assert r"a\|b" in lines[2], "a cell with a bar in it is one cell"
    assert all(len(line) <= 27 for line in lines[:4])
    assert lines[4:] == [
        *("", "Not shown, as the terminal is narrow (--wide): length, margin.", "", "After.")
    ]


def test_the_verdict_is_kept() -> None:
    table = markdown.table([{**ROWS[1], "verdict": "better"}])
    shown = fitted(table, 20).split("\n")
    assert shown[0].split() == ["|", "env", "|", "planner", "|", "verdict", "|"]
    assert shown[-1].endswith("n, length, margin.")


@given(st.integers(1, 200))
def test_no_line_is_longer_than_it_must_be(width: int) -> None:
    shown = fitted(TABLE, width).split("\n")
    least = len(fitted(TABLE, 1).split("\n")[0])
    assert len(shown[0]) <= max(width, least)
    assert len({len(line) for line in shown[:4]}) == 1


@pytest.fixture
def folder(bench: Cli, tmp_path: Path) -> Path:
    made = tmp_path / "run"
    command = ("--env", "c3d", "--planners", "straight-line", "--problems", 1, "--stop", "first")
    with in_process():
        assert bench("run", *command, "--out", made)[0] == 0
    return made


def printed(columns: int, *arguments: object) -> str:
    """What a command prints on a terminal of so many columns."""
    ours, theirs = pty.openpty()
    done = subprocess.Popen(
        [sys.executable, "-m", "bench", *map(str, arguments)],
        stdout=theirs,
        env={**os.environ, "COLUMNS": str(columns)},
    )
    os.close(theirs)
    text = b""
    while True:
        try:
            more = os.read(ours, 4096)
        except OSError:  # Linux says so that nobody writes any more
            break
        if not more:
            break
        text += more
    os.close(ours)
    assert done.wait() == 0
    return text.decode().replace("\r\n", "\n")


@pytest.mark.slow
def test_a_narrow_terminal_gets_fewer_columns_and_wide_all(folder: Path) -> None:
    narrow = printed(80, "report", folder)
    tables = [line for line in narrow.split("\n") if line.startswith("|")]
    assert max(map(len, tables)) <= 80
    assert "Not shown, as the terminal is narrow (--wide): " in narrow
    wide = printed(80, "report", folder, "--wide")
    assert "Not shown" not in wide
    assert "outcomes" in wide
    assert "outcomes" in (folder / "summary.md").read_text(), "files have all"
