"""The most memory that this process holds, from a moment on."""

from __future__ import annotations

import contextlib
import os

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
