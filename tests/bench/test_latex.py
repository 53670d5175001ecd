"""Tables in LaTeX: what they say, and that LaTeX takes them."""

from __future__ import annotations

import re
import shutil
import subprocess
import unicodedata
from collections.abc import Callable
from pathlib import Path

import pytest
import tex_reader
from hypothesis import given
from hypothesis import strategies as st
from records import recorded, row

from bench.report import formatting, latex

PDFLATEX = shutil.which("pdflatex")


def compiled(test: Callable[..., None]) -> Callable[..., None]:
    """Marks a test that runs LaTeX."""
    return pytest.mark.latex(pytest.mark.skipif(PDFLATEX is None, reason="no pdflatex here")(test))


SPECIAL = r"""#$%&_{}\^~<>|`'"-- ---/:=,.;!?()[]@*+ ?` !` '' `` <<>> ,, fi"""
"""All of ASCII that means something to LaTeX, ligatures included."""

MEASURED = {"solve_s": 1.25, "length": 10.0, "safety_margin": 0.5}

ROWS = [
    row("rrtstar", 0, "VALID", **MEASURED, stats='{"fallbacks": 1}'),
    row("rrtstar", 1, "OUT_OF_MEMORY", solve_s=2.0),
    row("lazyprmstar:roadmap_s=10", 0, "VALID", **MEASURED),
    row("lazyprmstar:roadmap_s=10", 1, "VALID", **{**MEASURED, "solve_s": 3.0}),
    row("rrtstar", 0, "TIMEOUT", solve_s=5.0, env="mesh:file=a_b.ply,robot_radius=0.1"),
]


def compile_(tables: str, folder: Path) -> str:
    """Makes a PDF; what LaTeX has to say."""
    assert PDFLATEX is not None
    (folder / "paper.tex").write_text(latex.document(tables), encoding="ascii")
    command = [PDFLATEX, "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert (folder / "paper.pdf").stat().st_size > 1000
    log = (folder / "paper.log").read_text(encoding="latin-1")
    assert "Missing character" not in log
    return log


def overfull_points(log: str) -> float:
    """By how much the widest line sticks out."""
    found = re.findall(r"Overfull \\hbox \(([\d.]+)pt", log)
    return max(map(float, found), default=0.0)


def test_the_tables_say_what_the_cells_say() -> None:
    run = recorded(ROWS)
    tables = tex_reader.tables(latex.text(run))
    expected = formatting.success_rows(run)
    for cell in expected:
        del cell["outcomes"]
    assert tables == {
        "success": expected,
        "common": formatting.common_rows(run),
    }


def test_outcomes_other_than_success_are_told_below() -> None:
    [note] = re.findall(r"\\raggedright (.*)\}\n", latex.text(recorded(ROWS)))
    said = tex_reader.plain(note)
    assert "rrtstar in c3d: OUT_OF_MEMORY 1, with fallback 1." in said
    assert "rrtstar in mesh:file=a_b.ply,robot_radius=0.1: TIMEOUT 1." in said
    assert "lazyprmstar" not in said, "all went well"
    assert "95 % Wilson interval" in said


def test_captions_are_those_of_the_run() -> None:
    settings = {"time_limit_s": 5.0, "stop": "match:a_b:0.05", "jobs": 1}
    run = recorded(ROWS, settings=settings)
    caption, common = re.findall(r"\\caption\{(.*)\}\n", latex.text(run))
    assert tex_reader.plain(caption).endswith(run.caption.replace("`", ""))
    assert r"\texttt{match:\allowbreak{}a\_\allowbreak{}b:0.05}" in caption
    assert "every planner solved" in common
    left_out = "rrtstar in mesh:file=a_b.ply,robot_radius=0.1 (0 solved)"
    assert left_out in tex_reader.plain(common)


BLANK = ("success %", "length units", "time s", "offline s")


def test_a_table_without_rows_is_left_out() -> None:
    tex = latex.text(recorded([row("a", 0, "UNSUPPORTED", error="no weights_of it.\nMore.")]))
    assert list(tex_reader.tables(tex)) == ["success"]
    [cells_] = tex_reader.tables(tex)["success"]
    assert {cells_[title] for title in ("success %", "length units", "time s", "offline s")} == {
        "-"
    }
    [note] = re.findall(r"\\raggedright (.*)\}\n", tex)
    assert "a in c3d: UNSUPPORTED 1: no weights_of it." in tex_reader.plain(note)


def test_numbers_below_zero_have_a_minus() -> None:
    rows = [row("a", 0, "VALID", **{**MEASURED, "safety_margin": -0.5})]
    tex = latex.text(recorded(rows))
    assert r"$-$0.50 $\pm$ -- ($-$0.50)" in tex


@given(st.text())
def test_every_name_can_be_read_back(name: str) -> None:
    tex = latex.name(name)
    assert tex.isascii()
    assert tex_reader.plain(tex) == unicodedata.normalize("NFC", name)


@given(st.text(alphabet="#$%&_{}\\^~<>|`'\"-±é/:=, a"))
def test_every_text_can_be_read_back(text: str) -> None:
    assert tex_reader.plain(latex.escaped(text)) == text


@compiled
def test_both_tables_compile_within_the_page(tmp_path: Path) -> None:
    log = compile_(latex.text(recorded(ROWS)), tmp_path)
    assert overfull_points(log) < 3
    assert "undefined" not in log


@compiled
def test_names_with_every_special_character_compile(tmp_path: Path) -> None:
    accented = "àéîõūŏżëåűřçÄŒøßñ 中 \N{GRINNING FACE} \t"
    rows = [
        row(SPECIAL, 0, "VALID", **MEASURED, env=accented),
        row("\\input{x}", 0, "TIMEOUT", solve_s=5.0, env="100%_sure & more"),
    ]
    settings = {"time_limit_s": 5.0, "stop": f"match:{SPECIAL.replace('`', '')}", "jobs": 1}
    assert overfull_points(compile_(latex.text(recorded(rows, settings=settings)), tmp_path)) < 3


@compiled
def test_long_names_stay_within_the_page(tmp_path: Path) -> None:
    env = "mesh:file=/somewhere/very/far/away/in/a/deep/folder/of/many/scans/room_of_all.ply"
    census = {"blocked_percent": 63.0}
    rows = [
        row("lazyprmstar:roadmap_s=10,range=2,goal_bias=0.05", p, "TIMEOUT", env=env, solve_s=5.0)
        for p in range(3)
    ]
    run = recorded(rows, envs=[{"id": env, "fingerprint": "f", "census": census}])
    assert overfull_points(compile_(latex.text(run), tmp_path)) < 3
