"""The machine that a run is measured on: hardware, versions, load, and memory of a process."""

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

from bench.execution.launch import COMMAND, ONE_THREAD
from envs import processors

_PACKAGES = (
    "plannerbench",
    "numpy",
    "scipy",
    "torch",
    "ompl",
    "scikit-fmm",
    "eikonalfm",
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
    root = Path(__file__).parents[2]
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


_COUNTS = Path("/proc/stat")
_IDLE = (3, 4)  # idle, and waiting for a disk
_COUNTED = 8  # what is behind is counted in the first two already

_SHORTEST_S = 0.1  # over less, hundredths of a second, in which the system counts, say nothing


def busy_s() -> float | None:
    """Seconds for which this machine's cores, or whoever shares them, have worked, summed over all
    since it started; None where the system does not tell (only Linux does)."""
    try:
        with _COUNTS.open("rb") as counts:
            times = [int(n) for n in counts.readline().split()[1 : 1 + _COUNTED]]
    except (OSError, ValueError):
        return None
    ticks = sum(n for i, n in enumerate(times) if i not in _IDLE)
    return ticks / os.sysconf("SC_CLK_TCK")


def since(before: float | None, wall_s: float) -> float | None:
    """How many seconds more those are than `before`, None if that says nothing about a time as
    short as `wall_s`."""
    if before is None or wall_s < _SHORTEST_S:
        return None
    now = busy_s()
    return None if now is None else now - before


_STATUS, _RESET = "/proc/self/status", "/proc/self/clear_refs"  # Linux: proc(5)


class MemoryPeak:
    """From now on."""

    def __init__(self) -> None:
        self._resets = False
        with contextlib.suppress(OSError):
            _write(_RESET, b"5")
            self._resets = True
        self._before_mb = _megabytes(b"VmRSS:") if self._resets else None

    def read(self) -> tuple[float | None, float | None]:
        """The most that the process has held since, in MB, and how much that is more than at
        first; None where the system does not tell."""
        if self._before_mb is None:
            return None, None
        try:
            peak_mb = _megabytes(b"VmHWM:")
        except MemoryError:
            return None, None
        if peak_mb is None:
            return None, None
        return peak_mb, max(0.0, peak_mb - self._before_mb)


def _megabytes(name: bytes) -> float | None:
    with contextlib.suppress(OSError), open(_STATUS, "rb") as status:  # noqa: PTH123  on each attempt
        for line in status:
            if line.startswith(name):
                return int(line.split()[1]) / 2**10
    return None


def _write(file: str, what: bytes) -> None:
    descriptor = os.open(file, os.O_WRONLY)
    try:
        os.write(descriptor, what)
    finally:
        os.close(descriptor)
