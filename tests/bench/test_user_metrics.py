"""Metrics: what each must be, how users add theirs, and where their values go."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plugins
import pytest
from conftest import Cli, Refused, records_of
from documents import block_after

import bench as package
import envs
from bench.execution import answers
from bench.judging import judge, metrics
from bench.judging.metric import Metric, SolvedAttempt, defined, measure
from bench.judging.metrics import METRICS, REGISTERED, registered
from envs import InputError

RUN = (
    *("run", "--env", "c3d", "--planners", "straight-line,rrtconnect", "--stop", "first"),
    *("--problems", 4, "--seed", 3),
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The metric of the documentation."""
    made = tmp_path / "detour.py"
    made.write_text(block_after("metric"), encoding="utf-8")
    return made


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_the_metric_of_the_documentation_is_short_and_stands_everywhere(
    bench: Cli, file: Path, tmp_path: Path
) -> None:
    assert len([line for line in file.read_text().splitlines() if line]) <= 10
    folder, mine = tmp_path / "run", ("--metric-file", file)
    code, out, err = bench(*RUN, "--out", folder, *mine)
    assert code == 0, err
    assert "| detour " in out
    records = records_of(folder)
    solved = records[records["solved"] == 1]
    straight = solved[solved["planner"] == "straight-line"]
    assert straight["detour"].to_numpy() == pytest.approx(1)
    assert (solved["detour"] >= 1 - 1e-9).all()
    assert records[records["solved"] == 0]["detour"].isna().all()
    summary = pd.read_csv(folder / "summary.csv").set_index("planner")
    assert summary.loc["straight-line", "detour_mean"] == pytest.approx(1)
    code, out, err = bench(
        *("compare", folder, "--planners", "straight-line,rrtconnect"),
        *("--metrics", "detour,length", *mine),
    )
    assert code == 0, err
    assert [line.split("|")[4].strip() for line in out.splitlines() if "| straight" in line] == [
        *("success", "length units", "detour")
    ]
    base = tmp_path / "base.csv"
    assert (
        bench("check", folder, "--baseline", base, "--update", "--ratios", "detour", *mine)[0] == 0
    )
    assert "detour" in base.read_text().splitlines()[0]
    assert bench("check", folder, "--baseline", base, "--ratios", "detour", *mine)[0] == 0
    assert bench("report", folder, "--format", "html,latex,planner-arena")[0] == 0, "without it"
    assert "detour" in (folder / "summary.tex").read_text()
    assert "detour" in (folder / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_the_commands_of_the_documentation_work(
    bench: Cli, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(file.parent)
    for line in block_after("metric commands").splitlines():
        name, *arguments = shlex.split(line)
        code, out, err = bench(*arguments)
        assert (name, code) == ("bench", 0), err
        assert "detour" in out or arguments[0] == "check"


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_attempts_that_were_made_without_it_get_it(bench: Cli, file: Path, tmp_path: Path) -> None:
    first, later = tmp_path / "first", tmp_path / "later"
    assert bench(*RUN, "--out", first, "--metric-file", file)[0] == 0
    assert bench(*RUN, "--out", later)[0] == 0
    before = records_of(later)
    assert "detour" not in before
    assert bench(*RUN, "--out", later, "--metric-file", file)[0] == 0
    after = records_of(later)
    assert after["measured_at"].equals(before["measured_at"]), "not measured again"
    assert after["detour"].equals(records_of(first)["detour"]), "of the same paths"


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_one_that_fails_has_no_value_and_loses_no_attempt(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "fails.py"
    file.write_text(
        "from bench import Metric\n"
        "def fails(env, problem, path, attempt):\n    return 1 / 0\n"
        "def word(env, problem, path, attempt):\n    return 'good'\n"
        "A = Metric('fails', 'fails', '', 2, 'lower', fails)\n"
        "B = Metric('word', 'word', '', 2, 'lower', word)\n"
    )
    code, out, err = bench(*RUN, "--out", tmp_path / "run", "--metric-file", file)
    assert code == 0, err
    assert err.count("metric 'fails' fails, and has no value there: ZeroDivisionError: ") == 1
    assert err.count(f"({file}, line 3)") == 1
    assert err.count("metric 'word' fails, and has no value there: ValueError: ") == 1
    records = records_of(tmp_path / "run")
    assert not {"fails", "word"} & {*records.columns} or records["fails"].isna().all()
    assert records["solved"].sum() > 0
    assert "fails" not in out, "a column without a value is left out"


@pytest.mark.usefixtures("in_process_workers")
def test_one_that_is_mended_or_changed_is_computed_anew(
    bench: Cli, file: Path, tmp_path: Path
) -> None:
    right = file.read_text()
    command = (*RUN, "--out", tmp_path / "run", "--metric-file", file)
    file.write_text(right.replace("np.diff", "np.dif"))
    assert bench(*command)[0] == 0
    before = records_of(tmp_path / "run")
    assert before["detour"].isna().all()
    file.write_text(right)
    assert bench(*command)[0] == 0
    mended = records_of(tmp_path / "run")
    assert mended[mended["solved"] == 1]["detour"].notna().all()
    file.write_text(right.replace("steps.sum()", "1000 * steps.sum()"))
    assert bench(*command)[0] == 0
    changed = records_of(tmp_path / "run")
    assert np.allclose(changed["detour"], 1000 * mended["detour"], equal_nan=True)
    assert changed["measured_at"].equals(before["measured_at"]), "no planner ran again"
    out = bench(*command)[2]
    assert "computing" not in out, "nothing is left to compute"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1", "defines no bench.Metric"),
        ("import no_such_module", "cannot be loaded: ModuleNotFoundError"),
        ("raise SystemExit", "cannot be loaded: SystemExit"),
        ("M = Metric('length', 'l', '', 2, 'lower', f)", "'length' of "),
        ("M = Metric('problem', 'l', '', 2, 'lower', f)", "the name is taken"),
        ("M = Metric('success', 'l', '', 2, 'lower', f)", "the name is taken"),
        ("M = Metric('a', 'length', '', 2, 'lower', f)", "the title 'length' is taken"),
        ("M = Metric('a', 'planner', '', 2, 'lower', f)", "the title 'planner' is taken"),
        ("M = Metric(3, 'l', '', 2, 'lower', f)", "small letters, digits and _"),
        ("M = Metric('a', 3, '', 2, 'lower', f)", "title and unit must be printable"),
        ("M = Metric('A b', 'l', '', 2, 'lower', f)", "small letters, digits and _"),
        ("M = Metric('a', '', '', 2, 'lower', f)", "title and unit must be printable"),
        ("M = Metric('a', 'l', '', 2.5, 'lower', f)", "digits must be from 0 to 12"),
        ("M = Metric('a', 'l', '', 2, 'less', f)", "better must be 'lower' or 'higher'"),
        ("M = Metric('a', 'l', '', 2, 'lower', 3)", "compute must be a function"),
        ("M = Metric('a', 'l', '', 2, 'lower', f, effect='x')", "effect must be"),
        (
            "A = B = Metric('a', 'l', '', 2, 'lower', f)\nC = Metric('a', 'm', '', 2, 'lower', f)",
            "taken",
        ),
    ],
)
def test_a_bad_file_is_refused_in_a_line(
    refused: Refused, tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(f"from bench import Metric\nf = lambda *a: 1.0\n{text}\n")
    assert said in refused(*RUN, "--metric-file", file)


@pytest.mark.parametrize("command", ["run", "report", "compare", "check"])
def test_a_file_that_is_none_is_refused_by_every_command(
    refused: Refused, tmp_path: Path, command: str
) -> None:
    arguments: dict[str, tuple[Any, ...]] = {
        "run": ("--env", "c3d"),
        "check": (tmp_path, "--baseline", "b.csv"),
    }
    said = refused(command, *arguments.get(command, (tmp_path,)), "--metric-file", "no.py")
    assert "no.py" in said


@pytest.mark.parametrize(
    "text",
    [
        "import bench.judging.judge as j\nj.Judge.__call__ = lambda *a: None",
        "import bench.judging.metrics as m\nm.pieces = lambda *a: 0.0",
        "import bench.execution.answers as a\na.read = lambda *x: None",
    ],
)
def test_one_that_changes_the_benchmark_is_refused(
    bench: Cli, file: Path, tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (answers, judge, metrics, judge.Judge):
        for name, value in list(vars(module).items()):
            if not name.startswith("__") or name == "__call__":
                monkeypatch.setattr(module, name, value)  # as it was, afterwards
    file.write_text(f"{text}\n{file.read_text()}")
    code, _, err = bench(*RUN, "--out", tmp_path / "run", "--metric-file", file)
    assert code == 2
    assert "was changed by a package with environments or by metrics" in err


@pytest.mark.slow
def test_an_installed_one_is_measured_and_a_broken_one_is_skipped(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = block_after("metric") + "\nBROKEN = 3\n"
    points = {"bench.metrics a": "pack:DETOUR", "bench.metrics b": "pack:BROKEN"}
    plugins.install(tmp_path, "pack", text, points)
    monkeypatch.syspath_prepend(tmp_path)
    code, out, err = bench(*RUN, "--out", tmp_path / "run")
    assert code == 0, err
    assert "metric plug-in 'b' is skipped: TypeError: pack:BROKEN is a int, not a Metric" in err
    assert "| detour " in out
    [said] = json.loads((tmp_path / "run" / "manifest.json").read_text())["metrics"]
    assert (said["name"], said["origin"]) == ("detour", "pack")


def test_all_of_ours_can_be_told_and_are_taken_away_again() -> None:
    before = [metric.name for metric in REGISTERED]
    mine = Metric("mine", "my metric", "N m", 1, "higher", lambda *a: 1.0)
    with registered([mine]):
        assert [metric.name for metric in REGISTERED] == [*before, "mine"]
        with pytest.raises(InputError, match="taken"), registered([mine]):
            raise AssertionError
    assert [metric.name for metric in REGISTERED] == before
    for metric in (*METRICS, mine):
        again = defined(json.loads(json.dumps(metric.definition)))
        assert again.definition == metric.definition
    with pytest.raises(InputError, match="is none"):
        defined({"name": "a"})


def test_headings_have_the_units_of_the_environments() -> None:
    length, margin = (next(m for m in METRICS if m.name == n) for n in ("length", "safety_margin"))
    arm, points = ({"configuration": "rad", "workspace": "m"}, {})
    assert length.heading() == "length units"
    assert length.heading([arm]) == "length rad"
    assert margin.heading([arm, points, arm]) == "safety margin m or units"
    assert dict(envs.make("arm4").units) == arm


def test_values_of_a_path_by_hand() -> None:
    """Along z = 0 in an empty cube there is no clearance to speak of; in c3d there is."""
    env = envs.make("c3d")
    [problem] = env.sample_problems(1, 0)
    path = np.array([problem.start, problem.start + [0.1, 0, 0], problem.start + [0.1, 0.1, 0]])
    history = np.array([[0.2, 9.0], [0.7, 8.0]])
    attempt = SolvedAttempt(1.5, 1.4, 0.25, history)
    found = measure(METRICS, env, problem, path, attempt)
    assert found["time_s"] == 1.5
    assert found["first_solution_s"] == 0.2
    assert found["safety_margin"] == 0.25
    assert found["length"] == pytest.approx(0.2)
    assert found["greatest_turn"] == pytest.approx(90)
    assert found["waypoints"] == 3
    assert found["duration_s"] is None, "a point has no limits of velocity"
    clearances = env.clearance(np.linspace(path[0], path[1], 50))
    assert found["mean_clearance"] == pytest.approx(float(clearances.mean()), rel=0.1)
    slow = env.speed(path).min()
    assert found["travel_time"] == pytest.approx(0.2 / slow, rel=0.2)
    none = measure(METRICS, env, problem, path, SolvedAttempt(None, None, 0.25, history[:0]))
    assert none["time_s"] is none["first_solution_s"] is None


def test_the_judge_gives_them_from_python() -> None:
    env = envs.make("c3d")
    problems = env.sample_problems(20, 0)
    model = env.collision_model()
    problem = next(p for p in problems if model.segment_is_free(p.start, p.goal))
    judged = package.judge(env, problem, [problem.start, problem.goal])
    assert judged.verdict.value == "VALID"
    assert judged.metrics["length"] == pytest.approx(judged.length)
    assert judged.metrics["smoothness"] == 0
    assert judged.metrics["time_s"] is None
    refused = package.judge(env, problem, [problem.start, problem.start])
    assert dict(refused.metrics) == {}
