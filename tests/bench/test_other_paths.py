"""Paths of other programs by the command line: judged, written by a run, and replayed in one."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Cli, Refused, records_of
from many_scenes import ManyScenes
from records import recorded, row

import bench as package
import envs
import planners
from bench.analysis.claims import with_claims
from bench.analysis.comparison import compare, pair_runs
from bench.analysis.regression import Baseline
from bench.analysis.run_results import RunResults
from bench.judged_file import JudgedFile, JudgedPath
from bench.judging.judge import Judgement
from bench.judging.metrics import METRICS
from bench.report import html, latex, markdown, plots
from bench.storage.record import Verdict
from envs import REGISTRY, Environment
from envs.registry import Spec
from planners import Budget, Planner, PlannerResult, Status
from planners.recorded import path_file
from planners.recorded.path_file import PathFile, RecordedPath

SUFFIXES = (".csv", ".json", ".npz", ".txt")
PRIMARY = tuple(metric for metric in METRICS if metric.primary)


class Careless(Planner):
    """Claims straight lines without looking, and by turns what is no path, ends elsewhere, lies out
    of bounds, or is none; it raises, too."""

    improves = False

    def setup(self, env: Environment, *, seed: int) -> None:
        self.env = env

    def solve(self, problem: Any, budget: Budget) -> PlannerResult:
        ends = [problem.start, problem.goal]
        match problem.index % 7:
            case 1:
                return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.start])
            case 2:
                return PlannerResult(
                    Status.EXACT_SOLUTION, [problem.start, self.env.upper + 1, problem.goal]
                )
            case 3:
                return PlannerResult(
                    Status.EXACT_SOLUTION, [problem.start, problem.goal * math.nan]
                )
            case 4:
                return PlannerResult(Status.APPROXIMATE_SOLUTION, ends)
            case 5:
                return PlannerResult(Status.INFEASIBLE)
            case 6:
                raise RuntimeError("no\nway")
        return PlannerResult(Status.EXACT_SOLUTION, ends)


class Replays(Planner):
    """Hands over straight lines, and claims what it likes of their times."""

    improves = False
    planned_elsewhere = True

    def solve(self, problem: Any, budget: Budget) -> PlannerResult:
        claim = {"claimed_solve_s": "soon" if problem.index % 2 else 1e-9}
        history = {"cost_history": [[1e-9, 1.0]]}
        ends = [problem.start, problem.goal]
        return PlannerResult(Status.EXACT_SOLUTION, ends, {**claim, **history})


@pytest.fixture
def careless() -> Iterator[str]:
    """The name of a planner."""
    spec = Spec("careless", f"{__name__}:Careless", "claims what is not so", in_all=False)
    planners.REGISTRY.register(spec)
    yield spec.id
    planners.REGISTRY.unregister(spec.id)


def assert_replayed(bench: Cli, folder: Path, env: str, planner: str, suffix: str) -> None:
    """`bench judge` and `recorded` give the verdicts of the run that made some paths."""
    then = records_of(folder)
    then = then[then["planner"] == planner].set_index("problem")
    file = folder / f"paths{suffix}"
    assert bench("paths", folder, "--planner", planner, "--out", file)[0] == 0

    code, out, _ = bench("judge", "--env", env, "--paths", file, "--json")
    told = {path["problem"]: path for path in json.loads(out)["paths"]}
    verdicts = {index: path["verdict"] or "" for index, path in told.items()}
    raised = then["status"] == "ERROR"
    assert verdicts == then["verdict"].to_dict()
    assert code == int(any(v not in ("VALID", "") for v in verdicts.values()))
    for index, path in told.items():
        for name, value in path["metrics"].items():
            assert value == then.loc[index, name], (index, name)
        assert (path["contact"] is None) == (path["verdict"] != "COLLISION")

    again = folder.with_name(f"{folder.name}-{suffix[1:]}")
    name = f"recorded:file={file}"
    problems = len(then) + 1  # the file says nothing of the last
    asked = ("--problems", problems, "--seed", 3, "--stop", "first", "--out", again)
    assert bench("run", "--env", env, "--planners", name, *asked)[0] == 0
    now = records_of(again).set_index("problem")
    assert now.loc[problems - 1, "outcome"] == "TIMEOUT"
    now = now.drop(index=problems - 1)
    assert now["verdict"].tolist() == then["verdict"].tolist()
    assert now["outcome"].tolist() == then["outcome"].where(~raised, "TIMEOUT").tolist()
    for metric in ("length", "safety_margin", "smoothness"):
        assert now[metric].equals(then[metric])
    assert now["solve_s"].isna().all(), "nothing was timed here"
    assert now["claimed_solve_s"].tolist() == then["solve_s"].tolist()


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("env", ["c3d", "arm4"])
def test_recorded_and_judge_give_the_verdicts_of_the_run(
    bench: Cli, tmp_path: Path, careless: str, env: str, suffix: str
) -> None:
    run = ("--problems", 9, "--seed", 3, "--stop", "first", "--out", tmp_path / "run")
    assert bench("run", "--env", env, "--planners", f"rrtconnect,{careless}", *run)[0] == 0
    outcomes = set(records_of(tmp_path / "run")["outcome"])
    assert outcomes >= {"VALID", "COLLISION", "WRONG_ENDPOINT", "OUT_OF_BOUNDS", "MALFORMED"}
    assert outcomes >= {"INFEASIBLE", "ERROR", "APPROXIMATE_SOLUTION"}
    for planner in ("rrtconnect", careless):
        assert_replayed(bench, tmp_path / "run", env, planner, suffix)


@pytest.mark.usefixtures("in_process_workers")
def test_the_same_of_a_few_problems(bench: Cli, tmp_path: Path, careless: str) -> None:
    run = ("--problems", 4, "--seed", 3, "--stop", "first", "--out", tmp_path / "run")
    assert bench("run", "--env", "c3d", "--planners", careless, *run)[0] == 0
    assert_replayed(bench, tmp_path / "run", "c3d", careless, ".json")


def of_c3d(file: Path, *paths: RecordedPath, **said: Any) -> Path:
    path_file.write(PathFile(paths, **said), file)
    return file


def blocked_and_free(c3d: Environment) -> tuple[Any, Any]:
    """Straight lines of problems 0 (blocked) and 3 (free) of seed 0."""
    problems = c3d.sample_problems(4, 0)
    lines = [np.array([p.start, p.goal]) for p in problems]
    return lines[0], lines[3]


def test_what_is_printed_of_each_path(bench: Cli, tmp_path: Path, c3d: Environment) -> None:
    blocked, free = blocked_and_free(c3d)
    paths = (
        RecordedPath(blocked, 0),
        RecordedPath(free, 3, solve_s=0.5),
        RecordedPath(blocked, 3),
        RecordedPath(None, 1, status=Status.TIMEOUT),
    )
    file = of_c3d(tmp_path / "paths.csv", *paths, environment=c3d.fingerprint)
    code, out, err = bench("judge", "--env", "c3d", "--paths", file)
    assert (code, err) == (1, "")
    lines = [line.split("|") for line in out.splitlines() if line.startswith("| line")]
    assert [cells[3].strip() for cells in lines] == [
        *("COLLISION", "VALID", "WRONG_ENDPOINT", "TIMEOUT")
    ]
    assert "COLLISION 1, VALID 1, WRONG_ENDPOINT 1" in out
    assert "length units" in out
    assert "travel time" in out
    assert "time s" not in out, "nothing was timed"
    judged = package.judge("c3d", c3d.sample_problems(1, 0)[0], blocked)
    assert f"- line 3, problem 0: COLLISION: {judged.reason}; the configuration is (" in out
    assert "cannot be WRONG_ENDPOINT" not in out
    assert "must be within 1e-06 of the problem's start and goal" in out
    assert package.judge_file("c3d", file).paths[0].judgement.reason == judged.reason


def test_without_a_problem_it_is_judged_between_its_own_ends(
    bench: Cli, tmp_path: Path, c3d: Environment
) -> None:
    blocked, free = blocked_and_free(c3d)
    file = of_c3d(tmp_path / "paths.txt", RecordedPath(free))
    code, out, _ = bench("judge", "--env", "c3d", "--paths", file)
    assert code == 0
    assert "its verdict cannot be WRONG_ENDPOINT" in out
    assert "1e-06" not in out
    code, out, _ = bench("judge", "--env", "c3d", "--paths", of_c3d(file, RecordedPath(blocked)))
    assert code == 1
    none = of_c3d(tmp_path / "none.json", RecordedPath(None, 0, status=Status.INFEASIBLE))
    assert bench("judge", "--env", "c3d", "--paths", none)[0] == 3


def test_json_has_no_word_for_what_is_endless() -> None:
    """Where there are no obstacles, nothing is near."""
    values = {"length": 1.5, "safety_margin": math.inf, "duration_s": None}
    path = RecordedPath(np.array([[0.0], [1.5]]), place="line 1")
    judged = JudgedPath(path, Judgement(Verdict.VALID, "", 2, 1.5, math.inf, values))
    units = {"configuration": "units", "workspace": "units"}
    found = JudgedFile(Path("paths.txt"), "box", "abc", 0, (judged,), units)
    assert found.all_valid
    [told] = json.loads(json.dumps(found.data, allow_nan=False))["paths"]
    assert told["metrics"] == {"length": 1.5, "waypoints": 2, "safety_margin": None}
    assert "| inf " in found.text


def test_indices_are_those_of_a_run_with_the_seed(
    bench: Cli, refused: Refused, tmp_path: Path, c3d: Environment
) -> None:
    [*_, last] = c3d.sample_problems(6, 7)
    path = RecordedPath(np.array([last.start, last.start, last.goal]), 5)
    saying = of_c3d(tmp_path / "saying.json", path, seed=7)
    silent = of_c3d(tmp_path / "silent.json", path)

    def verdict(file: Path, *more: object) -> str:
        _, out, _ = bench("judge", "--env", "c3d", "--paths", file, "--json", *more)
        [found] = json.loads(out)["paths"]
        return str(found["verdict"])

    right = verdict(saying)
    assert right in ("VALID", "COLLISION")
    assert verdict(silent) == "WRONG_ENDPOINT"
    assert verdict(silent, "--seed", 7, "--problems", 6) == right
    judge = ("judge", "--env", "c3d", "--paths")
    assert "is for other problems, those of seed 7" in refused(*judge, saying, "--seed", 8)
    said = refused(*judge, saying, "--problems", 5)
    assert f"{saying}: paths[0]: there is no problem 5 among 5" in said
    assert "--problems must be between 1" in refused(*judge, saying, "--problems", 0)
    assert "--seed must be between 0" in refused(*judge, silent, "--seed", -1)
    far = of_c3d(tmp_path / "far.json", RecordedPath(path.waypoints, 10**9))
    assert "there is no problem 1000000000 among 1000000" in refused(*judge, far)


def test_what_does_not_fit_is_refused_in_a_line(
    refused: Refused, tmp_path: Path, c3d: Environment
) -> None:
    _, free = blocked_and_free(c3d)
    judge = ("judge", "--env", "c3d", "--paths")
    other = of_c3d(tmp_path / "other.json", RecordedPath(free, 3), environment="abc")
    assert "fingerprint abc" in refused(*judge, other)
    run = ("run", "--env", "c3d", "--problems", 2, "--stop", "first", "--planners")
    assert "fingerprint abc" in refused(*run, f"recorded:file={other}")
    two = of_c3d(tmp_path / "two.csv", RecordedPath(free[:, :2], 3))
    assert f"{two}: line 2: waypoints have 2 numbers" in refused(*judge, two)
    lost = of_c3d(tmp_path / "lost.json", RecordedPath(None, status=Status.TIMEOUT))
    assert "paths[0] has neither a path nor a problem" in refused(*judge, lost)
    (tmp_path / "nan.csv").write_text("1,2,3\n4,nan,6\n")
    assert "nan.csv: line 2 holds NaN" in refused(*judge, tmp_path / "nan.csv")
    assert "no argument" not in refused(*judge, tmp_path / "missing.csv")
    assert "unknown environment" in refused("judge", "--env", "c4d", "--paths", two)
    assert "name a file of paths, as in recorded:file=paths.json" in refused(*run, "recorded")


def test_where_scenes_differ_a_path_must_say_its_problem(
    bench: Cli, refused: Refused, tmp_path: Path
) -> None:
    spec = Spec("many-scenes", "many_scenes:ManyScenes", "three scenes", in_all=False)
    REGISTRY.register(spec)
    try:
        world = ManyScenes()
        problems = world.sample_problems(6, 0)
        lines = [np.array([p.start, p.goal]) for p in problems]
        judge = ("judge", "--env", "many-scenes", "--paths")
        silent = of_c3d(tmp_path / "silent.json", RecordedPath(lines[0]))
        said = refused(*judge, silent)
        assert "paths[0] does not say for which problem it is" in said
        assert "a scene of its own" in said
        named = [RecordedPath(line, index) for index, line in enumerate(lines)]
        code, out, _ = bench(*judge, of_c3d(tmp_path / "named.json", *named), "--json")
        wanted = [
            world.scene_of(p).collision_model().segment_is_free(p.start, p.goal) for p in problems
        ]
        assert 0 < sum(wanted) < 6, "both kinds"
        assert [p["verdict"] == "VALID" for p in json.loads(out)["paths"]] == wanted
        assert code == 1
    finally:
        REGISTRY.unregister(spec.id)


def claimed(**stats: Any) -> dict[str, Any]:
    return {"solve_s": None, "stats": json.dumps(stats), "setup_s": 3.0, "train_s": 0.0}


def mixed() -> RunResults:
    """A planner that was timed, and one that claims to be a thousand times as fast."""
    rows = []
    for i in range(12):
        numbers = {"length": 10.0 + i, "safety_margin": 1.0}
        rows.append(row("timed", i, "VALID", solve_s=1.0 + i, **numbers))
        claim = claimed(claimed_solve_s=(1.0 + i) / 1000)
        rows.append(row("elsewhere", i, "VALID", **claim, **numbers))
    selection = {"planned_elsewhere": ["elsewhere"]}
    return _with_claims(recorded(rows, **selection))


def _with_claims(run: RunResults) -> RunResults:
    """As a run that is read from a store."""
    return replace(run, records=with_claims(run.records, run.selections[0]))


def test_claims_are_in_a_column_of_their_own_and_nowhere_else() -> None:
    run = mixed()
    table = run.summary.set_index("planner")
    claims, timed = table.loc["elsewhere"], table.loc["timed"]
    assert claims["success_rate"] == 1
    assert claims["length_mean"] == timed["length_mean"]
    times = [n for n in table.columns if n.startswith(("time_s_", "setup", "train", "offline"))]
    assert len(times) >= 10
    assert claims[times].isna().all()
    assert timed[times].notna().all()
    assert (claims["time_source"], timed["time_source"]) == ("claimed", "measured")
    assert claims["claimed_time_s_mean"] == pytest.approx(0.0065)
    assert math.isnan(timed["claimed_time_s_mean"])
    assert claims["held_to"] == "planned elsewhere"
    common = run.common.set_index("planner")
    assert common.loc["elsewhere", ["time_s_to_best", "share_to_best"]].isna().all()
    assert common.loc["timed", "share_to_best"] == 1


def test_reports_mark_them(tmp_path: Path) -> None:
    run = mixed()
    for text in (markdown.text(run), latex.text(run)):
        assert "claimed s, not timed here" in text
        assert "was planned elsewhere" in text
    cells = next(line for line in markdown.text(run).splitlines() if "| elsewhere" in line)
    assert [cell.strip() for cell in cells.split("|")][5] == "-"
    html.write(run, tmp_path / "report.html")
    assert "claimed s, not timed here" in (tmp_path / "report.html").read_text(encoding="utf-8")
    axes = plots.success(run, None, None)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["timed"]


def test_no_test_of_times_has_them() -> None:
    run = mixed()
    table = compare(pair_runs(run, run, ("timed", "elsewhere")).pairs, PRIMARY)
    table = table.set_index("measure")
    assert table.loc["time_s", "verdict"] == "not comparable"
    assert "claimed, not timed here" in table.loc["time_s", "reason"]
    assert math.isnan(table.loc["time_s", "p"])
    assert table.loc["length", "verdict"] == "same"


def test_the_gate_has_no_times_of_them() -> None:
    rows = Baseline.of(mixed()).rows
    assert np.isnan(rows["c3d", "elsewhere"].values["time"]).all()
    assert np.isfinite(rows["c3d", "timed"].values["time"]).all()
    assert np.isfinite(rows["c3d", "elsewhere"].values["length"]).all()


@pytest.mark.usefixtures("in_process_workers")
def test_a_planner_of_ones_own_that_replays_is_not_timed(bench: Cli, tmp_path: Path) -> None:
    spec = Spec("replays", f"{__name__}:Replays", "hands over lines", in_all=False)
    planners.REGISTRY.register(spec)
    try:
        run = ("--problems", 6, "--stop", "first", "--out", tmp_path)
        code, out, _ = bench("run", "--env", "c3d", "--planners", "replays,rrtconnect", *run)
    finally:
        planners.REGISTRY.unregister(spec.id)
    assert code == 0
    assert "`replays` in `c3d` was planned elsewhere" in out
    assert "`rrtconnect` in `c3d` was" not in out
    records = records_of(tmp_path)
    own = records[records["planner"] == "replays"]
    assert own[["solve_s", "time_s", "first_solution_s", "setup_s"]].isna().all(axis=None)
    assert own["claimed_solve_s"].fillna(-1).tolist() == [1e-9, -1] * 3
    others = records[records["planner"] == "rrtconnect"]
    assert others[["solve_s", "setup_s"]].notna().all(axis=None)
    assert others["claimed_solve_s"].isna().all()


@pytest.mark.usefixtures("in_process_workers")
def test_problems_of_ones_own_are_named_by_their_place_in_their_file(
    bench: Cli, refused: Refused, tmp_path: Path, c3d: Environment
) -> None:
    posed, file = tmp_path / "posed.json", tmp_path / "paths.json"
    drawn = c3d.sample_problems(4, 0)
    posed.write_text(
        json.dumps([{"start": list(p.start), "goal": list(p.goal)} for p in drawn[2:]])
    )
    run = ("run", "--env", "c3d", "--problem-file", posed, "--stop", "first", "--seed", 5)
    assert bench(*run, "--planners", "rrtconnect", "--out", tmp_path / "run")[0] == 0
    assert bench("paths", tmp_path / "run", "--out", file)[0] == 0
    assert [path.problem for path in path_file.read(file).paths] == [0, 1]
    judge = ("judge", "--env", "c3d", "--paths", file)
    assert bench(*judge, "--problem-file", posed, "--seed", 5)[0] == 0
    assert "give what the run was given" in refused(*judge, "--problem-file", posed)
    again = (*run, "--planners", f"recorded:file={file}", "--out", tmp_path / "again")
    assert bench(*again)[0] == 0
    assert set(records_of(tmp_path / "again")["outcome"]) == {"VALID"}
    of_c3d(file, RecordedPath(np.array([drawn[2].start, drawn[2].goal]), 2))
    assert "no problem 2 among 2" in refused(*judge, "--problem-file", posed)


@pytest.mark.usefixtures("in_process_workers")
def test_a_claim_above_the_time_limit_is_late_and_none_is_not(
    bench: Cli, tmp_path: Path, c3d: Environment
) -> None:
    free = [p for p in c3d.sample_problems(12, 0) if _is_free(c3d, p)][:3]
    claims = (0.5, 2.5, None)
    paths = [
        RecordedPath(np.array([p.start, p.goal]), p.index, claim)
        for p, claim in zip(free, claims, strict=True)
    ]
    file = of_c3d(tmp_path / "paths.json", *paths)
    out = tmp_path / "run"
    run = ("run", "--env", "c3d", "--planners", f"recorded:file={file}", "--time-limit", 2)
    assert bench(*run, "--problems", 12, "--out", out, "--stop", "first")[0] == 0
    records = records_of(out).set_index("problem")
    assert records.loc[[p.index for p in free], "outcome"].tolist() == ["VALID", "LATE", "VALID"]
    assert (records["outcome"] == "TIMEOUT").sum() == 9
    costs = ["solve_s", "cpu_s", "load", "peak_memory_mb", "attempt_memory_mb"]
    assert records[costs].isna().all(axis=None)
    of_c3d(file, *paths[:2])
    assert bench(*run, "--problems", 12, "--out", out, "--stop", "first")[0] == 0
    again = records_of(out).set_index("problem")
    assert again.loc[free[2].index, "outcome"] == "TIMEOUT", "another file is judged again"


def _is_free(env: Environment, problem: envs.Problem) -> bool:
    return env.collision_model().segment_is_free(problem.start, problem.goal)


def test_what_a_run_does_not_have_is_not_written(
    bench: Cli, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = recorded([row("p", 0, "TIMEOUT"), row("q", 0, "UNSUPPORTED", error="it cannot")])
    run = _with_claims(run)
    monkeypatch.setattr(RunResults, "read", lambda folder: run)
    file = tmp_path / "paths.json"
    assert "choose one of p, q" in refused("paths", "DIR", "--out", file)
    assert "unknown planner of the run 'r'" in refused(
        "paths", "DIR", "--planner", "r", "--out", file
    )
    assert "no attempts of q" in refused("paths", "DIR", "--planner", "q", "--out", file)
    assert "ends in .csv" in refused("paths", "DIR", "--planner", "p", "--out", tmp_path / "paths")
    assert bench("paths", "DIR", "--planner", "p", "--out", file)[0] == 0
    [path] = path_file.read(file).paths
    assert (path.problem, path.waypoints, path.status) == (0, None, Status.TIMEOUT)
