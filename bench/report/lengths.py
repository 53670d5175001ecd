"""How soon planners reach common lengths, and what lengths they were held to.

Planning times of planners that stop by different rules do not compare; how long each takes to
reach the same length does.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from bench.report.history import cost_history
from bench.stats import censored_median

LEVELS = {"best": 0.0, "5_percent": 0.05, "20_percent": 0.2}
"""Lengths by how much longer they are, as a fraction, than the shortest of all planners' on the
same problem."""

COLUMNS = tuple(f"{what}_{level}" for level in LEVELS for what in ("time_s_to", "share_to"))

_ROUNDING = 1e-6

_FIRST = "its first path"


def times_to_lengths(solved: pd.DataFrame) -> pd.DataFrame:
    """How soon each planner's best path was as short as each of `LEVELS`, by planner: the median
    over problems, where what was never reached takes for ever, and the share of those that were.

    A planner's `cost_history` says when; its path counts as no shorter than the judge found the
    last one, whatever it said. Without a history its one path comes in the end.

    Args:
        solved: verified successes in one environment, of every planner on the same problems.
    """
    solved = solved.astype({"length": float, "solve_s": float})
    best = solved.groupby("problem")["length"].min()
    rows = {}
    for planner, attempts in solved.groupby("planner", sort=False):
        shortest = best[attempts["problem"]].to_numpy(dtype=float)
        times = np.array([_times(*attempt) for attempt in _attempts(attempts, shortest)])
        rows[str(planner)] = _summed_up(times.reshape(-1, len(LEVELS)))
    table: pd.DataFrame = pd.DataFrame.from_dict(rows, orient="index", columns=list(COLUMNS))
    return table


def _attempts(attempts: pd.DataFrame, shortest: np.ndarray) -> Any:
    columns = (attempts[name] for name in ("stats", "solve_s", "length"))
    return zip(*columns, shortest, strict=True)


def _times(stats: str, solve_s: float, length: float, shortest: float) -> list[float]:
    """Seconds to each of `LEVELS`, infinite where it was not reached."""
    history = np.vstack([cost_history(stats), [solve_s, length]])
    costs = np.minimum.accumulate(np.maximum(history[:, 1], length))
    found = []
    for more in LEVELS.values():
        enough = costs <= (1 + more + _ROUNDING) * shortest
        found.append(float(history[int(np.argmax(enough)), 0]) if enough.any() else math.inf)
    return found


def _summed_up(times: np.ndarray) -> list[float]:
    numbers = []
    for of_level in times.T:
        reached = np.isfinite(of_level)
        numbers += [censored_median(of_level, reached), float(np.mean(reached))]
    return numbers


def held_to(selection: Mapping[str, Any], planner: str) -> str:
    """What a planner was held to in a run, in words: where it might stop before the time limit."""
    improves = selection.get("improves", {}).get(planner)
    stop = str(selection["settings"]["stop"])
    match = re.fullmatch(r"match:(.+):([0-9]+[.0-9e+-]*)", stop)
    if match:
        rule = f"{1 + float(match[2]):.4g} x {match[1]}'s"
    else:
        rule = {"first": _FIRST, "limit": "the time limit"}.get(stop, stop)
    if improves is False:
        return _FIRST
    return rule if improves or rule == _FIRST else f"{rule}, if it improves"
