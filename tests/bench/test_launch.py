"""What workers start with: no modules, variables or folders but the command's, and no company."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import plugins
import psutil
import pytest
from conftest import Cli, records_of

import envs
from bench.analysis.run_results import RunResults
from bench.execution import launch
from bench.execution import runner as bench_runner
from bench.execution import session as bench_session
from bench.execution.process_group import CAN_PAUSE
from bench.judging import judge as bench_judge
from bench.storage import record as bench_record
from envs import Environment, Registry
from envs.scenes.cluttered import Cluttered3D

FEW = ("run", "--env", "c3d", "--problems", 2, "--stop", "first")

MEDDLES = '''
import os
import sys
import tempfile

os.environ["NUMBA_DISABLE_JIT"] = "1"
os.environ.pop("KEPT_BY_ALL", None)
sys.path.insert(0, os.path.dirname(__file__))
os.chdir(tempfile.gettempdir())

from planners import Planner, PlannerResult, Status


class Meddles(Planner):
    """Changes what others would start with."""

    def solve(self, problem, budget):
        return PlannerResult(Status.TIMEOUT)
'''

TELLS = """
import os
import sys

from planners import Planner, PlannerResult, Status


class Tells(Planner):
    def solve(self, problem, budget):
        names = ["NUMBA_DISABLE_JIT", "KEPT_BY_ALL"]
        told = {name: os.environ.get(name) for name in names}
        return PlannerResult(
            Status.TIMEOUT, None, told | {"path": sys.path, "folder": os.getcwd()}
        )
"""


@pytest.mark.slow
def test_modules_beside_the_user_are_not_meant(tmp_path: Path) -> None:
    for name in ("json", "signal", "numpy", "bench", "selectors"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the one beside the user')\n")
    code = "from bench.cli.app import main; raise SystemExit(main())"
    command = [*map(str, FEW), "--planners", "rrtconnect", "--out", "out"]
    ran = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.remove(''); {code}", *command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert records_of(tmp_path / "out")["outcome"].tolist() == ["VALID"] * 2


@pytest.mark.parametrize(
    ("path", "safe"),
    [
        (["/here", "/lib", "/lib/site-packages"], ["/lib", "/lib/site-packages", "/here"]),
        (["/venv/bin", "/lib", "/here"], ["/venv/bin", "/lib", "/here"]),
        (["/here", "/lib", "/here"], ["/lib", "/here"]),
        ([], []),
    ],
)
def test_the_current_folder_is_the_last_that_modules_come_from(
    path: list[str], safe: list[str]
) -> None:
    assert launch._safe(path, "/here") == safe


def test_ours_are_found_where_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch, "__file__", "/here/bench/execution/launch.py")
    path = ["/here", "/lib", "/lib/site-packages"]
    assert launch._safe(path, "/here") == ["/lib", "/here", "/lib/site-packages"]


@pytest.mark.slow
def test_what_one_file_changes_does_not_reach_the_workers_of_others(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KEPT_BY_ALL", "1")
    monkeypatch.setenv("OMP_WAIT_POLICY", "passive")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meddles.py").write_text(MEDDLES)
    (tmp_path / "tells.py").write_text(TELLS)
    before, path = dict(os.environ), list(sys.path)
    try:
        code, _, err = bench(
            *(*FEW, "--planners", "tells", "--out", tmp_path / "out"),
            *("--planner-file", tmp_path / "meddles.py"),
            *("--planner-file", tmp_path / "tells.py"),
        )
    finally:
        os.environ.clear()
        os.environ.update(before)
        sys.path[:] = path
        os.chdir(tmp_path)
    assert code == 0, err
    run = RunResults.read(tmp_path / "out")
    for said in run.records["stats"].map(json.loads):
        assert said["NUMBA_DISABLE_JIT"] is None
        assert said["KEPT_BY_ALL"] == "1"
        assert str(tmp_path) not in said["path"]
        assert Path(said["folder"]) == tmp_path
    [session] = run.sessions
    assert session["speed_variables"]["OMP_WAIT_POLICY"] == "passive"
    assert "NUMBA_DISABLE_JIT" not in session["speed_variables"]


@pytest.mark.slow
@pytest.mark.skipif(not CAN_PAUSE, reason="needs a system that tells of a parent's death")
def test_idle_workers_are_stopped_and_end_with_a_harness_that_is_killed(tmp_path: Path) -> None:
    harness = subprocess.Popen(
        [
            *(sys.executable, "-m", "bench", *map(str, FEW[:3]), "--problems", "1000"),
            *("--planners", "rrtconnect,rrtconnect:range=2", "--stop", "first"),
            *("--out", str(tmp_path / "out")),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        workers = _both_started(psutil.Process(harness.pid))
        seen = set()
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and len(seen) < 2:
            stopped = [w.pid for w in workers if w.status() == psutil.STATUS_STOPPED]
            seen |= set(stopped)
            time.sleep(0.002)
        assert len(seen) == 2, "each is stopped while the other plans"
        _until(lambda: any(w.status() == psutil.STATUS_STOPPED for w in workers))
        harness.send_signal(signal.SIGKILL)
        harness.wait()
        _, left = psutil.wait_procs(workers, timeout=20)
        assert not left, "a worker that is stopped must hear that its parent is gone"
    finally:
        harness.kill()
        harness.wait()


def _both_started(harness: psutil.Process) -> list[psutil.Process]:
    _until(lambda: len(harness.children()) >= 2)
    return harness.children()


def _until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        if holds():
            return
        time.sleep(0.002)
    raise AssertionError("it does not come to that")


CHANGES = {
    "the judge": "import bench.judging.judge\nbench.judging.judge.Judge.__call__ = lambda *a: None",
    "its module": "import bench.execution.session\nbench.execution.session.Judge = object",
    "its code": "from bench.judging.judge import Judge\n"
    "def f(self, problem, path): pass\nJudge.__call__.__code__ = f.__code__",
    "a constant": "import bench.storage.record\nbench.storage.record.LATE = 'VALID'",
    "the clock": "import bench.execution.runner\nbench.execution.runner.monotonic = lambda: 0.0",
    "what is imported later": "from envs.scenes.cluttered import Cluttered3D\n"
    "Cluttered3D.clearance = lambda self, q: None",
    "when it is made": "CHANGES_WHEN_MADE = True",
}

WORLD = """
import bench.judging.judge

