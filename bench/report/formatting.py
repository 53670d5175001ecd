"""The tables' cells as text, the same in every format.

Each printed number is a rounding of one in `summary.csv`.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any

import pandas as pd

from bench.analysis import claims
from bench.analysis.run_results import RunResults
from bench.analysis.summary import CLAIMED_TIME
from bench.judging.metric import Metric

INVALID = "invalid"
"""The title of how many problems are invalid as posed, which no rate counts."""

NUMERIC = ("problems", INVALID, "n", "offline s", "scene s")
"""Columns to set flush right."""

SPREADS = {"std": "standard deviation", "var": "variance"}
"""What may stand after the ± of a mean, by the end of its column's name in the summary; the paper
has variances there."""

COMMON_NOTE = "On the problems that every planner solved:"

REACHED = {"best": "s to best", "5_percent": "s to +5 %", "20_percent": "s to +20 %"}
"""Titles of the seconds to common lengths, by `bench.analysis.timing.LEVELS`."""

REACHED_NOTE = (
    "Held to: when a planner might stop before the time limit, so that planning times compare only "
    "between planners held to the same. Seconds to the shortest path of all planners on the same "
    "problem, and to 5 and 20 % more: medians over these problems, where what was not reached "
    "takes for ever (a dash: most were not), and the share that was."
)

CLAIMED = "claimed s, not timed here"
"""The title of planning times of what was planned elsewhere, where there is any."""

BLOCKED_SUCCESS = "blocked: success %"
"""The title of success on the problems alone whose straight line is blocked."""

WORDS = ("held to",)
"""Columns of words, besides names and outcomes."""

NONE = "-"
"""The cell where there is nothing to tell."""

_LONGEST_REASON = 120


def success_note(run: RunResults) -> str:
    """What the main table's numbers are."""
    names = [metric.title for metric in _primary(run)]
    named = f"{', '.join(names[:-1])} and {names[-1]}".capitalize()
    return (
        f"{named} are over verified successes: mean ± {SPREADS[run.spread]} "
        "(median). Success is of all attempts, with the 95 % Wilson interval; a dash stands where "
        "nothing was attempted, with the reason under outcomes. Offline is setup, "
        "and training of the weights in use."
    )


_PLAIN_SPACE = re.compile(r"R\^\d+")


def spaces_note(run: RunResults) -> str:
    """The configuration spaces that are not R^n with a weight of 1; "" if there are none, or if the
    run is of before they were noted."""
    spaces = {env["id"]: env.get("space", "") for s in run.selections for env in s["envs"]}
    told = [
        f"`{env}` {space}"
        for env, space in spaces.items()
        if space and not _PLAIN_SPACE.fullmatch(space)
    ]
    if not told:
        return ""
    return (
        f"Configuration spaces: {', '.join(told)}. A number before a part is its weight in "
        "lengths, in which what turns counts in radians."
    )


def success_rows(run: RunResults) -> list[dict[str, str]]:
    """The main table, column names to cells: success and the primary metrics. Where it is known
    which straight lines are blocked, success and length on those problems have columns of their
    own.
    """
    summary = run.summary
    known = summary["blocked_attempted"].notna().any()
    has_claims = (summary["time_source"] == claims.CLAIMED).any()
    some_invalid = summary["invalid_problems"].any()
    return [
        {
            "env": row["env"],
            "planner": row["planner"],
            "problems": f"{row['problems']}",
            **({INVALID: f"{row['invalid_problems']}"} if some_invalid else {}),
            "success %": success(row),
            **{run.heading(m): _moments(row, m, run.spread) for m in _primary(run)},
            **({CLAIMED: _claimed(row, run.spread)} if has_claims else {}),
            **(_blocked(row, run) if known else {}),
            "offline s": number(row["offline_s"], 2),
            "outcomes": counted(outcomes(row)) + because(row),
        }
        for row in summary.to_dict("records")
    ]


FURTHER_NOTE = "Further metrics of verified successes, each as above:"


SCENE_TIME = "scene s"
"""The title of how long planners took to get ready for a problem's scene, in the median."""


def further_rows(run: RunResults) -> list[dict[str, str]]:
    """The table of the metrics that are not in the main one, of those that have values here, and of
    the time for problems' scenes."""
    summary = run.summary
    metrics = [
        metric
        for metric in run.metrics
        if not metric.primary and summary[f"{metric.name}_mean"].notna().any()
    ]
    has_scenes = summary["scene_s_median"].notna().any()
    if not metrics and not has_scenes:
        return []
    return [
        {
            "env": row["env"],
            "planner": row["planner"],
            **({SCENE_TIME: seconds(row["scene_s_median"], 3)} if has_scenes else {}),
            **{run.heading(metric): _moments(row, metric, run.spread) for metric in metrics},
        }
        for row in summary.to_dict("records")
    ]


def metric_columns(run: RunResults) -> dict[str, str]:
    """Of each metric's title in tables the column of the summary with its mean."""
    means = {run.heading(metric): f"{metric.name}_mean" for metric in run.metrics}
    return means | {blocked_length(run): "blocked_length_mean"}


def _primary(run: RunResults) -> list[Metric]:
    return [metric for metric in run.metrics if metric.primary]


