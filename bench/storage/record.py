"""The row that every attempt leaves: its columns, their words, and the history of its best cost."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from envs.problem import Array
from planners import Status

if TYPE_CHECKING:
    import pandas as pd  # half a second, which every planner's process can save


class Fault(str, Enum):
    """What befell an attempt, where the planner could not say so itself."""

    ERROR = "ERROR"  # it raised an exception
    LEFT_RUNNING = "LEFT_RUNNING"  # threads or processes of its own went on after it returned
    CRASH = "CRASH"  # its process died
    KILLED = "KILLED"  # it ignored the deadline and was ended
    OUT_OF_MEMORY = "OUT_OF_MEMORY"  # it wanted more than the memory limit
    UNSUPPORTED = "UNSUPPORTED"  # it said that it cannot plan in this environment
    SKIPPED = "SKIPPED"  # it would have had to be trained first, which was ruled out
    INVALID_PROBLEM = "INVALID_PROBLEM"  # it was not asked: no path can be valid, see the census


class Verdict(str, Enum):
    """What the judge finds of a claimed path."""

    VALID = "VALID"
    COLLISION = "COLLISION"
    OUT_OF_BOUNDS = "OUT_OF_BOUNDS"
    WRONG_ENDPOINT = "WRONG_ENDPOINT"
    MALFORMED = "MALFORMED"
    NOT_JUDGED = "NOT_JUDGED"  # judging would take more than any honest path needs


LATE = "LATE"
"""The outcome of a valid path that came after the time limit."""

MOST_WAYPOINTS = 2**20
"""Paths of more are neither judged nor kept."""

LEFT_OUT = (Fault.UNSUPPORTED.value, Fault.SKIPPED.value)
"""Statuses of rows of planners that were not asked."""

NOT_ATTEMPTED = (*LEFT_OUT, Fault.INVALID_PROBLEM.value)
"""Statuses of rows in which nothing was measured."""


@dataclass(frozen=True)
class Record:
    """One attempt. Lengths are in the environment's unit, times in seconds.

    `status` is the planner's claim or the fault; `verdict` is the judge's, empty without a path;
    `outcome` is what the tables count: the verdict on a claimed solution, `LATE`, or the status.

    `weights` is the digest of the numbers that a learned planner used, "" for any other. `cpu_s`
    is the processor's time of the attempt, threads and children included, `processor` the name of
    the machine's, and `load` how many of its cores were busy with something else meanwhile.
    `peak_memory_mb` is the most that the process held during the attempt, `attempt_memory_mb` how
    much that is more than it held before. What was not measured is None.

    Of what was planned elsewhere (`Planner.planned_elsewhere`) no time or memory is known;
    `stats` has what is claimed.

    `scene_s` is how long the planner took to get ready for the problem's scene, None where all
    problems have one scene.

    `repeat` tells attempts of one planner at one problem apart, from 0. `metrics` is JSON: the
    path's value of each metric by name (`bench.judging.metrics`), None where it has none, of
    verified solutions; of other judged paths as far as they mean something. In data frames each is
    a column.
    """

    run_id: str
    env: str
    env_fingerprint: str
    planner: str
    planner_version: int
    weights: str
    problem: int
    repeat: int
    problems_seed: int
    settings: str
    seed: int
    status: str
    verdict: str
    outcome: str
    solved: int
    setup_s: float
    train_s: float
    scene_s: float | None
    solve_s: float | None
    cpu_s: float | None
    load: float | None
    metrics: str
    collision_checks: int | None
    peak_memory_mb: float | None
    attempt_memory_mb: float | None
    warm: int
    processor: str
    measured_at: str
    error: str
    stats: str
    path: bytes | None = field(repr=False)


KEY = ("planner", "env_fingerprint", "problem", "repeat", "problems_seed", "settings", "weights")
"""What makes an attempt the same attempt."""

COLUMNS = tuple(f.name for f in fields(Record))

OF_ANY_PATH = ("length", "waypoints")
"""Metrics that mean something of paths that are not valid, too."""


def with_metrics(records: pd.DataFrame) -> pd.DataFrame:
    """Records with a column of numbers for each metric that any of them has by name, NaN where it
    has none, and for `OF_ANY_PATH` in any case. Names that a column has are left out, as in a store
    that something else has written to."""
    values = [metrics_of(text) for text in records["metrics"]]
    names = dict.fromkeys([*OF_ANY_PATH, *(name for row in values for name in row)])
    columns = {
        name: np.array([row.get(name) for row in values], dtype=float)  # NaN for None
        for name in names
    }
    whole: pd.DataFrame = records.assign(**columns)
    return whole


VERSIONS = "versions"
"""Under which the metrics of a record have the versions of those that have one, by name."""


def versions_of(text: str) -> dict[str, str]:
    """The versions of a record's metrics, by name."""
    found = json.loads(text).get(VERSIONS)
    return found if isinstance(found, dict) else {}


