"""Reports of one run in all formats: their numbers agree, to the last printed digit."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from conftest import Cli, Refused
from hypothesis import given, settings
from hypothesis import strategies as st
from in_process_worker import in_process
from records import record_of, recorded, row
from report_reader import (
    COMMON,
    Printed,
    Rows,
    Tables,
    exact_rows,
    of_html,
    of_latex,
    of_markdown,
    printed,
)

from bench import cli
from bench.analysis.run_results import RunResults
from bench.analysis.summary import columns
from bench.judging.metrics import METRICS
from bench.report import csv_table, latex, markdown, writers
from bench.report.formatting import SPREADS
from bench.report.html import overview as html_tables
from bench.storage.store import Store

NUMBER = re.compile(r"-?(?:\d+(?:\.\d+)?|inf)|-")


def assert_rounded(shown: str, exact: str, factor: int, digits: int) -> None:
    """A printed number is one of the CSV file's, rounded as Python does."""
    if exact == "":
        assert shown == "-"
        return
    assert shown == f"{factor * float(exact):.{digits}f}"
    if "inf" not in exact:
        off = abs(Decimal(shown) - factor * Decimal(exact))
        # Multiplying by 100 may itself be off, by the last bit.
        assert off <= Decimal("0.5") / 10**digits + abs(Decimal(exact)) * Decimal("1e-13")


def assert_agree(rows: Rows, exact: Rows, columns: Printed) -> None:
    """Every number in the cells of a table is one of the CSV file's, rounded."""
    for cells, numbers in zip(rows, exact, strict=True):
        assert (cells["env"], cells["planner"]) == (numbers["env"], numbers["planner"])
        for title, (factor, digits, names) in columns.items():
            # Where there is no mean, there is nothing at all.
            wanted = names[: 1 if numbers[names[0]] == "" else None]
            shown = NUMBER.findall(cells[title])
            for text, name in zip(shown, wanted, strict=True):
                assert_rounded(text, numbers[name], factor, decimals(title, numbers[name], digits))


def decimals(title: str, exact: str, digits: int) -> int:
    """Planning times have at least two digits, down to microseconds."""
    if title != "time s" or exact in ("", "inf", "-inf") or Decimal(exact) == 0:
        return digits
    return max(digits, min(6, 1 - Decimal(exact).adjusted()))


def counted(numbers: dict[str, str]) -> dict[str, str]:
    """How often each outcome was there, according to a row of the CSV file."""
    counts = {name: str(count) for name, count in json.loads(numbers["status_counts"]).items()}
    if numbers["fallbacks"]:
        counts["with fallback"] = f"{float(numbers['fallbacks']):.0f}"
    return counts


def in_html(run: RunResults) -> Tables:
    """Both tables as the page shows them."""
    success, common = (
        [dict(zip(table.titles, [cell.text for cell in line], strict=True)) for line in table.rows]
        for table in (
            html_tables.success_table(run),
            html_tables.common_table(run),
        )
    )
    return success, common


READ: dict[str, Callable[[str], Tables]] = {
    "md": of_markdown,
    "latex": of_latex,
    "html": of_html,
}

MADE: dict[str, Callable[[RunResults], Tables]] = {
    "md": lambda run: of_markdown(markdown.text(run)),
    "latex": lambda run: of_latex(latex.text(run)),
    "html": in_html,
}

names = st.text("abz09_%#&$\\^~{}|:=,-'`<>é", min_size=1, max_size=12)
numbers = st.floats(allow_nan=True, allow_infinity=True)
rates = st.fractions(0, 1, max_denominator=2000).map(float)
counts = st.dictionaries(
    st.sampled_from(["VALID", "TIMEOUT", "OUT_OF_MEMORY"]), st.integers(1, 999)
)


