"""Problems of one's own: read, written, refused with the row, run, judged and made again."""

from __future__ import annotations

import json
import re
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from conftest import Cli, records_of
from documents import block_after
from hypothesis import given
from hypothesis import strategies as st

import bench as package
import envs
import planners
from bench.judging.judge import Judge
from bench.judging.problem_facts import problem_facts
from bench.report.html.problems import columns, problem_sets_of, problems_data
from bench.storage import problem_file
from bench.storage.problem_file import GivenProblems
from bench.storage.record import Verdict
from envs import Environment, InputError, Problem

HEAD = "start_1,start_2,start_3,goal_1,goal_2,goal_3"


def in_file(file: Path, text: str) -> GivenProblems:
    file.write_text(text)
    return GivenProblems.read(file)


numbers = st.floats(allow_nan=False, allow_infinity=False)
configurations = st.lists(numbers, min_size=3, max_size=3)


@given(
    problems=st.lists(
        st.tuples(configurations, st.lists(configurations, min_size=1, max_size=3)),
        min_size=1,
        max_size=5,
    ),
    suffix=st.sampled_from([".csv", ".json", ".yaml", ".yml", ".CSV"]),
)
def test_what_is_written_is_read_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory,
    problems: list[tuple[list[float], list[list[float]]]],
    suffix: str,
) -> None:
    file = tmp_path_factory.mktemp("written") / f"problems{suffix}"
    made = [
        Problem(start, goals[0], index, 1, goals if len(goals) > 1 else None)  # type: ignore[arg-type]
        for index, (start, goals) in enumerate(problems)
    ]
    problem_file.write(made, file)
    for one, (start, goals) in zip(GivenProblems.read(file).posed, problems, strict=True):
        assert one.start.tolist() == start
        assert one.goals.tolist() == goals


def test_all_forms_say_the_same(tmp_path: Path) -> None:
    of_json = '[{"start": [0, 0, 1], "goal": [1, 2, 3]}, {"start": [0, 0, 2], "goal": [4, 5, 6]}]'
    texts = {
        "a.json": of_json,
        "b.json": f'{{"problems": {of_json}}}',
        "a.yaml": "problems:\n- {start: [0, 0, 1], goal: [1, 2, 3], name: first}\n"
        "- {start: [0, 0, 2], goals: [[4, 5, 6]]}\n",
        "a.csv": f"{HEAD}\n0,0,1,1,2,3\n0,0,2,4,5,6\n",
        "b.csv": "\ufeff0,0,1,1,2,3\n\n0,0,2,4,5,6\n",
        "c.csv": "goal_1,goal_2,goal_3,name,start_1,start_2,start_3\n1,2,3,x,0,0,1\n4,5,6,,0,0,2\n",
    }
    read = [in_file(tmp_path / name, text) for name, text in texts.items()]
    assert len({one.digest for one in read}) == 1
    assert GivenProblems.of_data(json.loads(json.dumps(read[2].data))).digest == read[0].digest
    assert [one.name for one in read[2].posed] == ["first", ""]


def test_the_page_shows_such_a_file(tmp_path: Path) -> None:
    posed = in_file(tmp_path / "a.json", block_after("problems of one's own")).posed
    assert [len(one.goals) for one in posed] == [1, 2]