def common_rows(run: RunResults) -> list[dict[str, str]]:
    """The table of commonly solved problems; see `bench.analysis.summary.common_problems`."""
    compared = [metric for metric in _primary(run) if not metric.timed]
    return [
        {
            "env": row["env"],
            "planner": row["planner"],
            "n": f"{row['problems']}",
            **{run.heading(m): number(row[f"{m.name}_mean"], m.digits) for m in compared},
            "held to": NONE if pd.isna(row["held_to"]) else str(row["held_to"]),
            **{title: _reached(row, level) for level, title in REACHED.items()},
        }
        for row in run.common.to_dict("records")
    ]


def _reached(row: dict[Any, Any], level: str) -> str:
    """How soon a planner came to a common length, and on how many of the problems."""
    time_s, share = row[f"time_s_to_{level}"], row[f"share_to_{level}"]
    if pd.isna(share):
        return NONE
    soon = seconds(time_s, 4) if math.isfinite(time_s) else NONE
    return f"{soon} ({100 * share:.0f} %)"


def blocked_length(run: RunResults) -> str:
    """The title of the length there."""
    [length] = [metric for metric in run.metrics if metric.name == "length"]
    return f"blocked: {run.heading(length)}"


def _blocked(row: dict[Any, Any], run: RunResults) -> dict[str, str]:
    """What a planner did where the straight line is blocked."""
    rate = row["blocked_success_rate"]
    return {
        BLOCKED_SUCCESS: NONE if pd.isna(rate) else _percent(rate),
        blocked_length(run): number(row["blocked_length_mean"], 2),
    }


def success(row: dict[Any, Any]) -> str:
    """The success rate of a row of the summary, in percent, with its interval."""
    if pd.isna(row["success_rate"]):
        return NONE
    rate, low, high = (_percent(row[f"success_{what}"]) for what in ("rate", "low", "high"))
    return f"{rate} [{low}, {high}]"


def number(value: float, digits: int) -> str:
    """A number with so many decimals, a dash for none."""
    return NONE if pd.isna(value) else f"{value:.{digits}f}"


_SHORTEST = 6
"""Decimals of seconds, at most."""


def seconds(value: float, digits: int) -> str:
    """As `number`, with more decimals, down to microseconds, where two digits need them: planners
    take from microseconds to minutes."""
    if not 0 < abs(value) < math.inf:
        return number(value, digits)
    of_two_digits = 1 - Decimal(repr(float(value))).adjusted()
    return number(value, max(digits, min(of_two_digits, _SHORTEST)))


_PLOTTED_DIGITS = 5
"""That can be told apart in a plot."""


def plotted(value: float) -> float | None:
    """A number as plots are given it, None for what is infinite or none."""
    return float(f"{value:.{_PLOTTED_DIGITS}g}") if math.isfinite(value) else None


def duration(seconds: float) -> str:
    """Seconds in the unit that suits them: s, min, h or d."""
    if math.isnan(seconds):
        return NONE
    for least, unit in ((2 * 86_400, "d"), (2 * 3600, "h"), (120, "min")):
        if seconds >= least:
            length = {"d": 86_400, "h": 3600, "min": 60}[unit]
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.3g} s"


def outcomes(row: dict[Any, Any]) -> dict[str, str]:
    """How often what came of attempts, of a row of the summary; success with another planner's
    help is counted again."""
    counts = {name: f"{count}" for name, count in json.loads(row["status_counts"]).items()}
    if not pd.isna(row["fallbacks"]):
        counts["with fallback"] = f"{row['fallbacks']:.0f}"
    return counts


def because(row: dict[Any, Any]) -> str:
    """Why a planner was not attempted, of a row of the summary, in one short line; empty if it
    was."""
    reason = row["reason"]
    if pd.isna(reason):
        return ""
    words = " ".join(str(reason).split())
    return f": {words if len(words) <= _LONGEST_REASON else words[: _LONGEST_REASON - 1] + '…'}"


def left_out_note(left_out: Mapping[str, Mapping[str, int]]) -> str:
    """Who is not in the table of commonly solved problems, empty if all are there; see
    `bench.analysis.summary.left_out_of_common`."""
    parts = [
        f"`{planner}` in `{env}` ({count} solved)"
        for env, planners in left_out.items()
        for planner, count in planners.items()
    ]
    if not parts:
        return ""
    reason = "with them no problem, or none whose straight line is blocked, was solved by all"
    return f"Left out, as {reason}: {', '.join(parts)}."


def counted(outcomes: dict[str, str]) -> str:
    """Such counts as a cell."""
    return ", ".join(f"{name} {count}" for name, count in outcomes.items())


_DIGITS_OF_CLAIMS = 3


def _claimed(row: dict[Any, Any], spread: str) -> str:
    return _spread(row, CLAIMED_TIME, _DIGITS_OF_CLAIMS, spread, seconds)


def _moments(row: dict[Any, Any], metric: Metric, spread: str) -> str:
    written = seconds if metric.unit == "s" else number
    return _spread(row, metric.name, metric.digits, spread, written)


def _spread(
    row: dict[Any, Any],
    name: str,
    digits: int,
    spread: str,
    written: Callable[[float, int], str],
) -> str:
    mean, around, median = (
        written(row[f"{name}_{of}"], digits) for of in ("mean", spread, "median")
    )
    return NONE if mean == NONE else f"{mean} ± {around} ({median})"


def _percent(rate: float) -> str:
    return f"{100 * rate:.1f}"
