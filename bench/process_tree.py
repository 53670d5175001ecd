"""The processes that one has started, and those that they have."""

from __future__ import annotations

import contextlib
import os
import resource
from pathlib import Path
from time import clock_gettime, process_time

import psutil

_LISTS_CHILDREN = Path("/proc/thread-self/children").exists()


def descendants(pid: int | None = None) -> list[int]:
    """Their pids, without those that have ended.

    Args:
        pid: of another process whose are meant.
    """
    found: list[int] = []
    parents = [pid or os.getpid()]
    while parents:
        children = _children(parents.pop())
        found += children
        parents += children
    return [pid for pid in found if _runs(pid)]


def _children(pid: int) -> list[int]:
    if not _LISTS_CHILDREN:
        with contextlib.suppress(psutil.Error):
            return [child.pid for child in psutil.Process(pid).children()]
        return []
    found: list[int] = []
    with contextlib.suppress(OSError):  # it has ended
        for task in os.listdir(f"/proc/{pid}/task"):  # noqa: PTH208  on each attempt
            with open(f"/proc/{pid}/task/{task}/children", "rb") as children:  # noqa: PTH123
                found += map(int, children.read().split())
    return found


def _runs(pid: int) -> bool:
    with contextlib.suppress(psutil.Error):
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    return False


def cpu_s(pid: int) -> float:
    """Seconds of processor time of another process alone, 0 if it is gone."""
    with contextlib.suppress(OSError, OverflowError):
        return clock_gettime(~pid << 3 | 2)  # clock_getcpuclockid(3), which Python lacks
    with contextlib.suppress(psutil.Error):
        times = psutil.Process(pid).cpu_times()
        return float(times.user + times.system)
    return 0.0


def _cpu_of_tree_s(pid: int) -> float:
    """With what it has collected of its children."""
    with contextlib.suppress(psutil.Error):
        times = psutil.Process(pid).cpu_times()
        return cpu_s(pid) + float(times.children_user + times.children_system)
    return 0.0


def own_cpu_s() -> float:
    """Seconds of processor time of this process, its threads, and the children that it has
    collected. What is running below it is `below_cpu_s`."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return process_time() + ended.ru_utime + ended.ru_stime


def below_cpu_s() -> float:
    """Seconds of processor time of the processes below this one that have not ended."""
    return sum(map(_cpu_of_tree_s, descendants()))