@st.composite
def reported(draw: st.DrawFn) -> RunResults:
    """A run with a summary of any numbers."""
    rows = draw(st.lists(st.tuples(names, names), min_size=1, max_size=3, unique=True))
    summary = []
    for env, planner in rows:
        made = {name: draw(numbers) for name in columns(METRICS)}
        made |= {name: draw(rates) for name in ("success_rate", "success_low", "success_high")}
        made |= {"env": env, "planner": planner, "problems": draw(st.integers(0, 10**9))}
        made |= {"status_counts": json.dumps(draw(counts))}
        made |= {"fallbacks": draw(st.none() | st.integers(0, 999))}
        summary.append(made)
    spread = draw(st.sampled_from(sorted(SPREADS)))
    run = replace(recorded([row("a", 0, "TIMEOUT")]), spread=spread)
    table = pd.DataFrame(summary, columns=list(columns(METRICS)))
    # What is computed once may be given instead.
    vars(run).update(summary=table, common=table)
    return run


@pytest.mark.slow
@pytest.mark.parametrize("name", MADE)
@settings(max_examples=40, deadline=None)
@given(run=reported())
def test_any_numbers_are_rounded_alike(
    name: str, run: RunResults, tmp_path_factory: pytest.TempPathFactory
) -> None:
    csv = tmp_path_factory.getbasetemp() / "summary.csv"
    csv_table.write(run, csv)
    exact = exact_rows(csv)
    success, common = MADE[name](run)
    assert_agree(success, exact, printed(run.spread))
    assert_agree(common, exact, COMMON)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small run."""
    folder = tmp_path_factory.mktemp("run")
    arguments = [
        *("run", "--env", "c3d", "--planners", "rrtconnect,rrtstar"),
        *("--problems", "3", "--stop", "limit", "--time-limit", "0.2", "--out", str(folder)),
    ]
    with in_process():
        assert cli.main(arguments) == 0
    return folder


def stored(folder: Path, env: str, *planners: str, seed: int = 0, fingerprint: str = "f") -> Path:
    """A folder with a run of one problem, made by hand."""
    measured = {"solve_s": 0.5, "length": 3.0, "safety_margin": 0.25}
    world = {"env": env, "env_fingerprint": fingerprint, "problems_seed": seed}
    rows = [row(planner, 0, "VALID", **world, **measured) for planner in planners]
    envs = [{"id": env, "fingerprint": fingerprint}]
    [selection] = recorded(rows, envs=envs, seed=seed).selections
    with Store(folder) as store:
        for values in rows:
            store.put(record_of(values))
        store.put_selection(selection)
    return folder


@pytest.mark.parametrize(("spread", "word"), [("std", "standard deviation"), ("var", "variance")])
def test_the_numbers_of_a_run_agree_in_all_formats(
    spread: str, word: str, finished: Path, bench: Cli, tmp_path: Path
) -> None:
    options = "--format", ",".join(writers.FORMATS), "--spread", word.split()[-1]
    code, out, err = bench("report", finished, *options, "--out", tmp_path)
    assert (code, err) == (0, "")
    assert f"mean ± {word} (median)" in out
    assert {path.name for path in tmp_path.iterdir()} == {f.file for f in writers.FORMATS.values()}
    exact = exact_rows(tmp_path / "summary.csv")
    assert exact == exact_rows(finished / "summary.csv")
    common = RunResults.read(finished).common.astype(str).to_dict("records")
    for name, read in READ.items():
        tables = read((tmp_path / writers.FORMATS[name].file).read_text(encoding="utf-8"))
        assert_agree(tables[0], exact, printed(spread))
        assert_agree(tables[1], common, COMMON)
        for cells, numbers in zip(tables[0], exact, strict=True):
            counts = counted(numbers)
            if name == "latex":
                counts.pop("VALID", None)
            said = dict(part.rsplit(" ", 1) for part in cells["outcomes"].split(", ") if part)
            assert said == counts


def test_the_database_has_what_the_summary_counts(
    finished: Path, bench: Cli, tmp_path: Path
) -> None:
    assert bench("report", finished, "--format", "planner-arena", "--out", tmp_path)[0] == 0
    with closing(sqlite3.connect(tmp_path / "planner_arena.db")) as connection:
        found = connection.execute(
            "SELECT name, count(*), sum(solved), avg(solution_length), avg(solution_time)"
            " FROM runs JOIN plannerConfigs ON plannerid = plannerConfigs.id GROUP BY name"
        ).fetchall()
    by_planner = {numbers["planner"]: numbers for numbers in exact_rows(finished / "summary.csv")}
    assert len(found) == 2
    for planner, problems, solved, length, time in found:
        numbers = by_planner[planner]
        assert (problems, solved) == (int(numbers["problems"]), int(numbers["solved"]))
        assert length == pytest.approx(float(numbers["length_mean"]))
        assert time == pytest.approx(float(numbers["time_s_mean"]))


def test_two_runs_become_one_report(bench: Cli, tmp_path: Path) -> None:
    a = stored(tmp_path / "a", "c3d", "p", "q")
    b = stored(tmp_path / "b", "box", "p", fingerprint="g")
    formats = "md,csv,latex,planner-arena"
    code, out, err = bench("report", a, b, "--format", formats, "--out", tmp_path / "rep")
    assert (code, err) == (0, "")
    assert not (a / "summary.md").exists()
    exact = exact_rows(tmp_path / "rep/summary.csv")
    pairs = [(numbers["env"], numbers["planner"]) for numbers in exact]
    assert pairs == [("c3d", "p"), ("c3d", "q"), ("box", "p")]
    for success, _ in (
        of_markdown(out),
        of_markdown((tmp_path / "rep/summary.md").read_text(encoding="utf-8")),
        of_latex((tmp_path / "rep/summary.tex").read_text(encoding="utf-8")),
    ):
        assert_agree(success, exact, printed("std"))
    assert "p, q in c3d: 1 problems an environment" in out
    assert "p in box: 1 problems an environment" in out
    with closing(sqlite3.connect(tmp_path / "rep/planner_arena.db")) as connection:
        experiments = connection.execute("SELECT name FROM experiments").fetchall()
    assert experiments == [("c3d",), ("box",)]


def test_without_out_each_run_has_its_own_report(bench: Cli, tmp_path: Path) -> None:
    a, b = stored(tmp_path / "a", "c3d", "p"), stored(tmp_path / "b", "c3d", "p")
    assert bench("report", a, b, "--format", "latex")[0] == 0
    assert (a / "summary.tex").read_bytes() == (b / "summary.tex").read_bytes()


def test_the_same_planner_in_the_same_environment_twice_is_refused(
    refused: Refused, tmp_path: Path
) -> None:
    a = stored(tmp_path / "a", "c3d", "p", "q")
    b = Path(shutil.copytree(a, tmp_path / "b"))
    said = refused("report", a, b, "--out", tmp_path / "rep")
    assert "both have p in c3d" in said
    assert not (tmp_path / "rep").exists()


@pytest.mark.parametrize(
    ("other", "problems"),
    [({"seed": 1}, "fingerprint f and seed 1"), ({"fingerprint": "g"}, "fingerprint g and seed 0")],
)
def test_other_problems_under_the_same_name_are_refused(
    other: dict[str, Any], problems: str, refused: Refused, tmp_path: Path
) -> None:
    a, b = stored(tmp_path / "a", "c3d", "p"), stored(tmp_path / "b", "c3d", "q", **other)
    said = refused("report", a, b, "--out", tmp_path / "rep")
    assert f"{a} has c3d with fingerprint f and seed 0, {b} with {problems}" in said
    assert not (tmp_path / "rep").exists()


@pytest.mark.parametrize("name", [name for name in writers.FORMATS if name != "html"])
def test_a_report_that_cannot_be_written_is_one_line(
    name: str, refused: Refused, tmp_path: Path
) -> None:
    run = stored(tmp_path / "run", "c3d", "p")
    in_the_way = tmp_path / "rep" / writers.FORMATS[name].file
    in_the_way.mkdir(parents=True)
    said = refused("report", run, "--format", name, "--out", tmp_path / "rep")
    assert f"cannot write the report to {tmp_path / 'rep'}" in said
    assert list((tmp_path / "rep").iterdir()) == [in_the_way]


def test_a_file_in_place_of_the_folder_is_one_line(refused: Refused, tmp_path: Path) -> None:
    run = stored(tmp_path / "run", "c3d", "p")
    (tmp_path / "rep").write_text("a file")
    assert "cannot write the report" in refused("report", run, "--out", tmp_path / "rep")
    assert (tmp_path / "rep").read_text() == "a file"
