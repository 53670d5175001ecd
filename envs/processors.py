"""The processors that this process may use: not all that the machine has."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_CPUS = Path("/sys/devices/system/cpu")
_GROUPS = Path("/sys/fs/cgroup")
_OWN_GROUPS = Path("/proc/self/cgroup")


def usable_cpus() -> list[int]:
    """The logical processors that this process may use, by the system's numbers."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def usable_cores() -> list[tuple[int, ...]]:
    """The logical processors that this process may use, those of one physical core together."""
    usable = set(usable_cpus())
    cores = {tuple(sorted(usable & _siblings(cpu))) for cpu in usable}
    return sorted(cores)


def physical_cores() -> int:
    """Physical cores that this process may keep busy: those that it may run on, and no more than
    what a container's quota of processor time allows; at least 1."""
    return max(1, int(min(len(usable_cores()), _quota())))


@cache
def _siblings(cpu: int) -> frozenset[int]:
    """The logical processors of the core that one belongs to; itself where that is not known."""
    try:
        listed = (_CPUS / f"cpu{cpu}/topology/thread_siblings_list").read_text()
    except OSError:
        return frozenset({cpu})
    ends = [part.partition("-") for part in listed.strip().split(",")]
    return frozenset({cpu}.union(*(range(int(a), int(b or a) + 1) for a, _, b in ends)))


@cache
def _quota() -> float:
    """Seconds of processor time for each second that passes that control groups leave to this
    process, endless without a limit."""
    return min((allowed / period for allowed, period in _quotas()), default=math.inf)


def _quotas() -> Iterator[tuple[float, float]]:
    """Quota and period of each control group, of either version, that this process is in, and of
    those above it; none of a group without a limit."""
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


def _quota_in(folder: Path) -> Iterator[tuple[float, float]]:
    for files in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        words = " ".join(_text(folder / name) for name in files).split()
        if len(words) == 2 and all(word.isdecimal() and int(word) > 0 for word in words):
            yield float(words[0]), float(words[1])


def _text(file: Path) -> str:
    try:
        return file.read_text()
    except OSError:  # another version, or no control groups
        return ""
