"""What a planner leaves running in its process after `solve` has returned.

Honest ones leave things too: numerical libraries keep threads that wait, and spin for a while
before they do; pools keep threads and processes that wait for work. So whatever comes to rest soon
is nobody's fault, unless it is a thread or process that `solve` itself began and that is not a
pool's.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, process_time, sleep, thread_time
from types import FrameType

import psutil

from bench.execution.process_group import cpu_s, descendants

_LOOK_S = 0.01  # how long work is looked for at once
_BUSY_SHARE = 0.1  # of a core
_PATIENCE_S = 0.5  # for threads and processes to end, and for what spins to come to rest
_WORTH_S = 0.1  # of work; what a busy machine keeps from its last few instructions is not blamed
_STARVED_S = 3.0  # unless it has not ended by then
_HELPERS = ("multiprocessing.resource_tracker", "multiprocessing.forkserver")
_POOLS = {"concurrent", "multiprocessing"}  # packages of the standard library
_TASKS = Path("/proc/self/task")


@dataclass(frozen=True)
class Left:
    """What was found.

    Attributes:
        what: threads and processes, a text each.
        works: whether it goes on working, rather than only being there.
    """

    what: tuple[str, ...] = ()
    works: bool = False


@dataclass(frozen=True)
class Before:
    """Threads of Python, by their identifiers, and processes, by pid, that are there already."""

    threads: frozenset[int]
    processes: frozenset[int]

    @staticmethod
    def now() -> Before:
        return Before(frozenset(sys._current_frames()), frozenset(descendants()))

    def left(self) -> Left:
        """What else is there and stays, and whatever works on although nothing was asked. Takes
        no time where there is neither thread nor process but the caller's."""
        if not _has_company():
            return Left()
        begin, used = monotonic(), _cpu_of_company_s()
        while True:
            work = _Work.seen()
            begun = [*self._threads(), *self._processes(work)]
            if not begun and not work.busy:
                return Left()
            waited = monotonic() - begin
            worked = _cpu_of_company_s() - used >= _WORTH_S or waited > _STARVED_S
            if waited > _PATIENCE_S and (begun or worked):
                return Left(tuple(dict.fromkeys([*begun, *work.told()])), work.busy)

    def _threads(self) -> Iterator[str]:
        """Those begun since that are not a pool's."""
        names = {thread.ident: thread.name for thread in threading.enumerate()}
        for id, frame in sys._current_frames().items():
            if id not in self.threads and not _is_of_a_pool(frame):
                yield f"thread {names.get(id, 'without a name')!r}"

    def _processes(self, work: _Work) -> Iterator[str]:
        """Those begun since that are neither Python's own helpers nor, at rest, a pool's."""
        new = [pid for pid in descendants() if pid not in self.processes]
        pooled = _pooled() if new else set()
        for pid in new:
            if not _is_helper(pid) and (pid not in pooled or pid in work.processes):
                yield _process(pid)


def _has_company() -> bool:
    """Whether this process has threads or children besides the one that asks."""
    if _TASKS.exists():
        return len(os.listdir(_TASKS)) > 1 or bool(descendants())  # noqa: PTH208  on each attempt
    return psutil.Process().num_threads() > 1 or bool(descendants())


def _is_of_a_pool(frame: FrameType | None) -> bool:
    """Whether a thread, by its innermost frame, is one of the standard library's pools and in no
    code of anyone else's: it waits for work."""
    packages = set()
    while frame is not None:
        packages.add(str(frame.f_globals.get("__name__", "")).partition(".")[0])
        frame = frame.f_back
    return packages <= sys.stdlib_module_names and bool(packages & _POOLS)


def _pooled() -> set[int]:
    """The processes of `multiprocessing`, by pid, if any pool is there."""
    multiprocessing = sys.modules.get("multiprocessing")
    if multiprocessing is None or not any(map(_is_of_a_pool, sys._current_frames().values())):
        return set()
    return {child.pid for child in multiprocessing.active_children()}


def _is_helper(pid: int) -> bool:
    return any(helper in _command(pid) for helper in _HELPERS)


def _process(pid: int) -> str:
    return f"process {pid} ({_command(pid)[:80]})"


def _command(pid: int) -> str:
    try:
        return " ".join(psutil.Process(pid).cmdline())
    except psutil.Error:
        return "gone"


@dataclass(frozen=True)
class _Work:
    """What worked while the caller slept.

    Attributes:
        busy: whether that was worth mentioning.
        threads: of this process, by the system's numbers, with the seconds that they worked.
        processes: below it, by pid, that worked.
    """

    busy: bool
    threads: dict[int, float]
    processes: set[int]

    @staticmethod
    def seen() -> _Work:
        """Sleeps for a moment."""
        before, threads, children = _others_cpu_s(), _thread_times(), _times_below()
        wanted, begin = _wanting(), monotonic()
        sleep(_LOOK_S)
        wanted &= _wanting()  # those that a busy machine does not let run want to all the while
        least = _BUSY_SHARE * (monotonic() - begin)
        of_children = {pid: s - children.get(pid, s) for pid, s in _times_below().items()}
        of_threads = {id: s - threads.get(id, s) for id, s in _thread_times().items()}
        worked = {
            pid
            for pid, s in of_children.items()
            if (s > least or pid in wanted) and not _is_helper(pid)
        }
        by = {id: s for id, s in of_threads.items() if s > least or id in wanted}
        busy = bool(worked or by) or _others_cpu_s() - before > least
        return _Work(busy, by, worked)

    def told(self) -> Iterator[str]:
        """In words, if it was busy."""
        if not self.busy:
            return
        names = {t.native_id: t.name for t in threading.enumerate()}
        for id in self.threads:
            name = names.get(id)
            yield f"thread {name!r}" if name else "a thread that is not Python's"
        yield from map(_process, self.processes)
        if not self.threads and not self.processes:
            yield "threads"


def _cpu_of_company_s() -> float:
    """Processor time of everything below this process and of its other threads, in seconds."""
    return _others_cpu_s() + sum(_times_below().values())


def _others_cpu_s() -> float:
    """Processor time of all threads of this process but the one that asks, in seconds."""
    return process_time() - thread_time()


def _thread_times() -> dict[int, float]:
    """Processor time of the other threads by the system's numbers, where it tells (Linux)."""
    if not _TASKS.exists():
        return {}
    others = set(map(int, os.listdir(_TASKS))) - {threading.get_native_id()}  # noqa: PTH208
    return {id: _time_of_thread(id) for id in others}


def _time_of_thread(id: int) -> float:
    """In seconds; 0 if it has ended, or the system does not count."""
    with contextlib.suppress(OSError, IndexError):
        told = (_TASKS / str(id) / "schedstat").read_text()
        return int(told.split()[0]) / 1e9
    return 0.0


def _wanting() -> set[int]:
    """The other threads of this process, and the processes below it, that work or would if there
    were a core for them (Linux)."""
    if not _TASKS.exists():
        return set()
    own = threading.get_native_id()
    tasks = [int(id) for id in os.listdir(_TASKS) if int(id) != own]  # noqa: PTH208
    return {id for id in (*tasks, *descendants()) if _state(id) == b"R"}


def _state(id: int) -> bytes:
    """The letter in which proc(5) tells whether a thread or process sleeps; none if it is gone."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{id}/stat").read_bytes().rpartition(b")")[2].split()[0]
    return b""


def _times_below() -> dict[int, float]:
    return {pid: cpu_s(pid) for pid in descendants()}