def metrics_of(text: str) -> dict[str, float | None]:
    """The metrics of a record, by name."""
    found = json.loads(text)
    return {
        name: value
        for name, value in found.items()
        if name not in COLUMNS and isinstance(value, int | float | None)
    }


def outcome(status: str, verdict: str, solve_s: float | None, time_limit_s: float) -> str:
    """What the tables count an attempt as; `Verdict.VALID` is success."""
    if status != Status.EXACT_SOLUTION.value:
        return status
    if verdict == Verdict.VALID.value and (solve_s is None or solve_s > time_limit_s):
        return LATE
    return verdict or Verdict.MALFORMED.value


def encode_path(path: Array | None) -> bytes | None:
    """A path (k, d) as bytes, its shape in front; None for None, for arrays of other ranks, and for
    paths of more than `MOST_WAYPOINTS`."""
    if path is None or path.ndim != 2 or len(path) > MOST_WAYPOINTS:
        return None
    head = json.dumps(list(path.shape)).encode() + b"\n"
    return head + np.ascontiguousarray(path, dtype="<f8").tobytes()


def decode_path(data: bytes) -> Array:
    """The path (k, d) that `encode_path` wrote."""
    head, _, numbers = data.partition(b"\n")
    shape: list[Any] = json.loads(head)
    return np.frombuffer(numbers, dtype="<f8").reshape(shape).astype(np.float64)


def cost_history(stats: str) -> Array:
    """(n, 2), in order of time: seconds since the start of `solve`, and the length of the best path
    so far in the environment's unit, both finite. Empty if the planner keeps none, or one that
    cannot be read, as in stores of before such were refused.

    Args:
        stats: JSON, as in `bench.storage.record.Record`.
    """
    stored = json.loads(stats)
    told = readable_history(stored.get("cost_history")) if isinstance(stored, dict) else None
    if told is None:
        return np.zeros((0, 2))
    finite = told[np.isfinite(told).all(axis=1)]
    return finite[np.argsort(finite[:, 0], kind="stable")]


def claimed_solve_s(stats: str) -> float | None:
    """The planning time in seconds that is claimed of what was planned elsewhere; None if none is.

    Args:
        stats: JSON, as in `bench.storage.record.Record`.
    """
    return _told(stats, "claimed_solve_s")


def checked_every(stats: str) -> float | None:
    """How far apart, in the configuration space, a planner checks states along its motions, by its
    own word; None if it does not say.

    Args:
        stats: JSON, as in `bench.storage.record.Record`.
    """
    return _told(stats, "checked_every")


def _told(stats: str, name: str) -> float | None:
    """A finite number from 0 on that a planner told under a name, if it did."""
    stored = json.loads(stats)
    told = stored.get(name) if isinstance(stored, dict) else None
    if isinstance(told, bool) or not isinstance(told, int | float):
        return None
    return float(told) if 0 <= told < math.inf else None


def readable_history(told: Any) -> Array | None:
    """What a planner told as its `cost_history` as (n, 2): seconds, finite and at least 0, and
    costs, which are numbers. None if it is anything else; planners are strangers' programs, and
    their word reaches stores.

    Args:
        told: JSON data.
    """
    if not isinstance(told, list):
        return None
    try:
        pairs = np.array(told) if told else np.zeros((0, 2))
    except ValueError:  # not every item is as long as the first
        return None
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iuf":
        return None
    history: Array = pairs.astype(np.float64)
    times, costs = history.T
    if not (np.isfinite(times) & (times >= 0)).all() or np.isnan(costs).any():
        return None
    return history
