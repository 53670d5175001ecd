"""Ends what a worker started and left behind."""

from __future__ import annotations

import contextlib
import os
import signal
from time import monotonic, sleep

import psutil

_GOODBYE_S = 2.0  # to end when asked
_GLANCE_S = 0.005


def end(group: int) -> None:
    """Ends the processes of a group whose first one is gone.

    They are asked first, because Python's resource tracker does not listen: it stays as long as
    others hold on to it, and then unlinks the shared memory of the one that died.
    """
    with contextlib.suppress(ProcessLookupError):  # none is left
        for number in (signal.SIGTERM, signal.SIGKILL):
            os.killpg(group, number)
            deadline = monotonic() + _GOODBYE_S
            while monotonic() < deadline and any(_runs(pid, group) for pid in psutil.pids()):
                sleep(_GLANCE_S)


def _runs(pid: int, group: int) -> bool:
    """Whether a process is of the group and has not ended, although it may still be listed: the
    system's first process can take seconds to collect those that have."""
    with contextlib.suppress(OSError, psutil.Error):  # it is gone, or another user's
        return os.getpgid(pid) == group and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    return False
