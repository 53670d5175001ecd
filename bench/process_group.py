"""The group of processes that a worker leads: stopped while others plan, and ended with it.

A group's number is its leader's, which the system gives to another process as soon as the leader
has been reaped: whatever is sent to a group must be sent before that.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from collections.abc import Iterable
from time import monotonic, sleep

import psutil

from bench import process_tree

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
    for pid in process_tree.descendants(leader):
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
