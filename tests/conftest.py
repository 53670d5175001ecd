"""Shared fixtures."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import compile_ahead
import hypothesis
import imported_modules
import pandas as pd
import planners_that_fail
import platformdirs
import psutil
import pytest
from in_process_worker import in_process

import envs
import planners
from bench import cli
from bench.analysis.run_results import RunResults
from bench.execution import supervised_planner
from bench.execution.worker_process import GRACE_S
from envs import Environment
from planners.learning import resumable_map

IMPORTED: pytest.StashKey[set[str]] = pytest.StashKey()
"""By all processes of a run."""

MISSED: pytest.StashKey[list[str]] = pytest.StashKey()
"""Modules that none of them has imported."""

Cli = Callable[..., tuple[int, str, str]]
Refused = Callable[..., str]


def pytest_configure() -> None:
    # Tests run side by side, one on a core: threads that spin while they wait for another's core
    # would take minutes. Set before anything that has threads is imported.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    # What takes longer than usual on a busy machine is no failure.
    hypothesis.settings.register_profile("patient", deadline=None)
    hypothesis.settings.load_profile("patient")
    # For all that tests start, also where they choose another folder for the user's cache.
    kept = platformdirs.user_cache_path("plannerbench") / "compiled"
    os.environ.setdefault("NUMBA_CACHE_DIR", str(kept))
    # The compiler's and the modules' objects are many and stay: to look through them again and
    # again for what can go took a tenth of all tests' time.
    gc.set_threshold(100_000, 50, 100)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Before a run of all tests on several cores, whose processes begin after this."""
    config = session.config
    if is_whole(config) and config.getoption("numprocesses", None):
        compile_ahead.compile_all(
            compile_ahead.ALL if asks_for_slow(config) else compile_ahead.QUICK
        )


def is_whole(config: pytest.Config) -> bool:
    """Whether nobody has chosen some of the tests, but by their marks."""
    from_settings = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    return from_settings and not config.option.keyword and not config.getoption("lf", False)


def asks_for_slow(config: pytest.Config) -> bool:
    return "not" not in config.option.markexpr


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fast tests import every module, or the run has failed."""
    config = session.config
    if hasattr(config, "workeroutput"):  # a process of a run on several cores
        config.workeroutput["imported"] = sorted(imported_modules.imported())
        return
    config.stash.setdefault(IMPORTED, set()).update(imported_modules.imported())
    if is_whole(config) and not asks_for_slow(config) and session.exitstatus == pytest.ExitCode.OK:
        config.stash[MISSED] = imported_modules.never(config.stash[IMPORTED])
        if config.stash[MISSED]:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    told = getattr(node, "workeroutput", {}).get("imported", ())
    node.config.stash.setdefault(IMPORTED, set()).update(told)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    for name in config.stash.get(MISSED, ()):
        terminalreporter.write_line(f"FAILED no fast test imports {name}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest first."""
    items.sort(key=minutes_of, reverse=True)


def minutes_of(item: pytest.Item) -> float:
    """What its file takes, if its mark says so."""
    marks = [mark for name in ("slow", "training") for mark in item.iter_markers(name)]
    return max((mark.kwargs.get("minutes", 0.0) for mark in marks), default=0.0)


def has_data(name: str) -> bool:
    """Whether the folder of real meshes, which tests do without, is there and has a file."""
    folder = os.environ.get("BENCH_DATA")
    return bool(folder) and (Path(folder) / name).is_file()


def records_of(folder: Path) -> pd.DataFrame:
    """What a folder's latest run is about, a row an attempt."""
    return RunResults.read(folder).records


@pytest.fixture(scope="session", autouse=True)
def registries_have_read_what_is_installed() -> None:
    """Before any test installs something, which they would go on to have after it."""
    for registry in (envs.REGISTRY, planners.REGISTRY):
        registry.specs()


@pytest.fixture(scope="session")
def c3d() -> Environment:
    """Scene 0."""
    return envs.make("c3d")


@pytest.fixture
def new_children() -> Callable[[], list[psutil.Process]]:
    """The processes that this one started since the test began, and that are there still."""
    before = psutil.Process().children()
    return lambda: [child for child in psutil.Process().children() if child not in before]


@pytest.fixture
def bench(capfd: pytest.CaptureFixture[str]) -> Cli:
    """The command line, in this process: arguments to exit code, stdout and stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        code = cli.main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return code, out, err

    return call


@pytest.fixture
def refused(bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Refused:
    """The command line with arguments that it must refuse: exit code 2, one line on stderr, which
    is given, and nothing written to the current folder."""

    def call(*arguments: object) -> str:
        folder = tmp_path / "current"
        folder.mkdir(exist_ok=True)
        monkeypatch.chdir(folder)
        code, out, err = bench(*arguments)
        assert code == 2
        assert out == ""
        assert err.startswith("bench: error: ")
        assert err.count("\n") == 1, "one line"
        assert not list(folder.iterdir()), "nothing is written"
        return err

    return call


@pytest.fixture
def faulty(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The names of planners written to misbehave, registered for the length of a test."""
    # Those that hang are not waited for.
    monkeypatch.setattr(supervised_planner, "WARM_UP_GRACE_S", GRACE_S)
    for spec in planners_that_fail.SPECS:
        planners.REGISTRY.register(spec)
    yield [spec.id for spec in planners_that_fail.SPECS]
    for spec in planners_that_fail.SPECS:
        planners.REGISTRY.unregister(spec.id)


@pytest.fixture
def in_process_workers() -> Iterator[None]:
    """Planners plan in this process."""
    with in_process():
        yield


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work that is spread over processes is done in this one: starting some would take longer."""

    class Pool:
        def __init__(self, processes: int, *, initargs: tuple[Any, ...], **_: object) -> None:
            make, arguments = initargs
            monkeypatch.setattr(resumable_map, "_work", make(*arguments))

        def __enter__(self) -> Pool:
            return self

        def __exit__(self, *error: object) -> None:
            pass

        def map(self, function: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[Any]:
            return map(function, items)

    monkeypatch.setattr(resumable_map, "ProcessPoolExecutor", Pool)
