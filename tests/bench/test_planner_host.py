"""Strangers' planners are imported in processes of their own, never in the one that judges."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import plugins
import psutil
import pytest
from conftest import Cli, Refused, records_of

import envs
import planners
from bench.execution import planner_queries as queries
from bench.execution.planner_host import PlannerHost, hosting
from bench.execution.planner_queries import PlannerError, World
from envs import Environment, InputError, Registry
from envs.registry import Entry
from planners import Planner

WHERE = """
import os
import pathlib

with (pathlib.Path(__file__).parent / "imported_by").open("a") as told:
    told.write(f"{os.getpid()}\\n")
"""

MEDDLES = """
import numpy as np
import bench.judging.judge
import envs.collision.continuous

np.linalg.norm = lambda *a, **k: 0.001
np.cumsum = np.sum = np.min = np.max = lambda *a, **k: 0.001
bench.judging.judge.Judge.__call__ = lambda *a: None
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "mine.py"
    made.write_text(WHERE + plugins.PLANNER)
    return made


def imported_by(folder: Path) -> set[int]:
    """The processes that have imported the planner, since the last time this was asked."""
    said = folder / "imported_by"
    found = {int(line) for line in said.read_text().split()}
    said.unlink()
    return found


def small_run(folder: Path, *planners: str) -> tuple[object, ...]:
    return (
        *("run", "--env", "c3d", "--problems", 4, "--stop", "first", "--seed", 3),
        *("--planners", ",".join(planners), "--out", folder),
    )


@pytest.mark.slow
def test_no_command_imports_them_in_the_process_that_judges(
    bench: Cli, file: Path, tmp_path: Path
) -> None:
    run, mine = tmp_path / "run", ("--planner-file", file)
    commands: list[tuple[object, ...]] = [
        (*small_run(run, "straight:bends=2", "rrtconnect"), *mine),
        ("list", "planners", *mine),
        ("replay", run, "--planner", "straight:bends=2", "--problem", 1, *mine),
        ("compare", run, "--planners", "straight:bends=2,rrtconnect", *mine),
        ("check", run, "--baseline", tmp_path / "base.json", "--update", *mine),
        ("test-planner", f"{file}:Straight", "--time-limit", 0.2),
    ]
    for command in commands:
        code, _, err = bench(*command)
        assert code in (0, 1), err
        assert os.getpid() not in imported_by(tmp_path), command
    assert not any(getattr(m, "__file__", None) == str(file) for m in sys.modules.values())


