"""How many cores there are for this process, which may be fewer than the machine has."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from envs import processors

LINUX = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no affinity here")


@pytest.fixture
def system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A made-up machine: four cores of two logical processors each, all of which may be used."""
    for cpu in range(8):
        folder = tmp_path / f"cpus/cpu{cpu}/topology"
        folder.mkdir(parents=True)
        (folder / "thread_siblings_list").write_text(f"{cpu % 4},{cpu % 4 + 4}\n")
    monkeypatch.setattr(processors, "_CPUS", tmp_path / "cpus")
    monkeypatch.setattr(processors, "_GROUPS", tmp_path / "groups")
    monkeypatch.setattr(processors, "_OWN_GROUPS", tmp_path / "own")
    monkeypatch.setattr(processors, "usable_cpus", lambda: list(range(8)))
    forget()
    yield tmp_path
    forget()


def forget() -> None:
    processors._siblings.cache_clear()
    processors._quota.cache_clear()


def write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def test_processors_of_one_core_are_one_core(system: Path) -> None:
    assert processors.usable_cores() == [(0, 4), (1, 5), (2, 6), (3, 7)]
    assert processors.physical_cores() == 4


@pytest.mark.parametrize("usable, cores", [([3], 1), ([0, 4], 1), ([0, 1], 2), ([1, 4, 5, 6], 3)])
def test_only_those_that_may_be_used(
    system: Path, monkeypatch: pytest.MonkeyPatch, usable: list[int], cores: int
) -> None:
    monkeypatch.setattr(processors, "usable_cpus", lambda: usable)
    assert processors.physical_cores() == cores


def test_siblings_may_be_a_range(system: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for cpu in range(4):
        file = system / f"cpus/cpu{cpu}/topology/thread_siblings_list"
        file.write_text(f"{cpu // 2 * 2}-{cpu // 2 * 2 + 1}\n")
    monkeypatch.setattr(processors, "usable_cpus", lambda: [0, 1, 2, 3])
    assert processors.usable_cores() == [(0, 1), (2, 3)]


@pytest.mark.parametrize(
    "own, files, cores",
    [
        ("0::/\n", {"cpu.max": "max 100000\n"}, 4),
        ("0::/\n", {"cpu.max": "250000 100000\n"}, 2),
        ("0::/a\n", {"a/cpu.max": "50000 100000\n"}, 1),
        ("0::/\n", {"cpu.max": "900000 100000\n"}, 4),
        ("0::/\n", {"cpu.max": "nonsense\n"}, 4),
        ("0::/\n", {"cpu.max": "0 0\n"}, 4),
        ("0::/a/b\n", {"a/b/cpu.max": "max 100000\n", "a/cpu.max": "310000 100000\n"}, 3),
        (
            "3:cpuacct,cpu:/docker/x\n2:memory:/\n",
            {
                "cpu/docker/x/cpu.cfs_quota_us": "300000\n",
                "cpu/docker/x/cpu.cfs_period_us": "100000\n",
            },
            3,
        ),
        ("1:cpu:/\n", {"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, 4),
        ("0::/gone\n", {}, 4),
    ],
)
def test_quotas_of_control_groups(
    system: Path, own: str, files: dict[str, str], cores: int
) -> None:
    """Of version 2 and of version 1, of the process's own group and of those above it."""
    (system / "own").write_text(own)
    for name, text in files.items():
        write(system / "groups" / name, text)
    assert processors.physical_cores() == cores


_COUNT_OF_PROCESSES = """
import os
from planners.learning.resumable_map import in_parallel

def make():
    return lambda item: os.getpid()

if __name__ == "__main__":
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    [blocks] = [list(in_parallel(make, (), range(6), 3))]
    print(len({pid for block in blocks for pid in block}))
"""


@LINUX
def test_data_are_made_in_as_many_processes_as_there_are_cores_for_this_one(
    tmp_path: Path,
) -> None:
    """As under `taskset`: on one core, one process."""
    program = tmp_path / "made.py"
    program.write_text(_COUNT_OF_PROCESSES)
    paths = os.pathsep.join(p for p in sys.path if p)
    answer = subprocess.run(
        [sys.executable, program],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert answer.stdout.strip() == "1", answer.stderr


@pytest.mark.slow
@LINUX
def test_jobs_are_bounded_by_the_cores_for_this_process(tmp_path: Path) -> None:
    one = min(os.sched_getaffinity(0))
    answer = subprocess.run(
        [
            *(sys.executable, "-c"),
            f"import os, sys; os.sched_setaffinity(0, {{{one}}}); sys.path[:] = {sys.path};"
            "from bench.cli.app import main; sys.exit(main(sys.argv[1:]))",
            *("run", "--env", "c3d", "--planners", "rrtconnect", "--jobs", "2"),
            *("--out", str(tmp_path / "out")),
        ],
        capture_output=True,
        text=True,
    )
    assert answer.returncode == 2
    assert "--jobs must be between 1 and 1" in answer.stderr