from envs import Spec
from envs.scenes.boxes import SingleBox


class Changed(SingleBox):
    def __init__(self):
        if "CHANGES_WHEN_MADE" in globals():
            bench.judging.judge.Judge.__call__ = lambda *a: None
        super().__init__()


WORLD = Spec("changed", "{name}:Changed", "a world")
"""


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_no_package_with_environments_changes_the_benchmark(
    bench: Cli, change: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for whose, name in (
        (bench_judge.Judge, "__call__"),
        (bench_judge.Judge.__call__, "__code__"),
        (bench_record, "LATE"),
        (bench_session, "Judge"),
        (bench_runner, "monotonic"),
        (Cluttered3D, "clearance"),
    ):
        monkeypatch.setattr(whose, name, getattr(whose, name))  # put back in the end
    name = f"changes_{tmp_path.name}"  # another for each, as modules stay imported
    text = f"{change}\n{WORLD.replace('{name}', name)}"
    plugins.install(tmp_path, name, text, {"bench.envs changed": f"{name}:WORLD"})
    monkeypatch.syspath_prepend(tmp_path)
    known = Registry[Environment](
        "environment", [envs.REGISTRY.entry("c3d").spec], "bench.envs", Environment
    )
    monkeypatch.setattr(envs, "REGISTRY", known)
    code, _, err = bench(
        *("run", "--env", "changed", "--problems", 2, "--stop", "first"),
        *("--planners", "rrtconnect", "--out", tmp_path / "out"),
    )
    assert code == 2
    assert "was changed by a package with environments" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()