def test_rows_of_a_name_and_start_are_goals_of_one_problem(tmp_path: Path) -> None:
    text = (
        f"name,{HEAD}\na,0,0,0,1,1,1\na,0,0,0,2,2,2\nb,0,0,0,3,3,3\na,1,0,0,4,4,4\n"
        ",0,0,0,5,5,5\n,0,0,0,6,6,6\n"
    )
    posed = in_file(tmp_path / "a.csv", text).posed
    assert [one.goals[:, 0].tolist() for one in posed] == [[1, 2], [3], [4], [5], [6]]
    assert [one.row for one in posed] == ["row 1", "row 3", "row 4", "row 5", "row 6"]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.txt", "", "end in .csv, .json, .yaml"),
        ("a.csv", "", "has no problems"),
        ("a.csv", f"{HEAD}\n", "has no problems"),
        ("a.csv", f"{HEAD}\n0,0,0,1,1,1\n0,0,0,1,1\n", "row 2 has 5 cells, not 6"),
        ("a.csv", f"{HEAD}\n0,0,0,1,x,1\n", "row 1, goal_2 must be a finite number, not 'x'"),
        ("a.csv", f"{HEAD}\n0,nan,0,1,1,1\n", "row 1, start_2 must be a finite number"),
        ("a.csv", f"{HEAD},gaol_1\n0,0,0,1,1,1,1\n", "unknown column 'gaol_1'; did you mean"),
        ("a.csv", "start_1,goal_1,goal_1\n0,1,1\n", "column 'goal_1' is there twice"),
        ("a.csv", "start_1,start_2,goal_1\n0,1,1\n", "column 'goal_2' is missing"),
        ("a.csv", "name\nx\n", "column 'start_1' is missing"),
        ("a.csv", "0,0,0\n", "row 1 has 3 numbers"),
        ("a.csv", f'{HEAD}\n0,0,0,1,1,"1\n', "line 2: it is no CSV: unexpected end of data"),
        ("a.csv", f"{HEAD}\n0,0,0,1,1,{'1' * 200_000}\n", "it is no CSV: field larger than"),
        ("a.json", "{", "Expecting property name"),
        ("a.json", "[" * 100_000, "too deep"),
        ("a.json", "3", "must be a list of problems"),
        ("a.json", '{"problem": []}', "unknown key 'problem'; did you mean 'problems'?"),
        ("a.json", "[]", "has no problems"),
        ("a.json", "[3]", "row 1: a problem has start and goal"),
        ("a.json", '[{"start": [0]}]', "row 1: a problem has a start, and either a goal or goals"),
        ("a.json", '[{"start": [0], "goals": []}]', "row 1: goals must be a list of at least one"),
        ("a.json", '[{"start": [0], "goal": [1], "gaol": 1}]', "unknown key 'gaol'"),
        ("a.json", '[{"start": [0], "goal": [1, 2]}]', "start has 1 numbers, its goal 2"),
        ("a.json", '[{"start": [], "goal": []}]', "row 1: start must be a list of numbers"),
        ("a.json", '[{"start": [true], "goal": [1]}]', "row 1: start must have finite numbers"),
        ("a.json", '[{"start": [1e999], "goal": [1]}]', "row 1: start must have finite numbers"),
        ("a.json", '[{"start": [0], "goal": [1], "name": 3}]', "row 1: a name is text, not 3"),
        ("a.json", '[{"start": [0], "start": [1], "goal": [1]}]', "'start' is given twice"),
        ("a.json", f'[{{"start": [1{"0" * 400}], "goal": [1]}}]', "must have finite numbers"),
        ("a.yaml", f"- {{start: [0x{'f' * 5000}], goal: [1]}}", "must have finite numbers"),
        ("a.yaml", "- [", "not YAML, mend it"),
        ("a.yaml", "- {start: [0], start: [1], goal: [1]}", "'start' is given twice"),
        ("a.yaml", "a: &a {start: [0]}\nb: {<<: *a}", "'<<' in the mapping at line 2"),
        ("a.yaml", "- !!timestamp 1", "not YAML, mend it"),
        ("a.yaml", f"- {':'.join(['1'] * 300)}.5", "not YAML, mend it: int too large"),
        ("a.yaml", "[" * 100_000, "not YAML, mend it"),
        ("a.yaml", "- {start: [.nan], goal: [1]}", "row 1: start must have finite numbers"),
    ],
)
def test_what_is_malformed_is_refused_with_its_row(
    tmp_path: Path, name: str, text: str, said: str
) -> None:
    with pytest.raises(InputError, match=re.escape("a.")) as refused:
        in_file(tmp_path / name, text)
    assert said in str(refused.value)


def test_numbers_of_yaml_may_have_no_point_and_names_may_begin_like_one(tmp_path: Path) -> None:
    text = "- {start: [1e-3, 2E+5], goal: [.5, 1.], name: 1e3-run}"
    [posed] = in_file(tmp_path / "a.yaml", text).posed
    assert posed.start.tolist() == [0.001, 200_000]
    assert posed.name == "1e3-run"


def test_bytes_that_are_no_text_and_missing_files_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00")
    for name in ("a.csv", "b.csv"):
        with pytest.raises(InputError, match=f"cannot read .*{name}"):
            GivenProblems.read(tmp_path / name)


