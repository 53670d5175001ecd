"""A process that the harness starts for a stranger's code, talks to over a socket, and ends with
all that it has started."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import tempfile
import threading

import psutil

from bench.execution import launch, process_group

_GOODBYE_S = 2.0  # for an idle process to end when its parent hangs up
_DIES_S = 5.0  # for one that closed its connection to be gone
_LAST_OUTPUT = 2**15  # bytes of it that are looked at for what to quote
_MOST_QUOTED = 2000  # characters
_LOG_LIMIT = 16 * 2**20  # bytes of output kept of a process that prints without end


class ChildProcess:
    """A process in a session of its own, started as `bench.execution.launch` has it.

    Args:
        module: whose `main` it runs, with the descriptor of its end of the socket.
        interpreter: the Python that runs it, by its path; by default this one.

    Attributes:
        connection: this end of the socket.
        working: whether it has been asked something and has not answered.
    """

    def __init__(self, module: str, interpreter: str = "") -> None:
        self.working = False
        self._closed = False
        self._closing = threading.Lock()
        self._log = tempfile.TemporaryFile("a+b")  # noqa: SIM115  closed by close()
        self.connection, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                launch.arguments(module, theirs.fileno(), interpreter),
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=self._log,
                pass_fds=[theirs.fileno()],
                env=launch.variables(interpreter),
                cwd=launch.COMMAND.start.folder,
                start_new_session=True,  # a Ctrl-C is the harness's to handle
            )

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return not self._closed

    @property
    def pid(self) -> int:
        """By the system's numbers."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """As of a finished process: 0 if it ended of itself after its last answer."""
        return self._process.returncode

    @property
    def resident_mb(self) -> float:
        """The memory that it holds now; 0 if it is gone."""
        try:
            return float(psutil.Process(self.pid).memory_info().rss / 2**20)
        except psutil.Error:
            return 0.0

    def resume(self) -> None:
        """Lets it go on, as it is going to be asked something."""
        self.working = True
        process_group.resume(self.pid)

    def pause(self) -> None:
        """Stops it until it is asked again, if it is still there."""
        self.working = False
        with self._closing:
            if not self._closed:
                process_group.pause(self.pid)

    def close(self) -> None:
        """Ends the process, its group and whatever else it has started.

        One that waits for a question sees that its parent hung up and ends of itself; one that is
        working is killed. Of one that died before, helpers in sessions of their own are out of
        reach.
        """
        with self._closing:
            if self._closed:
                return
            self._closed = True
        self.connection.close()
        helpers = process_group.helpers(self.pid)
        process_group.resume(self.pid)
        if self.working or not process_group.has_ended(self.pid, _GOODBYE_S):
            os.kill(self.pid, signal.SIGKILL)  # Popen's own way would reap it first
        process_group.has_ended(self.pid, _DIES_S)
        process_group.end(self.pid)  # while the number is still its own
        process_group.end_helpers(helpers)
        self._process.wait()
        self._log.close()

    def cause_of_death(self) -> str:
        """Of one that does not answer any more, in words."""
        if not process_group.has_ended(self.pid, _DIES_S):
            return "closed its connection"
        code = process_group.exit_code(self.pid)
        if code is None:
            return "died"
        return f"died of {_signal_name(-code)}" if code < 0 else f"exited with code {code}"

    def forget_output(self) -> None:
        """Drops what it has printed."""
        os.ftruncate(self._log.fileno(), 0)

    def limit_output(self) -> None:
        """Drops it if it is too much to keep."""
        if os.fstat(self._log.fileno()).st_size > _LOG_LIMIT:
            self.forget_output()

    def last_output(self) -> str:
        """The end of what it printed; for a crash, where it happened."""
        if self._log.closed:
            return ""
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - _LAST_OUTPUT))
        said = self._log.read().decode(errors="replace")
        # What faulthandler says last: names of a hundred libraries in one line.
        return re.sub(r"\nExtension modules: .*", "", said)[-_MOST_QUOTED:]


def _signal_name(number: int) -> str:
    named = {known.value: known.name for known in signal.Signals}
    return named.get(number, f"signal {number}")