@pytest.mark.slow
def test_nothing_that_one_changes_reaches_the_judge(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "meddles.py"
    file.write_text(MEDDLES + plugins.PLANNER)
    code, _, err = bench(*small_run(tmp_path / "run", "straight", "straight-line"), *_files(file))
    assert code == 0, err
    columns = ["length", "safety_margin", "solved"]
    by_planner = records_of(tmp_path / "run").set_index("problem").groupby("planner")
    mine, theirs = (by_planner.get_group(name) for name in ("straight", "straight-line"))
    solved = theirs["solved"] == 1
    assert 0 < solved.sum() < 4
    assert mine["outcome"].tolist() == ["VALID" if one else "COLLISION" for one in solved]
    assert mine[columns][solved].equals(theirs[columns][solved])


def _files(*files: Path) -> list[object]:
    return [word for file in files for word in ("--planner-file", file)]


def install_beside(own: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes one planner of ours and `plain`, of an installed package, the only ones there are."""
    spec = planners.REGISTRY.entry(own).spec  # before, as this imports what is installed
    text = 'PLAIN = Spec("plain", "pack:Straight", "a plug-in", groups=("mine",))\n'
    plugins.install(
        folder, "pack", WHERE + plugins.PLANNER + text, {"bench.planners p": "pack:PLAIN"}
    )
    monkeypatch.syspath_prepend(folder)
    known = Registry[Planner]("planner", [spec], "bench.planners", Planner)
    monkeypatch.setattr(planners, "REGISTRY", known)


@pytest.mark.slow
def test_an_installed_one_is_imported_elsewhere_too(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_beside("rrtconnect", tmp_path, monkeypatch)
    code, out, err = bench("list", "planners", "--json")
    assert code == 0, err
    [_, listed] = json.loads(out)["planners"]
    assert (listed["id"], listed["origin"], listed["groups"]) == ("plain", "pack", ["mine"])
    assert bench(*small_run(tmp_path / "run", "all"))[0] == 0
    assert os.getpid() not in imported_by(tmp_path)
    assert set(records_of(tmp_path / "run")["planner"]) == {"rrtconnect", "plain"}


@pytest.mark.slow
def test_so_is_one_that_an_argument_of_ours_names(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_beside("mpnet", tmp_path, monkeypatch)
    code, _, err = bench(*small_run(tmp_path / "run", "mpnet:fallback=plain"))
    assert code == 0, err
    assert os.getpid() not in imported_by(tmp_path)
    assert set(records_of(tmp_path / "run")["planner"]) == {"mpnet:fallback=plain"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import os\nos._exit(7)", "exited with code 7"),
        ("import os\nprint('last words', flush=True)\nos._exit(0)", "code 0: last words"),
        ("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)", "died of SIGKILL"),
        ("import os\nos.closerange(3, 256)\nraise SystemExit", "imports planners to ask them"),
        (
            "import gc, socket\n"
            "[one.sendall(bytes(64)) for one in gc.get_objects() if type(one) is socket.socket]",
            "sent what is no message",
        ),
    ],
    ids=["exit", "exit 0", "killed", "hangs up", "nonsense"],
)
def test_one_that_ends_its_process_is_refused_in_a_line(
    refused: Refused, tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "ends.py"
    file.write_text(text)
    assert said in refused("list", "planners", "--planner-file", file)


@pytest.fixture
def hosted(file: Path) -> Iterator[Entry[Planner]]:
    """The file's planner, asked in another process."""
    with hosting(), planners.user_plugins.registered([file]):
        yield planners.REGISTRY.entry("straight:bends=2")


def test_queries_are_answered_as_in_this_process(
    hosted: Entry[Planner], c3d: Environment, file: Path
) -> None:
    world = World(envs.REGISTRY.entry("c3d"), c3d)
    assert hosted.id == "straight:bends=2"
    assert queries.improves(hosted) is True
    assert queries.is_learned(hosted) is False
    assert queries.takes_device(hosted) is False
    assert queries.unsupported(hosted, world) is None
    assert queries.weights_digest(hosted, world) == ""
    assert queries.minutes_of_training(hosted, world) == 0.0
    assert os.getpid() not in imported_by(file.parent)
    assert hosted.imported().arguments == {"bends": 2}
    assert hosted.imported().id == hosted.id


FAILS = f"""{plugins.PLANNER}
    def unsupported(self, env):
        raise KeyError("which?")

    def weights_digest(self, env):
        return ["a", {{}}]


class Improves(Straight):
    improves = property(lambda self: print(1 / 0))
"""


def test_one_that_fails_is_refused_and_says_where(c3d: Environment, tmp_path: Path) -> None:
    file, world = tmp_path / "fails.py", World(envs.REGISTRY.entry("c3d"), c3d)
    file.write_text(FAILS)
    with hosting(), planners.user_plugins.registered([file]):
        straight, improves = map(planners.REGISTRY.entry, ("straight", "improves"))
        with pytest.raises(PlannerError, match="straight failed: KeyError: 'which") as raised:
            queries.unsupported(straight, world)
        assert 'fails.py", line' in raised.value.traceback
        with pytest.raises(PlannerError, match="improves failed: ZeroDivisionError"):
            queries.improves(improves)
        with pytest.raises(InputError, match="straight has no argument 'bend'; did you mean"):
            planners.REGISTRY.entry("straight:bend=2")
        with pytest.raises(InputError, match="'x' is not of type int"):
            planners.REGISTRY.entry("straight:bends=x")


@pytest.mark.slow
def test_one_that_says_it_is_ours_is_still_imported_elsewhere(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "sly.py"
    lie = "import envs.registry.spec as s\ns.Spec.data = property(lambda self: vars(self) | LIE)\n"
    file.write_text(f"{WHERE}LIE = {{'origin': ''}}\n{lie}{plugins.PLANNER}")
    code, _, err = bench(*small_run(tmp_path / "run", "straight"), *_files(file))
    assert code == 0, err
    assert os.getpid() not in imported_by(tmp_path)


def test_another_environment_in_that_process_is_noticed(
    hosted: Entry[Planner], c3d: Environment
) -> None:
    other = World(envs.REGISTRY.entry("c3d:scene=1"), c3d)
    with pytest.raises(InputError, match="c3d:scene=1 is not the same environment in every"):
        queries.unsupported(hosted, other)


def test_it_is_asked_by_many_threads_and_ends_with_the_context(
    file: Path, new_children: Callable[[], list[psutil.Process]]
) -> None:
    with hosting(), planners.user_plugins.registered([file]):
        entry = planners.REGISTRY.entry("straight")
        answers: list[bool] = []
        threads = [
            threading.Thread(target=lambda: answers.append(queries.improves(entry)))
            for _ in range(8)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert answers == [True] * 8
        [child] = new_children()
        assert child.pid in imported_by(file.parent)
    assert not new_children()
    assert queries.improves(entry) is True, "asked in this process, where nothing is measured"
    assert os.getpid() in imported_by(file.parent)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)]
)
def test_it_ends_with_a_command_that_ends_while_a_file_is_imported(
    tmp_path: Path, number: signal.Signals
) -> None:
    file = tmp_path / "sleeps.py"
    file.write_text(WHERE + "import time\ntime.sleep(300)\n")
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "from bench.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = subprocess.Popen(
        [sys.executable, "-c", code, "list", "--planner-file", str(file)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline, said = time.monotonic() + 60, tmp_path / "imported_by"
    while not (said.exists() and said.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    [pid] = imported_by(tmp_path)
    host = psutil.Process(pid)
    command.send_signal(number)
    assert command.wait(timeout=30) == (130 if number == signal.SIGINT else -9)
    _, left = psutil.wait_procs([host], timeout=20)
    assert not left


def test_nothing_is_started_where_nobody_is_strange(
    bench: Cli, new_children: Callable[[], list[psutil.Process]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PlannerHost, "ask", lambda *a: pytest.fail("a process was asked"))
    assert bench("list")[0] == 0
    assert not new_children()


LEARNED = """
import logging
import os

import numpy as np
from planners import PlannerResult, Status
from planners.learning.learned_planner import LearnedPlanner, Trained


class Learns(LearnedPlanner):
    def __init__(self, rate: float = 0.5, device: str = "cpu"):
        super().__init__("learns", device=device)
        self.rate = rate

    def train(self, env, how):
        logging.getLogger("learns").warning("rate %s", self.rate)
        print("this goes to nobody's terminal")
        if self.rate > 1:
            raise ValueError("diverged")
        return Trained({"number": np.array([self.rate, os.getpid()])}, {}, 1.0, 2.0)

    def expected_minutes(self, env):
        return 0.01

    def fitted(self, env, tensors):
        return tensors["number"].tolist()

    def load(self, env, tensors):
        self.number = self.fitted(env, tensors)

    def solve(self, problem, budget):
        stats = {"rate": self.number[0], "pid": self.number[1]}
        return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal], stats)
"""


@pytest.fixture
def learner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = tmp_path / "learns.py"
    file.write_text(WHERE + LEARNED)
    return file


@pytest.mark.training
def test_a_strangers_network_is_trained_there_before_a_run(
    bench: Cli, learner: Path, tmp_path: Path
) -> None:
    run = small_run(tmp_path / "run", "learns:rate=0.25")
    code, out, err = bench(*run, "--no-train", *_files(learner))
    assert code == 3, err
    assert "`bench train --env c3d --planner learns` makes some" in out
    code, out, err = bench(*run, *_files(learner))
    assert code == 0, err
    assert "rate 0.25" in err
    assert "nobody's terminal" not in out + err
    said = [json.loads(stats) for stats in records_of(tmp_path / "run")["stats"]]
    assert [one["rate"] for one in said] == [0.25] * 4
    assert os.getpid() not in {int(one["pid"]) for one in said} | imported_by(tmp_path)
    assert set(records_of(tmp_path / "run")["train_s"]) == {3.0}


@pytest.mark.training
def test_a_training_that_fails_there_is_the_outcome_of_every_problem(
    bench: Cli, learner: Path, tmp_path: Path
) -> None:
    run = small_run(tmp_path / "run", "learns:rate=2")
    code, _, err = bench(*run, *_files(learner))
    assert code == 0, err
    assert "training learns:rate=2.0 failed: ValueError: diverged" in err
    errors = records_of(tmp_path / "run")["error"]
    assert errors.str.contains("ValueError: diverged").all()
    assert errors.str.contains("learns.py").all()


def test_training_by_command_takes_the_arguments(bench: Cli, learner: Path, tmp_path: Path) -> None:
    train = ("train", "--env", "c3d", "--planner", "learns:rate=0.75")
    code, out, err = bench(*train, *_files(learner), "--out", tmp_path / "w.safetensors")
    assert code == 0, err
    assert out.strip() == f"this goes to nobody's terminal\n{tmp_path / 'w.safetensors'}"
    assert "rate 0.75" in err
