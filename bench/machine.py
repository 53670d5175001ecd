"""What a run was measured on: machine, versions, state of the source."""

from __future__ import annotations

import contextlib
import os
import platform
import subprocess
from collections.abc import Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import psutil

from bench.launch import COMMAND, ONE_THREAD
from envs import processors

_PACKAGES = (
    "plannerbench",
    "numpy",
    "scipy",
    "torch",
    "ompl",
    "scikit-fmm",
    "trimesh",
    "python-fcl",
    "pandas",
)


def shares(number: int) -> list[tuple[int, ...]]:
    """Logical processors for each of a number of planners at a time: equal numbers of whole cores,
    that none of the others uses. Empty tuples, for any processor, if there is only one planner, or
    the system does not say or does not have enough."""
    cores = processors.usable_cores()
    each = len(cores) // number
    if number == 1 or each == 0 or not hasattr(os, "sched_setaffinity"):
        return [()] * number
    chosen = [cores[i * each : (i + 1) * each] for i in range(number)]
    return [tuple(cpu for core in share for cpu in core) for share in chosen]


def confine_thread(cpus: Sequence[int]) -> None:
    """Lets this thread, and what it starts, run on some processors only; on none: on any."""
    if cpus:
        os.sched_setaffinity(0, cpus)


def confine_process(pid: int, cpus: Sequence[int]) -> None:
    """The same for all threads of another process and of those that it started."""
    if not cpus:
        return
    with contextlib.suppress(psutil.Error):  # it has ended
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            for thread in one.threads():
                with contextlib.suppress(OSError):  # so has this one
                    os.sched_setaffinity(thread.id, cpus)


def describe() -> dict[str, Any]:
    """JSON data that names the machine, the versions in use, the git state ("-dirty" if tracked
    files have changes) and how threads are pinned."""
    return {
        "machine": {
            "system": platform.platform(),
            "processor": processor(),
            "physical_cores": processors.physical_cores(),
            "usable_cpus": processors.usable_cpus(),
            "memory_mb": psutil.virtual_memory().total // 2**20,
        },
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in _PACKAGES},
        "git": _git_state(),
        "threads_per_worker": 1,
        "thread_variables": dict(ONE_THREAD),
        "speed_variables": COMMAND.start.variables_of_speed,
    }


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


@cache
def processor() -> str:
    """The processor's name, as the system gives it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _git_state() -> str | None:
    """The commit of the source tree and whether it has changes, None outside a checkout."""
    root = Path(__file__).parents[1]
    if not (root / ".git").exists():
        return None
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=root,
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.strip() or None
