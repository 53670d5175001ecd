"""How many cores this process may use: its affinity (`taskset`) and its control group's quota."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_CPUS = Path("/sys/devices/system/cpu")
_GROUPS = Path("/sys/fs/cgroup")
_OWN_GROUPS = Path("/proc/self/cgroup")


def usable_cores() -> int:
    """Physical cores that the calling thread may use, at least 1.

    Cores of which it may use a part count; a quota of processor time is rounded up.
    """
    cores = {_core(cpu) for cpu in usable_cpus()}
    return max(1, min(len(cores), _quota()))


def usable_cpus() -> list[int]:
    """The logical processors that the calling thread may use, by the system's numbers."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


@cache
def _core(cpu: int) -> str:
    """What names the core of a logical processor; the processor itself where that is not known."""
    try:
        return (_CPUS / f"cpu{cpu}/topology/thread_siblings_list").read_text().strip()
    except OSError:
        return str(cpu)


@cache
def _quota() -> int:
    """Whole processors' time that control groups leave to this process."""
    shares = [quota / period for quota, period in _quotas() if quota > 0 and period > 0]
    return max(1, -int(-min(shares) // 1)) if shares else os.cpu_count() or 1


def _quotas() -> Iterator[tuple[int, int]]:
    """Quota and period, in microseconds, of each control group that this process is in, of either
    version, and of those above; without a quota there is none, or -1."""
    try:
        listed = _OWN_GROUPS.read_text().splitlines()
    except OSError:
        return
    for line in listed:
        _, controllers, name = line.split(":", 2)
        root = _GROUPS / "cpu" if "cpu" in controllers.split(",") else _GROUPS
        group = root / name.strip("/")
        for folder in (group, *group.parents):
            if not folder.is_relative_to(root):
                break
            yield from _quota_in(folder)


def _quota_in(folder: Path) -> Iterator[tuple[int, int]]:
    for files in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        try:
            words = " ".join((folder / file).read_text() for file in files).split()
        except OSError:
            continue
        if len(words) == 2 and words[0] != "max":
            yield int(words[0]), int(words[1])
