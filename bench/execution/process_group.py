"""The group of processes that a worker leads, stopped while others plan and ended with it; and the
processes that one has started, with those that they have.

A group's number is its leader's, which the system gives to another process as soon as the leader
has been reaped: whatever is sent to a group must be sent before that.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal
import sys
from collections.abc import Iterable
from pathlib import Path
from time import clock_gettime, monotonic, process_time, sleep

import psutil

_GOODBYE_S = 2.0  # to end when asked
_GLANCE_S = 0.005
_SIGNAL_OF_PARENTS_DEATH, _ADOPT = 1, 36  # of prctl(2)

CAN_PAUSE = sys.platform == "linux"
"""Whether processes that are paused can be told when their parent dies, see `tie_to_parent`."""


def tie_to_parent() -> None:
    """Has a leader that is stopped go on if its parent dies, so that it ends of itself; what its
    children start and leave becomes its own, so that it is seen (Linux)."""
    if sys.platform == "linux":
        system = ctypes.CDLL(None)
        system.prctl(_SIGNAL_OF_PARENTS_DEATH, signal.SIGCONT)
        system.prctl(_ADOPT, 1)


def pause(group: int) -> None:
    """Stops the processes of a group whose leader has not been reaped."""
    if CAN_PAUSE:
        _signal(group, signal.SIGSTOP)


def resume(group: int) -> None:
    """Lets them go on."""
    if CAN_PAUSE:
        _signal(group, signal.SIGCONT)


def has_ended(pid: int, within_s: float) -> bool:
    """Whether a child process ends in time. It is not reaped."""
    deadline = monotonic() + within_s
    while _runs(pid):
        if monotonic() > deadline:
            return False
        sleep(_GLANCE_S)
    return True


def exit_code(pid: int) -> int | None:
    """Of a child process that has ended, negative for a signal, None where the system does not say.
    It is not reaped."""
    told = None
    with contextlib.suppress(AttributeError, ChildProcessError):  # no such call; reaped meanwhile
        told = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    if told is None:
        return None
    return told.si_status if told.si_code == os.CLD_EXITED else -told.si_status


def helpers(leader: int) -> list[psutil.Process]:
    """The processes below a leader that has not ended, whatever group or session they are of."""
    found = []
    for pid in descendants(leader):
        with contextlib.suppress(psutil.Error):
            found.append(psutil.Process(pid))
    return found


def end(group: int) -> None:
    """Ends the processes of a group whose leader has ended and has not been reaped.

    They are asked first, because Python's resource tracker does not listen: it stays as long as
    others hold on to it, and then unlinks the shared memory of the one that died.
    """
    for number in (signal.SIGTERM, signal.SIGKILL):
        if not _any_runs(group):
            return
        _signal(group, number)
        _signal(group, signal.SIGCONT)  # else what is stopped would not hear of it
        deadline = monotonic() + _GOODBYE_S
        while monotonic() < deadline and _any_runs(group):
            sleep(_GLANCE_S)


def end_helpers(helpers: Iterable[psutil.Process]) -> None:
    """Ends processes that a leader started and that are no more, or never were, of its group."""
    for helper in helpers:
        with contextlib.suppress(psutil.Error):  # it has ended; another that has its pid is not it
            helper.kill()


def _signal(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, number)


def _any_runs(group: int) -> bool:
    return any(_is_of(pid, group) and _runs(pid) for pid in psutil.pids())


def _is_of(pid: int, group: int) -> bool:
    with contextlib.suppress(OSError):  # it is gone, or another user's
        return os.getpgid(pid) == group
    return False


def _runs(pid: int) -> bool:
    """Whether a process has not ended, although it may still be listed: the system's first process
    can take seconds to collect those that have."""
    with contextlib.suppress(psutil.Error):  # it is gone
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    return False


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
    return [pid for pid in found if _has_not_ended(pid)]


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


def _has_not_ended(pid: int) -> bool:
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
