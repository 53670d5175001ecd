"""What a planner returned, as plain data in memory: made on the planner's own clock.

A result may be lazy: an array that computes itself when it is read, an iterator, a tensor on a
device that is still computing. Whatever that takes is planning.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench import wire
from envs.errors import reason
from envs.problem import Array
from planners import Status

_MOST_STATS = 2**22  # bytes of JSON


@dataclass(frozen=True)
class Claim:
    """A result that nobody can change any more.

    Attributes:
        path: as numbers of whatever shape, None if it is none; the judge says what is wrong.
        stats: JSON.
        notes: what was left out, a line each.
    """

    status: str
    path: Array | None
    stats: str
    notes: tuple[str, ...] = ()


def in_memory(result: Any) -> Claim:
    """What `Planner.solve` returned as plain data. Raises whatever the planner's objects raise."""
    status = Status(result.status).value
    path, of_path = _numbers(result.path)
    stats, of_stats = _json(result.stats)
    wait_for_devices()
    return Claim(status, path, stats, tuple(filter(None, (of_path, of_stats))))


def wait_for_devices() -> None:
    """Returns when no device that PyTorch has in use computes any more."""
    torch: Any = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_initialized():
        torch.cuda.synchronize()


def _numbers(path: Any) -> tuple[Array | None, str]:
    """A copy, which what the planner may have left running cannot write to."""
    if path is None:
        return None, ""
    waypoints = getattr(path, "waypoints", path)
    if isinstance(waypoints, Iterator):
        waypoints = list(waypoints)
    try:
        numbers: Array = np.array(_on_host(waypoints), dtype=np.float64)
    except (TypeError, ValueError) as error:
        return None, f"its path is no array of numbers: {reason(error)}"
    if numbers.nbytes > wire.MOST_NUMBERS:
        size, most = numbers.nbytes // 2**20, wire.MOST_NUMBERS // 2**20
        return None, f"its path of shape {numbers.shape} takes {size} MB; {most} are the most"
    return numbers, ""


def _on_host(waypoints: Any) -> Any:
    """Tensors without their gradients and in the processor's memory, where NumPy can read them;
    anything else as it is."""
    if hasattr(waypoints, "detach"):
        return waypoints.detach().cpu()
    if isinstance(waypoints, list | tuple) and any(hasattr(q, "detach") for q in waypoints):
        return [_on_host(q) for q in waypoints]
    return waypoints


def _json(stats: Any) -> tuple[str, str]:
    """JSON, or that of nothing and why."""
    try:
        text = json.dumps(dict(stats), default=wire.plain)
    except (TypeError, ValueError, RecursionError) as error:
        return "{}", f"its stats are left out, as they are no JSON data: {reason(error)}"
    if len(text) > _MOST_STATS:
        size, most = len(text) // 2**20, _MOST_STATS // 2**20
        return "{}", f"its stats are left out, as they take {size} MB; {most} are the most"
    return text, ""
