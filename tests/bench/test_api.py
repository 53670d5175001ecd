"""The front door in Python: the same as the command line, as data frames, reports and plots."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import plugins
import pytest
from conftest import Cli
from in_process_worker import in_process

import bench
import envs
import planners
from bench.analysis.claims import CLAIMED_S, ELSEWHERE
from bench.cli import interface
from bench.judging.metrics import METRICS
from bench.storage.record import COLUMNS, Verdict
from envs import InputError

PLANNERS = "rrtconnect,straight-line"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> bench.Run:
    folder = tmp_path_factory.mktemp("api") / "run"
    with in_process():
        return bench.run("c3d", PLANNERS, problems=6, stop="first", out=folder)


def test_its_arguments_are_the_options_of_the_command() -> None:
    options = {o.name: o for o in interface.run.params if o.name != "wide"}  # of terminals
    arguments = inspect.signature(bench.run).parameters
    assert arguments.keys() == options.keys()
    for name, argument in arguments.items():
        if argument.default is not inspect.Parameter.empty and not name.endswith("_file"):
            assert argument.default == options[name].default or not argument.default, name


def test_data_frames_have_every_attempt_and_path(run: bench.Run) -> None:
    columns = [name for name in COLUMNS if name not in ("path", "metrics")]
    assert list(run.attempts.columns)[: len(columns)] == columns
    assert set(run.attempts.columns[len(columns) :]) == {
        *(metric.name for metric in run.metrics),
        *(ELSEWHERE, CLAIMED_S),
    }
    assert len(run.attempts) == 12
    assert run.summary["planner"].tolist() == PLANNERS.split(",")
    solved = run.attempts["outcome"] == "VALID"
    assert run.attempts[solved].groupby("planner").size()["rrtconnect"] == 6
    assert {path.shape[1] for path in run.paths["path"]} == {3}
    of = run.paths.set_index(["planner", "problem"])["path"]
    for row in run.attempts[solved].itertuples():
        steps = np.diff(of[row.planner, row.problem], axis=0)
        assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(row.length)


def test_what_is_there_is_loaded_and_not_measured_again(run: bench.Run) -> None:
    loaded = bench.load(str(run.folder))
    pd.testing.assert_frame_equal(loaded.attempts, run.attempts)
    again = bench.run(
        ["c3d"], ["rrtconnect", "straight-line"], problems=6, stop="first", out=run.folder
    )
    assert again.attempts["run_id"].unique().tolist() == run.attempts["run_id"].unique().tolist()


def test_it_is_what_the_command_writes(run: bench.Run, bench: Cli, tmp_path: Path) -> None:
    code, out, err = bench("report", run.folder, "--out", tmp_path)
    assert code == 0, err
    assert run._repr_markdown_().splitlines()[2:] == out.splitlines()[2:-1]
    assert repr(run) == f"<Run of rrtconnect, straight-line in c3d: 12 attempts, {run.folder}>"


def test_reports_are_written_where_they_are_wanted(run: bench.Run, tmp_path: Path) -> None:
    file = run.report("csv", tmp_path / "new")
    assert file == tmp_path / "new" / "summary.csv"
    assert pd.read_csv(file)["planner"].tolist() == PLANNERS.split(",")
    with pytest.raises(InputError, match="did you mean 'html'"):
        run.report("htm")


def test_plots_show_what_the_frames_hold(run: bench.Run) -> None:
    with mpl.rc_context({"backend": "agg"}):
        axes = run.plot_success()
        ends = {line.get_label(): line.get_ydata()[-1] for line in axes.lines}
        rates = run.summary.set_index("planner")["success_rate"]
        assert ends == pytest.approx(rates.to_dict())
        _, own = plt.subplots()
        assert run.plot_metric("length", env="c3d", ax=own) is own
        medians = [line.get_xdata()[0] for line in own.lines if line.get_color() == "C1"]
        assert medians == pytest.approx(run.summary["length_median"].tolist())
        assert "length" in own.get_xlabel()
        plt.close("all")


def test_mistakes_are_input_errors(run: bench.Run, tmp_path: Path) -> None:
    out = tmp_path / "none"
    for wrong, said in (
        ({"env": "c3dd"}, "did you mean 'c3d'"),
        ({"env": "c3d", "planners": "fmn"}, "'fmm'"),
        ({"env": "c3d", "problems": 0}, "--problems must be between"),
    ):
        with pytest.raises(InputError, match=said):
            bench.run(**wrong, out=out)
    assert not out.exists()
    with pytest.raises(TypeError, match="problms"):
        bench.run("c3d", problms=3)  # type: ignore[call-arg]
    with pytest.raises(InputError, match=r"holds no run\.sqlite"):
        bench.load(tmp_path)
    with pytest.raises(InputError, match="did you mean 'length'"):
        run.plot_metric("lenght")
    with pytest.raises(InputError, match="unknown environment of the run 'arm4'"):
        run.plot_success("arm4")


@pytest.mark.slow
def test_planners_of_files_are_there_for_one_call(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(plugins.PLANNER)
    mine = bench.run(
        "c3d", "straight", problems=1, stop="first", planner_file=[file], out=tmp_path / "run"
    )
    assert mine.attempts["planner"].tolist() == ["straight"]
    assert "straight" not in [spec.id for spec in planners.REGISTRY.specs()]


def test_the_judge_judges_any_path() -> None:
    world = envs.make("c3d")
    problem = world.sample_problems(4, seed=0)[3]
    ends = [problem.start, problem.goal]
    free = bench.judge("c3d", problem, ends)
    assert free.verdict is Verdict.VALID
    assert free.length == pytest.approx(float(np.linalg.norm(problem.goal - problem.start)))
    assert bench.judge(world, problem, ends[::-1]).verdict is Verdict.WRONG_ENDPOINT
    assert bench.judge(world, problem, None).verdict is Verdict.MALFORMED


def test_the_columns_of_attempts_are_documented() -> None:
    text = inspect.getdoc(bench.Run.attempts.func)
    assert text is not None
    named = set(re.findall(r"`(\w+)`", text))
    assert {"env", "planner", "problem", "outcome", "solve_s"} <= named
    assert named <= {*COLUMNS, *(metric.name for metric in METRICS), ELSEWHERE, CLAIMED_S}
