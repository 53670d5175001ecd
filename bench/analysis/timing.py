"""How times compare: the machines that they were measured on, times to common lengths, and how the
best length of planners that go on improving falls with time.

Planning times of planners that stop by different rules do not compare; how long each takes to
reach the same length does.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bench.analysis import claims
from bench.analysis.statistics import censored_median, improvement
from bench.storage.record import NOT_ATTEMPTED, Verdict, cost_history
from envs.problem import Array

LEAST_SHARE = 0.9
"""Less of a core than this is told."""

_MANY = 0.1
"""The share of a planner's attempts that may have had less without a word."""

_SHORTEST_S = 0.02
"""Of shorter attempts the processor's time, which systems count in steps, says nothing."""


def cpu_shares(records: pd.DataFrame) -> pd.Series:
    """How much of a core each attempt had while it planned: the processor's time of it, threads and
    children included, by its planning time. Attempts that were short, or of which it is not known,
    are left out."""
    planned = records["solve_s"].astype(float)
    shares: pd.Series = (records["cpu_s"].astype(float) / planned)[planned >= _SHORTEST_S]
    return shares.dropna()


def remarks(records: pd.DataFrame, sessions: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line for each environment whose rows are of several machines, and for each planner that
    often had less than `LEAST_SHARE` of a core. They say what was measured, not why: a planner that
    waits, by design or for a disk, looks like one whose core was busy."""
    made = claims.planned_here(records[~records["status"].isin(NOT_ATTEMPTED)])
    machines = {session["run_id"]: session.get("machine") for session in sessions}
    return [*_of_machines(made, machines), *_of_cores(made)]


def _of_machines(made: pd.DataFrame, machines: Mapping[str, Any]) -> Iterator[str]:
    for env, attempts in made.groupby("env", sort=False):
        sources = attempts[["run_id", "processor"]].fillna("").drop_duplicates()
        places = _places(list(sources.itertuples(index=False, name=None)), machines)
        names = _told_apart(list(dict.fromkeys(places.values())))
        if len(names) > 1:
            keys = zip(attempts["run_id"], attempts["processor"].fillna(""), strict=True)
            where = pd.Series([places[key] for key in keys], index=attempts.index)
            parts = [
                f"{name} ({_counted(attempts.loc[where == place, 'planner'])})"
                for place, name in names.items()
            ]
            yield (
                f"times in `{env}` are of {len(parts)} machines, or of some that are not known, "
                f"and do not compare between them: {'; '.join(parts)}"
            )


def _places(
    sources: Sequence[tuple[str, str]], machines: Mapping[str, Any]
) -> dict[tuple[str, str], str]:
    """What tells the place of some sessions' rows from others, as JSON, by session and processor. A
    session that was cut off has left no more than its rows' processor, which may be that of a
    machine that another one knows, or not even that."""
    whole = {
        source: json.dumps(machines[source[0]], sort_keys=True)
        for source in sources
        if machines.get(source[0]) is not None
    }
    by_processor = {json.loads(place).get("processor"): place for place in whole.values()}
    places = {}
    for source in sources:
        run_id, processor = source
        told = {"processor": processor} if processor else {"session": run_id}
        known = by_processor.get(processor or None, json.dumps(told))
        places[source] = whole.get(source, known if processor else json.dumps(told))
    return places


def _told_apart(places: Sequence[str]) -> dict[str, str]:
    """Machines by name, those of one name with what else differs between them."""
    told = {}
    names = {place: _name(place) for place in places}
    for place, name in names.items():
        facts = json.loads(place)
        others = [json.loads(o) for o, n in names.items() if n == name and o != place]
        differing = [
            f"{key.replace('_', ' ')} {value}"
            for key, value in facts.items()
            if any(other.get(key) != value for other in others)
        ]
        told[place] = ", ".join([name, *differing])
    return told


def _name(place: str) -> str:
    return str(json.loads(place).get("processor", "one that is not known"))


def _counted(planners: pd.Series) -> str:
    counts = planners.value_counts(sort=False)
    return ", ".join(f"`{planner}` {count}" for planner, count in counts.items())


def _of_cores(made: pd.DataFrame) -> Iterator[str]:
    for (env, planner), attempts in made.groupby(["env", "planner"], sort=False):
        shares = cpu_shares(attempts)
        low = int((shares < LEAST_SHARE).sum())
        if low > _MANY * len(shares):
            load = attempts["load"].astype(float).median()
            busy = "" if np.isnan(load) else f"; other programs kept {load:.1f} cores busy"
            yield (
                f"`{planner}` in `{env}` had less than {100 * LEAST_SHARE:.0f} % of a core in "
                f"{low} of {len(shares)} attempts, {100 * shares.median():.0f} % in the median"
                f"{busy}"
            )


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
        solved: verified successes in one environment, of every planner on the same problems. What
            was planned elsewhere has lengths, but no times, and no row.
    """
    solved = solved.astype({"length": float, "solve_s": float})
    best = solved.groupby("problem")["length"].min()
    rows = {}
    for planner, attempts in claims.planned_here(solved).groupby("planner", sort=False):
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
    if planner in selection.get(claims.ELSEWHERE, ()):
        return "planned elsewhere"
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


_TIMES = 80
_SOONEST_S = 1e-6


@dataclass(frozen=True)
class Anytime:
    """A planner's best length over time.

    Attributes:
        times_s: (k,) seconds, in geometric progression up to the time limit.
        cost, low, high: (k,) the median of the best lengths by then over all problems, infinite
            where no more than half are solved, and the ends of its 95 % interval, which assumes no
            distribution.
        first: seconds in which half of the attempts had a first solution, and the median length
            then; None if half never had one.
    """

    times_s: Array
    cost: Array
    low: Array
    high: Array
    first: tuple[float, float] | None


def anytime(records: pd.DataFrame, limit_s: float) -> Anytime | None:
    """Of a planner's attempts; None if it keeps no history. What was no verified success in the end
    is infinitely long from the start. Of several attempts at a problem the median counts.

    Args:
        records: rows of one planner, of one environment or one problem.
        limit_s: the time limit.
    """
    solved = (records["outcome"] == Verdict.VALID.value).to_numpy(dtype=bool)
    histories = [
        cost_history(stats) if ok else np.zeros((0, 2))
        for stats, ok in zip(records["stats"], solved, strict=True)
    ]
    begun = [history[0, 0] for history in histories if len(history)]
    if not begun:
        return None
    # The first solution is not lost to rounding.
    times = np.geomspace(max(min(begun), _SOONEST_S), limit_s, _TIMES) * (1 + 1e-9)
    problems = records["problem"].to_numpy()
    several = len(np.unique(problems)) > 1
    curve = improvement(
        [history.tolist() for history in histories], times, problems=problems if several else None
    )
    return Anytime(
        times, curve.cost, curve.cost_low, curve.cost_high, _first(histories, times, curve.cost)
    )


def _first(histories: list[Array], times: Array, cost: Array) -> tuple[float, float] | None:
    has_one = np.array([len(history) > 0 for history in histories])
    when = np.array([history[0, 0] if len(history) else np.nan for history in histories])
    half_s = censored_median(when, has_one)
    if not np.isfinite(half_s):
        return None
    by_then = cost[min(int(np.searchsorted(times, half_s)), len(times) - 1)]
    return (half_s, float(by_then)) if np.isfinite(by_then) else None
