"""Files of paths: what they say is read to the last bit, and what is wrong with one is said."""

from __future__ import annotations

import json
import math
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documents import block_after
from hypothesis import given
from hypothesis import strategies as st

import envs
import planners
from envs import Environment, InputError, Problem
from planners import Budget, Status
from planners.ompl import parameters
from planners.ompl.state_space import StateSpace
from planners.recorded import path_file
from planners.recorded.path_file import PathFile, RecordedPath

SUFFIXES = (".csv", ".json", ".npz", ".txt")
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
STATUSES = [status for status in Status if status is not Status.EXACT_SOLUTION]


@st.composite
def files(draw: st.DrawFn) -> PathFile:
    """Of at least one path, with problems in any order."""
    size = draw(st.integers(1, 8))
    waypoint = st.lists(NUMBERS, min_size=size, max_size=size)
    problems = draw(st.lists(st.integers(0, 10**6), min_size=1, max_size=4, unique=True))
    paths = []
    for problem in problems:
        solve_s = draw(st.none() | st.floats(0, 1e6))
        if draw(st.booleans()):
            path = np.array(draw(st.lists(waypoint, min_size=2, max_size=5)))
            paths.append(RecordedPath(path, problem, solve_s, draw(st.sampled_from(Status))))
        else:
            why = draw(st.text(st.characters(codec="utf-8"), max_size=20))
            why = "".join(c if c.isprintable() else " " for c in why)
            why = " ".join(why.split())  # a line, in which spaces stand alone
            paths.append(RecordedPath(None, problem, solve_s, draw(st.sampled_from(STATUSES)), why))
    return PathFile(
        tuple(paths), draw(st.sampled_from(["", "7e7d5e2e"])), draw(st.none() | st.integers(0, 99))
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("paths")


@pytest.mark.parametrize("suffix", SUFFIXES)
@given(written=files())
def test_what_is_written_is_read_to_the_last_bit(
    suffix: str, folder: Path, written: PathFile
) -> None:
    file = folder / f"paths{suffix}"
    path_file.write(written, file)
    found = path_file.read(file)
    assert (found.environment, found.seed) == (written.environment, written.seed)
    for a, b in zip(found.paths, written.paths, strict=True):
        assert (a.problem, a.solve_s, a.status, a.failure.strip()) == (
            b.problem,
            b.solve_s,
            b.status,
            b.failure.strip(),
        )
        if b.waypoints is None:
            assert a.waypoints is None
        else:
            assert a.waypoints is not None
            assert a.waypoints.tobytes() == b.waypoints.tobytes(), "also the sign of zero"


def npz(**arrays: Any) -> bytes:
    file = BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


TWO = [[0.0, 1.0], [2.0, 3.0]]
NO_ZIP = b"PK\x03\x04 broken"

MALFORMED = {
    # JSON
    ("a.json", b""): "line 1: it is no JSON",
    ("b.json", b"{"): "line 1: it is no JSON",
    ("c.json", b"\xff"): "byte 0 is no text in UTF-8",
    ("d.json", b"7"): "a list of waypoints, or an object with paths",
    ("e.json", b'{"paths": []}'): "it holds no paths",
    ("f.json", b"[]"): "it has no waypoints",
    ("g.json", b"[[1, 2]]"): "waypoint 0: a path of one waypoint",
    ("h.json", b"[[1, 2], [NaN, 2]]"): "waypoint 1 holds NaN",
    ("i.json", b"[[1, 2], [1e999, 2]]"): "waypoint 1 holds NaN or an infinite",
    ("j.json", b"[[1, 2], [3]]"): "waypoint 1 has 1 numbers, the first has 2",
    ("k.json", b'[[1, 2], ["3", 2]]'): "waypoint 1: '3' is no number",
    ("l.json", b"[[1, 2], [true, 2]]"): "waypoint 1: True is no number",
    ("m.json", b"[[], []]"): "no coordinates",
    ("n.json", b'{"paths": [{"waypoint": [[1], [2]]}]}'): "did you mean 'waypoints'?",
    ("o.json", b'{"path": [{"waypoints": [[1], [2]]}]}'): "an object with paths",
    ("p.json", b'{"sed": 1, "paths": [{"problem": 1}]}'): "did you mean 'seed'?",
    ("q.json", b'{"paths": [{"problem": -1}]}'): "paths[0]: problem is a whole number from 0",
    ("r.json", b'{"paths": [{"problem": 1.5}]}'): "problem is a whole number",
    ("s.json", b'{"paths": [{"problem": 1, "solve_s": -1}]}'): "solve_s is a number of seconds",
    ("t.json", b'{"paths": [{"problem": 1, "solve_s": NaN}]}'): "solve_s is a number of seconds",
    ("u.json", b'{"paths": [{"problem": 1, "status": "TIMEDOUT"}]}'): "did you mean 'TIMEOUT'",
    ("v.json", b'{"paths": [{"problem": 1, "problem": 2}]}'): "'problem' is given twice",
    ("w.json", b'{"paths": [{"waypoints": [[1], [2]]}, {"waypoints": [[1, 2], [2, 3]]}]}'): (
        "paths[1]: waypoints have 2 numbers, those of paths[0] 1"
    ),
    ("x.json", b"[" * 100_000): "nested too deep",
    ("y.json", b'{"paths": [3]}'): "paths[0] is an object",
    ("z.json", b'{"environment": 3, "paths": [{"problem": 1}]}'): "environment is a fingerprint",
    # CSV
    ("a.csv", b""): "it holds no paths",
    ("b.csv", b"q1,q2\n"): "it holds no paths",
    ("c.csv", b"q1,q2\n1,2\n3\n"): "line 3 has 1 columns, the first 2",
    ("d.csv", b"q1,q2\n1,2\n3,x\n"): "line 3: q2 'x' is no number",
    ("e.csv", b"q1,q2\n1,2\n3,nan\n"): "line 3 holds NaN",
    ("f.csv", b"q1,q2\n1,2\n3,\n"): "line 3: q2 '' is no number",
    ("g.csv", b"q1,q2\n1,2\n"): "line 2: a path of one waypoint",
    ("h.csv", b"problm,q1\n1,2\n"): "line 1: unknown column 'problm'; did you mean 'problem'",
    ("i.csv", b"x,y\n1,2\n3,4\n"): "coordinates are q1, q2",
    ("j.csv", b"problem\n1\n"): "no columns q1, q2",
    ("k.csv", b"problem,problem,q1\n1,1,2\n"): "the column problem is there twice",
    ("l.csv", b"problem,q1\n1,1\n1,2\n2,1\n2,2\n1,3\n"): "line 6 goes on with a path",
    ("m.csv", b"problem,solve_s,q1\n1,2,1\n1,3,2\n"): "line 3: another solve_s than in line 2",
    ("n.csv", b"problem,q1\nx,1\n"): "line 2: problem 'x' is no number",
    ("o.csv", b"problem,q1\n1.5,1\n1.5,2\n"): "line 2: problem is a whole number",
    ("p.csv", b"# sed: 1\nq1\n1\n2\n"): "line 1: unknown 'sed'; did you mean 'seed'?",
    ("q.csv", b"q1,status\n1,FOUND\n2,\n"): "line 2: unknown status 'FOUND'",
    ("r.csv", b"1,2\n3,4,5\n"): "line 2 has 3 numbers, the first has 2",
    ("s.csv", b"1,2\n3,inf\n"): "line 2 holds NaN or an infinite number",
    ("t.csv", b'q1,q2\n"1,2\n'): "line 2: unexpected end of data",
    ("u.csv", b"q1,q2\n,\n"): "line 2 is empty",
    ("v.csv", b"q1,q2\n1_0,2\n1,2\n"): "line 2: q1 '1_0' is no number",
    # OMPL's matrices
    ("a.txt", b"\n\n"): "it holds no paths",
    ("b.txt", b"1 2\n3 x\n"): "line 2: 'x' is no number",
    ("c.txt", b"1 2\n3\n"): "line 2 has 1 numbers, the first has 2",
    ("d.txt", b"1 2\n\n3 4\n"): "line 1: a path of one waypoint",
    ("e.txt", b"1 2\n3 nan\n"): "line 2 holds NaN",
    ("f.txt", b"# problm: 3\n1 2\n3 4\n"): "line 1: unknown 'problm'; did you mean 'problem'",
    ("g.txt", b"# problem: three\n1 2\n3 4\n"): "line 1: problem 'three' is no number",
    ("h.txt", b"1 2\n# problem: 3\n3 4\n"): "line 2: problem is said twice, or too late",
    ("i.txt", b"# seed: 3\n# seed: 3\n1 2\n3 4\n"): "line 2: seed is said twice",
    ("j.txt", b"\x00\x01"): "is no number",
    # NumPy's
    ("a.npz", b""): "no file of NumPy's arrays",
    ("b.npz", NO_ZIP): "no file of NumPy's arrays",
    ("c.npz", npz(path=TWO)): "unknown array 'path'",
    ("d.npz", npz(problem=[1])): "no array waypoints",
    ("e.npz", npz(waypoints=[1.0, 2.0])): "waypoints has shape (2,)",
    ("f.npz", npz(waypoints=[["a"], ["b"]])): "waypoints has shape (2, 1) and type <U1",
    ("g.npz", npz(waypoints=np.array([[None]]))): "no file of NumPy's arrays",
    ("h.npz", npz(waypoints=TWO, lengths=[1])): "lengths do not add up",
    ("i.npz", npz(waypoints=TWO, lengths=[3, -1])): "lengths do not add up",
    ("j.npz", npz(waypoints=TWO, lengths=[1, 1])): "path 0, waypoint 0: a path of one",
    ("k.npz", npz(waypoints=TWO, problem=[1, 2])): "problem has 2 entries for 1 paths",
    ("l.npz", npz(waypoints=[[1.0], [math.nan]])): "path 0, waypoint 1 holds NaN",
    ("m.npz", npz(waypoints=TWO, status=["NO"])): "path 0: unknown status 'NO'",
    ("n.npz", npz(waypoints=TWO, problem=[1.5])): "problem has shape (1,) and type float64",
    ("o.npz", npz(waypoints=np.zeros((0, 2)), lengths=np.zeros(0, int))): "it holds no paths",
    ("p.npz", npz(waypoints=np.zeros((0, 2)))): "path 0",
}


@pytest.mark.parametrize(("name", "content"), MALFORMED, ids=lambda value: str(value)[:20])
def test_what_is_wrong_is_said_with_its_place(name: str, content: bytes, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(InputError) as refused:
        path_file.read(file)
    assert str(refused.value).startswith(f"{file}: ")
    assert MALFORMED[name, content] in str(refused.value)


def test_a_name_says_the_format_and_a_file_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.csv, \.json, \.npz, \.txt"):
        path_file.read(tmp_path / "paths.yaml")
    with pytest.raises(InputError, match=r"cannot read .*: No such file"):
        path_file.read(tmp_path / "paths.csv")
    nothing = PathFile((RecordedPath(None, 0, status=Status.TIMEOUT),))
    with pytest.raises(InputError, match=r"cannot write .*: No such file"):
        path_file.write(nothing, tmp_path / "none" / "paths.csv")


def test_a_file_that_unpacks_to_too_much_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planners.recorded.npz_format.MOST_BYTES", 1000)
    file = tmp_path / "big.npz"
    np.savez_compressed(file, waypoints=np.zeros((1000, 3)))
    with pytest.raises(InputError, match="it unpacks to 24"):
        path_file.read(file)
    monkeypatch.setattr(path_file, "MOST_BYTES", 10)
    with pytest.raises(InputError, match="10 are the most"):
        path_file.read(file)


def test_a_path_alone_is_a_file_of_one(tmp_path: Path) -> None:
    """As the simplest program writes it, in each format; OMPL ends a matrix with an empty line."""
    contents = {
        "a.json": b"[[0, 1], [2, 3]]",
        "a.csv": b"0,1\r\n2,3\r\n",
        "b.csv": b"\xef\xbb\xbfq1,q2\n0,1\n2,3\n",
        "a.txt": b"0 1 \n2 3 \n\n",
        "a.npz": npz(waypoints=np.array(TWO, dtype=np.float32)),
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
        [path] = path_file.read(tmp_path / name).paths
        assert path.waypoints is not None
        assert path.waypoints.tolist() == TWO, name
        assert (path.problem, path.solve_s, path.status) == (None, None, Status.EXACT_SOLUTION)


@pytest.mark.parametrize("space", ["se2", "se3", "r3"])
def test_what_ompl_prints_is_read(space: str, tmp_path: Path) -> None:
    """To the six digits that it prints unless told to print more."""
    env = envs.make(f"rigid:body=piano,space={space},world=c3d")
    _, geometric, _ = parameters.load()
    states = StateSpace(env.space)
    information = states.information()  # OMPL's paths do not keep it alive
    information.setup()
    path = geometric.PathGeometric(information)
    q = env.space.sample(np.random.default_rng(1), 3)
    kept = [states.state(one) for one in q]
    for state in kept:
        path.append(state())
    file = tmp_path / "printed.txt"
    file.write_text(2 * path.printAsMatrix())
    for found in path_file.read(file).paths:
        assert found.waypoints is not None
        off = env.space.distance(found.waypoints, q)
        assert (off < 1e-4).all()
        assert (off > 0).any(), "so that its ends are not where they should be"


def test_the_examples_of_the_page_say_the_same(tmp_path: Path) -> None:
    examples = {
        ".json": block_after("paths: json"),
        ".csv": block_after("paths: csv"),
        ".txt": block_after("paths: txt"),
    }
    for suffix, text in examples.items():
        file = tmp_path / f"example{suffix}"
        file.write_text(text, encoding="utf-8")
        found, none = path_file.read(file).paths
        assert found.waypoints is not None
        assert found.waypoints.tolist() == [[1, 2, 3], [4, 5, 6]]
        assert (found.problem, found.solve_s) == (3, 0.012)
        assert (none.problem, none.waypoints, none.status) == (4, None, Status.TIMEOUT)


def recorded(file: Path, said: Any) -> planners.Planner:
    file.write_text(json.dumps(said))
    return planners.make(f"recorded:file={file}")


def test_it_gives_what_the_file_has_for_a_problem(tmp_path: Path, c3d: Environment) -> None:
    ends = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    said = {
        "environment": c3d.fingerprint,
        "paths": [
            {"problem": 3, "waypoints": ends, "solve_s": 0.25},
            {"problem": 0, "status": "INFEASIBLE", "failure": "no\nway"},
            {"problem": 1, "waypoints": ends, "status": "APPROXIMATE_SOLUTION"},
        ],
    }
    planner = recorded(tmp_path / "paths.json", said)
    planner.setup(c3d, seed=1)
    problems = [Problem(np.zeros(3), np.ones(3), index) for index in range(4)]
    results = [planner.solve(problem, Budget(math.inf)) for problem in problems]
    assert [result.status.value for result in results] == [
        "INFEASIBLE",
        "APPROXIMATE_SOLUTION",
        "TIMEOUT",
        "EXACT_SOLUTION",
    ]
    assert [result.path is None for result in results] == [True, False, True, False]
    assert results[3].path.tolist() == ends
    assert [result.stats for result in results] == [
        {"failure": "no way"},
        {},
        {"failure": "the file has no path for it"},
        {"claimed_solve_s": 0.25},
    ]


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"environment": "abc", "paths": [{"problem": 0}]}, "fingerprint abc, and this one's is"),
        ([[1.0, 2.0], [3.0, 4.0]], "waypoints have 2 numbers, and configurations here 3"),
        ([[1.0, 2.0, 3.0]] * 2, "the path does not say for which problem it is"),
        ({"paths": [{"problem": 2}, {"problem": 2}]}, r"paths\[1\] and paths\[0\] are both for"),
    ],
)
def test_what_is_not_for_the_environment_is_refused_before_anything_runs(
    tmp_path: Path, c3d: Environment, said: Any, why: str
) -> None:
    planner = recorded(tmp_path / "paths.json", said)
    with pytest.raises(InputError, match=why):
        planner.weights_digest(c3d)
    with pytest.raises(InputError, match=why):
        planner.setup(c3d, seed=1)


def test_its_digest_is_the_files(tmp_path: Path, c3d: Environment) -> None:
    one = recorded(tmp_path / "a.json", {"paths": [{"problem": 0}]}).weights_digest(c3d)
    same = recorded(tmp_path / "b.json", {"paths": [{"problem": 0}]}).weights_digest(c3d)
    other = recorded(tmp_path / "a.json", {"paths": [{"problem": 1}]}).weights_digest(c3d)
    assert one == same != other
