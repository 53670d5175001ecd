"""How many cores may be used, on machines made of files."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from envs import cores


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four cores of two logical processors each, which may all be used, and no quota."""
    for cpu in range(8):
        folder = tmp_path / f"cpus/cpu{cpu}/topology"
        folder.mkdir(parents=True)
        (folder / "thread_siblings_list").write_text(f"{cpu % 4},{cpu % 4 + 4}\n")
    (tmp_path / "groups").mkdir()
    monkeypatch.setattr(cores, "_CPUS", tmp_path / "cpus")
    monkeypatch.setattr(cores, "_GROUPS", tmp_path / "groups")
    monkeypatch.setattr(cores, "_OWN_GROUPS", tmp_path / "own")
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    monkeypatch.setattr(cores, "usable_cpus", lambda: list(range(8)))
    cores._core.cache_clear()
    cores._quota.cache_clear()
    return tmp_path


@pytest.fixture(autouse=True)
def forgotten() -> object:
    yield
    cores._core.cache_clear()
    cores._quota.cache_clear()


@pytest.mark.parametrize(
    ("cpus", "wanted"), [(range(8), 4), ([0, 4], 1), ([0, 1, 5], 2), ([3], 1), ([2, 7], 2)]
)
def test_siblings_are_one_core(
    machine: Path, monkeypatch: pytest.MonkeyPatch, cpus: list[int], wanted: int
) -> None:
    monkeypatch.setattr(cores, "usable_cpus", lambda: list(cpus))
    assert cores.usable_cores() == wanted


@pytest.mark.parametrize(
    ("own", "files", "wanted"),
    [
        ("0::/\n", {"cpu.max": "200000 100000\n"}, 2),
        ("0::/a/b\n", {"a/b/cpu.max": "max 100000\n", "a/cpu.max": "150000 100000\n"}, 2),
        ("0::/a\n", {"a/cpu.max": "10000 100000\n"}, 1),
        ("0::/a\n", {"a/cpu.max": "max 100000\n"}, 4),
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
    machine: Path, own: str, files: dict[str, str], wanted: int
) -> None:
    (machine / "own").write_text(own)
    for name, text in files.items():
        (machine / "groups" / name).parent.mkdir(parents=True, exist_ok=True)
        (machine / "groups" / name).write_text(text)
    assert cores.usable_cores() == wanted


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_processes_for_data_keep_to_the_affinity() -> None:
    text = (
        "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
        "from envs.cores import usable_cores; from bench.machine import physical_cores\n"
        "from planners import parallel\n"
        "seen = []\n"
        "class Pool:\n"
        "    def __init__(self, processes, **_): seen.append(processes)\n"
        "    def __enter__(self): return self\n"
        "    def __exit__(self, *_): pass\n"
        "parallel.ProcessPoolExecutor = Pool\n"
        "list(parallel.in_parallel(print, (), [], 1))\n"
        "print(usable_cores(), physical_cores(), *seen)\n"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "1", "1"]
