"""Planners with several values of a parameter: entries, and charts over the parameter."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import Cli, records_of
from hypothesis import given
from hypothesis import strategies as st

import envs
import planners
from bench.analysis.run_results import RunResults
from bench.analysis.sweeps import sweeps
from bench.report.html.problems import problem_sets_of
from bench.report.html.sweeps import sweep_charts
from envs.registry.arguments import alternatives, argument_text, split_entries


@pytest.mark.parametrize(
    ("text", "ids"),
    [
        ("rrtstar:range=0.5|1|2", ["rrtstar:range=0.5", "rrtstar:range=1", "rrtstar:range=2"]),
        ("fmm,rrtstar:range=2|2", ["fmm", "rrtstar:range=2"]),
        (
            "rrtstar:range=1|2,goal_bias=0.1|0.2",
            [
                *("rrtstar:goal_bias=0.1,range=1", "rrtstar:goal_bias=0.2,range=1"),
                *("rrtstar:goal_bias=0.1,range=2", "rrtstar:goal_bias=0.2,range=2"),
            ],
        ),
    ],
)
def test_values_between_bars_are_entries(text: str, ids: list[str]) -> None:
    assert [entry.id for entry in planners.REGISTRY.entries(text)] == ids


def test_environments_have_them_too() -> None:
    ids = [entry.id for entry in envs.REGISTRY.entries("c3d:scene=1|2,box")]
    assert ids == ["c3d:scene=1", "c3d:scene=2", "box"]


def test_a_bar_in_quotes_is_a_character() -> None:
    assert alternatives('mesh:file="a|b.obj"') == ['mesh:file="a|b.obj"']
    [entry] = envs.REGISTRY.entries('mesh:file="a|b.obj"')
    assert entry.arguments["file"] == "a|b.obj"
    assert [one.id for one in envs.REGISTRY.entries(entry.id)] == [entry.id]


@given(st.dictionaries(st.sampled_from("ab"), st.text(st.characters(codec="ascii"), min_size=1)))
def test_what_is_written_is_one_entry(values: dict[str, str]) -> None:
    text = f"name:{argument_text(values)}" if values else "name"
    assert split_entries(text) == [text]
    assert alternatives(text) == [text]


def test_a_value_that_is_none_is_refused(bench: Cli) -> None:
    code, _, err = bench("run", "--env", "box", "--planners", "rrtstar:range=1|x")
    assert code == 2
    assert "refuses range=x" in err
    code, _, err = bench("run", "--env", "box", "--planners", "rrtstar:range=1|")
    assert code == 2
    assert "key=value" in err


def test_sweeps_are_over_numbers_with_all_else_equal() -> None:
    ids = [
        *("rrtstar:range=2", "fmm", "rrtstar:range=0.5", "rrtstar", "rrtconnect:simplify=True"),
        *("rrtstar:goal_bias=0.1,range=1", "rrtstar:goal_bias=0.1,range=3", "rrtconnect"),
        *("gone:x=1", "gone:x=2"),
    ]
    found = sweeps(ids)
    assert [sweep.title for sweep in found] == [
        "rrtstar over range",
        "rrtstar:goal_bias=0.1 over range",
    ]
    assert found[0].values == ((0.5, "rrtstar:range=0.5"), (2, "rrtstar:range=2"))


@pytest.mark.usefixtures("in_process_workers")
def test_the_report_has_charts_over_the_parameter(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "box", "--planners", "rrtconnect:range=1|4|16", "--problems", 3)
    assert bench(*run, "--stop", "first", "--out", tmp_path)[0] == 0
    results, rows = RunResults.read(tmp_path), records_of(tmp_path)
    [problem_set] = problem_sets_of(results)
    numbers = {name: number for number, name in enumerate(problem_set.planners)}
    charts = {one["axis"]: one for one in sweep_charts(problem_set, numbers, results.metrics)}
    assert {"share solved", "length units", "time s"} <= charts.keys()
    success, length = charts["share solved"], charts["length units"]
    assert success["title"] == "rrtconnect over range"
    assert success["x"] == length["x"] == [1, 4, 16]
    assert success["y"] == [1, 1, 1]
    assert all(low < 1 for low in success["low"])
    median = rows.groupby("planner")["length"].median()
    for value, middle in zip((1, 4, 16), length["y"], strict=True):
        assert middle == pytest.approx(median[f"rrtconnect:range={value}"], rel=1e-4)
    assert charts["time s"]["log"]
    assert bench("report", tmp_path, "--format", "html")[0] == 0
    page = (tmp_path / "report.html").read_text()
    assert page.count('data-chart="sweep"') == len(charts)
