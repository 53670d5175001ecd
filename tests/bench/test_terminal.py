"""What is printed of names and messages of strangers, and on terminals that cannot show it."""

from __future__ import annotations

import io
import logging
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Cli

from bench.cli import app, terminal

FILE = """
from planners import Planner


class Painted(Planner):
    description = "\\x1b]0;owned\\x07 \\x1b[31mred \\u202eback\\nnext line, ± 3 μm"

    def solve(self, problem, budget):
        raise ValueError("no")
"""

ESCAPES = ("\x1b", "\x07", "\u202e", "\x9b", "\r", "\udcff")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "painted.py"
    made.write_text(FILE, encoding="utf-8")
    return made


def test_descriptions_of_strangers_are_listed_in_one_line_without_escapes(
    bench: Cli, file: Path
) -> None:
    code, out, err = bench("list", "planners", "--planner-file", file)
    assert code == 0, err
    [line] = [line for line in out.splitlines() if line.startswith("  painted ")]
    assert line.endswith(r"\x1b]0;owned\x07 \x1b[31mred \u202eback\nnext line, ± 3 μm")
    assert not any(escape in out + err for escape in ESCAPES)
    code, out, _ = bench("list", "planners", "--json", "--planner-file", file)
    assert "\x1b" not in out


@pytest.mark.parametrize("how", [terminal.tell, terminal.note])
def test_lines_are_kept_and_escapes_are_not(
    how: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    how("a\nb " + "".join(ESCAPES) + " 部屋 é\n")
    assert "".join(capsys.readouterr()) == "a\nb \\x1b\\x07\\u202e\\x9b\\r\\udcff 部屋 é\n\n"


def test_log_lines_too(capfd: pytest.CaptureFixture[str]) -> None:
    terminal.prepare()
    logging.getLogger("bench").info("mesh \x1b[2J%s", "\x07")
    assert capfd.readouterr().err == "mesh \\x1b[2J\\x07\n"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_characters_that_the_terminal_lacks_are_spelt_out(
    encoding: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    assert app.main(["list", "planners", "--planner-file", str(file)]) == 0
    line = raw.getvalue().decode(encoding)
    assert ("± 3 μm" if encoding == "utf-8" else r" 3 \u03bcm") in line
    assert app.main(["report", "--help"]) == 0
    sys.stdout.flush()
    assert "after each mean" in raw.getvalue().decode(encoding)


def test_a_stream_that_is_no_file_will_do(monkeypatch: pytest.MonkeyPatch) -> None:
    class Window:
        text = ""

        def write(self, text: str) -> None:
            self.text += text

        def flush(self) -> None:
            pass

    window = Window()
    monkeypatch.setattr(sys, "stdout", window)
    assert app.main(["list", "envs"]) == 0
    assert "c3d" in window.text


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "--env", "mesh:file=caf\udce9.obj"),
        ("run", "--env", "c3d", "--planners", "ntfields:weights='a,caf\udce9'"),
        ("show", "--env", "arm:urdf=caf\udce9.urdf", "--out", "x.png"),
    ],
)
def test_names_in_ids_that_are_not_text_are_refused_in_one_line(
    arguments: tuple[str, ...], bench: Cli
) -> None:
    code, _, err = bench(*arguments)
    assert code == 2
    assert err.count("\n") == 1
    assert "not UTF-8" in err
    assert r"caf\udce9" in err