def own(env: Environment, *goals_of: int) -> list[dict[str, object]]:
    """Problems of the environment's own, each with some of the goals of another seed."""
    drawn, more = env.sample_problems(len(goals_of), 5), env.sample_problems(9, 6)
    return [
        {
            "start": p.start.tolist(),
            "goals": [p.goal.tolist(), *(q.goal.tolist() for q in more[:n])],
        }
        for p, n in zip(drawn, goals_of, strict=True)
    ]


def problems_of(env: Environment, tmp_path: Path, *goals_of: int) -> list[Problem]:
    file = tmp_path / "own.json"
    file.write_text(json.dumps(own(env, *goals_of)))
    return GivenProblems.read(file).problems(env, 0)


def test_a_path_to_any_of_the_goals_is_valid(c3d: Environment, tmp_path: Path) -> None:
    [problem] = problems_of(c3d, tmp_path, 3)
    judge, model = Judge(c3d), c3d.collision_model()
    assert len(problem.all_goals) == 4
    verdicts = []
    for goal in problem.all_goals:
        found = judge(problem, np.array([problem.start, goal]))
        is_free = model.segment_is_free(problem.start, goal)
        verdicts.append(found.verdict)
        assert (found.verdict is Verdict.VALID) == is_free
    assert Verdict.WRONG_ENDPOINT not in verdicts
    elsewhere = judge(problem, np.array([problem.start, problem.start + 0.1]))
    assert elsewhere.verdict is Verdict.WRONG_ENDPOINT
    assert "nearest goal" in elsewhere.reason


@pytest.mark.parametrize(
    "name", ["rrtconnect", "rrtstar", "prmstar", "lazyprmstar", "informedrrtstar", "bitstar", "fmt"]
)
def test_planners_of_ompl_end_at_any_goal(name: str, c3d: Environment) -> None:
    """The first goal is far, the second near; a third is behind a wall of boxes."""
    start, far = c3d.sample_problems(1, 4)[0].start, c3d.sample_problems(1, 4)[0].goal
    near = start + 0.2
    problem = Problem(start, far, 0, 3, np.array([far, near]))
    planner = planners.make(name)
    planner.setup(c3d, seed=1)
    result = planner.solve(problem, planners.Budget(perf_counter() + 5, np.inf))
    judged = Judge(c3d)(problem, result.path)
    assert judged.verdict is Verdict.VALID
    if name in ("informedrrtstar", "bitstar", "rrtstar"):
        result = planner.solve(problem, planners.Budget(perf_counter() + 1, 0.5))
        assert np.asarray(result.path)[-1] == pytest.approx(near)


def test_goals_in_contact_are_not_planned_to(c3d: Environment) -> None:
    [drawn] = c3d.sample_problems(1, 4)
    inside = c3d.obstacles[0].center
    goals = np.array([inside, drawn.goal, inside])
    some = Problem(drawn.start, inside, 3, 1, goals)
    none = Problem(drawn.start, inside, 4, 1, goals[[0, 2]])
    facts = problem_facts(c3d, [some, none])
    assert [(end.index, end.end) for end in facts.invalid_ends] == [
        *((3, "goal 1"), (3, "goal 3")),
        *((4, "goal 1"), (4, "goal 2")),
    ]
    assert list(facts.invalid) == [4]
    assert facts.problems[0].all_goals.tolist() == [drawn.goal.tolist()]
    assert facts.problems[0].seed == some.seed


