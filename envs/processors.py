"""The processors that this process may use: not all that the machine has."""

from __future__ import annotations

import math
import os
from pathlib import Path

_SYSTEM = Path("/sys")


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
    quota = _quota()
    cores = len(usable_cores())
    return max(1, cores if quota is None else min(cores, int(quota)))


def _siblings(cpu: int) -> set[int]:
    """The logical processors of the core that one belongs to; itself where that is not known."""
    file = _SYSTEM / f"devices/system/cpu/cpu{cpu}/topology/thread_siblings_list"
    try:
        listed = file.read_text()
    except OSError:
        return {cpu}
    ends = [part.partition("-") for part in listed.strip().split(",")]
    return {cpu for low, _, high in ends for cpu in range(int(low), int(high or low) + 1)} | {cpu}


def _quota() -> float | None:
    """Seconds of processor time for each second that passes that the control group of this process
    allows, None without a limit: cpu.max of version 2, or the two files of version 1."""
    groups = _SYSTEM / "fs/cgroup"
    version_1 = groups / "cpu/cpu.cfs_quota_us", groups / "cpu/cpu.cfs_period_us"
    said = _words(groups / "cpu.max") or _words(*version_1)
    if len(said) != 2 or said[0] in ("max", "-1"):
        return None
    return float(said[0]) / float(said[1])


def _words(*files: Path) -> list[str]:
    """What some files say, none if one is not there or says no numbers."""
    try:
        words = " ".join(file.read_text() for file in files).split()
        return words if all(word == "max" or math.isfinite(float(word)) for word in words) else []
    except (OSError, ValueError):
        return []
