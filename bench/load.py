"""How busy the machine is."""

from __future__ import annotations

import os
from pathlib import Path

_COUNTS = Path("/proc/stat")
_IDLE = (3, 4)  # idle, and waiting for a disk
_COUNTED = 8  # what is behind is counted in the first two already

_SHORTEST_S = 0.1  # over less, hundredths of a second, in which the system counts, say nothing


def busy_s() -> float | None:
    """Seconds for which this machine's cores, or whoever shares them, have worked, summed over all
    since it started; None where the system does not tell (only Linux does)."""
    try:
        with _COUNTS.open("rb") as counts:
            times = [int(n) for n in counts.readline().split()[1 : 1 + _COUNTED]]
    except (OSError, ValueError):
        return None
    ticks = sum(n for i, n in enumerate(times) if i not in _IDLE)
    return ticks / os.sysconf("SC_CLK_TCK")


def since(before: float | None, wall_s: float) -> float | None:
    """How many seconds more those are than `before`, None if that says nothing about a time as
    short as `wall_s`."""
    if before is None or wall_s < _SHORTEST_S:
        return None
    now = busy_s()
    return None if now is None else now - before