@pytest.mark.usefixtures("in_process_workers")
def test_a_run_plans_them_and_replay_and_pages_know_them(
    bench: Cli, c3d: Environment, tmp_path: Path
) -> None:
    file = tmp_path / "own.json"
    file.write_text(json.dumps(own(c3d, 0, 2, 0)))
    run = ("run", "--env", "c3d", "--planners", "rrtconnect,straight-line", "--stop", "first")
    code, out, _ = bench(*run, "--problem-file", file, "--out", tmp_path / "run")
    assert code == 0
    assert f"3 problems an environment, of {file}" in out
    rows = records_of(tmp_path / "run")
    connected = rows[rows["planner"] == "rrtconnect"]
    assert (connected["outcome"] == "VALID").all()
    for row in package.load(tmp_path / "run").paths.itertuples():
        posed = GivenProblems.read(file).posed[row.problem]
        assert row.path[0].tolist() == posed.start.tolist()
        if row.outcome == "VALID":
            assert row.path[-1].tolist() in posed.goals.tolist()
    file.unlink()  # the store has them
    code, out, _ = bench("replay", tmp_path / "run", "--planner", "rrtconnect", "--problem", 1)
    assert code == 0
    assert "same path" in out
    results = package.load(tmp_path / "run").results
    [problem_set] = problem_sets_of(results)
    [problem] = problem_set.choice.at(problem_set.world(), [2])
    assert problem.start.tolist() == own(c3d, 0, 2, 0)[2]["start"]
    assert len(problems_data(problem_set, columns(results))["problems"]) == 3


@pytest.mark.usefixtures("in_process_workers")
def test_problems_that_are_written_are_those_that_are_drawn(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "drawn.csv"
    problems = ("problems", "--env", "box", "--problems", 4, "--seed", 3, "--out", file)
    assert bench(*problems)[0] == 0
    drawn = envs.make("box").sample_problems(4, 3)
    read = GivenProblems.read(file).posed
    assert [one.start.tolist() for one in read] == [one.start.tolist() for one in drawn]
    run = ("run", "--planners", "straight-line", "--env", "box")
    assert bench(*run, "--problem-file", file, "--problems", 3, "--out", tmp_path / "a")[0] == 0
    assert bench(*run, "--problems", 3, "--seed", 3, "--out", tmp_path / "b")[0] == 0
    a, b = (records_of(tmp_path / name) for name in "ab")
    assert a["outcome"].tolist() == b["outcome"].tolist()
    assert set(a["problems_seed"]) != set(b["problems_seed"])
    code, _, err = bench("compare", tmp_path / "a", tmp_path / "b")
    assert code == 2
    assert "the problems are not" in err


@pytest.mark.parametrize(
    ("rows", "options", "said"),
    [
        ("0,0,0,1,1\n", (), "row 1 has 5 numbers"),
        ("0,0,1,1\n", (), "row 1: a configuration has 3 numbers, not 2"),
        ("9,9,9,-9,-9,-9\n0,0,0,9,9,9\n", (), "row 2: start: the robot is"),
        ("9,9,9,-9,-9,-9\n9,9,9,-9,-9,-11\n", (), "row 2: goal: coordinate 3 is 1 units beyond"),
        ("9,9,9,-9,-9,-9\n", ("--problems", 2), "has 1 problems, not 2"),
    ],
)
def test_faults_are_one_line_with_the_row(
    bench: Cli, tmp_path: Path, rows: str, options: tuple[object, ...], said: str
) -> None:
    file = tmp_path / "own.csv"
    file.write_text(rows)
    run = ("run", "--env", "box", "--planners", "straight-line", "--problem-file", file, *options)
    code, out, err = bench(*run, "--out", tmp_path / "run")
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    assert said in err
    assert not (tmp_path / "run").exists()


@pytest.mark.usefixtures("in_process_workers")
def test_invalid_ones_are_attempted_if_kept(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text("9,9,9,-9,9,9\n0,0,0,9,9,9\n")
    run = ("run", "--env", "box", "--planners", "straight-line", "--problem-file", file)
    code, _, err = bench(*run, "--out", tmp_path / "run")
    assert code == 2
    assert "--keep-invalid" in err
    assert bench(*run, "--keep-invalid", "--out", tmp_path / "run")[0] == 0
    assert records_of(tmp_path / "run")["outcome"].tolist() == ["VALID", "APPROXIMATE_SOLUTION"]
    code, out, _ = bench("problems", "--env", "box", "--problem-file", file, "--json")
    assert code == 0
    [census] = json.loads(out)
    assert (census["valid"], census["invalid"][0]["index"]) == (1, 1)


def test_out_is_of_one_environment(bench: Cli, tmp_path: Path) -> None:
    code, _, err = bench("problems", "--env", "box,c3d", "--out", tmp_path / "a.csv")
    assert code == 2
    assert "name one" in err
    code, _, err = bench("problems", "--env", "box", "--out", tmp_path / "a.txt")
    assert code == 2
    assert ".csv" in err
