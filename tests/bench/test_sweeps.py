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
from bench.report.html.sweeps import difficulty_charts, sweep_charts
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
    found = sweeps(ids)  # "rrtstar" itself has OMPL's range, which depends on where it plans
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


def test_environments_are_swept_as_planners_are() -> None:
    """Ten boxes are the default, which names leave out. Scenes are no numbers, but names."""
    ids = ["c3d:boxes=30", "c3d", "c3d:scene=2", "c3d:scene=3", "box", "box:side=2", "gone:x=1"]
    boxes, side = sweeps(ids, envs.REGISTRY)
    assert boxes.title == "c3d over boxes"
    assert boxes.values == ((10, "c3d"), (30, "c3d:boxes=30"))
    assert (side.title, side.values) == ("box over side", ((2, "box:side=2"), (8, "box")))


@pytest.mark.usefixtures("in_process_workers")
def test_the_report_has_charts_over_a_parameter_of_worlds(bench: Cli, tmp_path: Path) -> None:
    """A curve for each planner; none through values at which it solved nothing."""
    run = ("run", "--env", "c3d:boxes=60|1", "--planners", "rrtconnect,straight-line")
    assert bench(*run, "--problems", 4, "--out", tmp_path)[0] == 0
    results, rows = RunResults.read(tmp_path), records_of(tmp_path)
    sets = problem_sets_of(results)
    numbers = {"rrtconnect": 0, "straight-line": 1}
    charts = {one["axis"]: one for one in difficulty_charts(sets, numbers, results.metrics)}
    assert {"share solved", "length units", "time s"} <= charts.keys()
    success = charts["share solved"]
    assert (success["title"], success["parameter"]) == ("c3d over boxes", "boxes")
    assert success["x"] == [1, 60]
    for curve, name in zip(success["curves"], numbers, strict=True):
        of = rows[rows["planner"] == name]
        for boxes, share in zip((1, 60), curve["y"], strict=True):
            outcomes = of.loc[of["env"] == f"c3d:boxes={boxes}", "outcome"]
            assert share == pytest.approx((outcomes == "VALID").mean())
    assert bench("report", tmp_path, "--format", "html")[0] == 0
    page = (tmp_path / "report.html").read_text()
    assert page.count('data-chart="difficulty"') == len(charts)


@pytest.mark.usefixtures("in_process_workers")
def test_without_such_worlds_there_is_no_such_chapter(bench: Cli, tmp_path: Path) -> None:
    run = ("run", "--env", "c3d,c3d:scene=1", "--planners", "straight-line", "--problems", 1)
    assert bench(*run, "--out", tmp_path)[0] == 0
    assert bench("report", tmp_path, "--format", "html")[0] == 0
    page = (tmp_path / "report.html").read_text()
    assert 'id="difficulty"' not in page
