"""The tables' cells as text, the same in every format.

Each printed number is a rounding of one in `summary.csv`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

NUMERIC = ("problems", "n", "offline s")
"""Columns to set flush right."""

SPREADS = {"std": "standard deviation", "var": "variance"}
"""What may stand after the ± of a mean, by the end of its column's name in the summary; the paper
has variances there."""

COMMON_NOTE = "On the problems that every planner solved:"

_NO_RATE = "-"

_LONGEST_REASON = 120


def success_note(spread: str) -> str:
    """What the main table's numbers are."""
    return (
        f"Time, length and safety margin are over verified successes: mean ± {SPREADS[spread]} "
        "(median). Success is of all attempts, with the 95 % Wilson interval; a dash stands where "
        "nothing was attempted, with the reason under outcomes. Offline is setup, "
        "and training of the weights in use."
    )


def success_rows(summary: pd.DataFrame, spread: str) -> list[dict[str, str]]:
    """The main table, column names to cells; see `bench.report.summary.summarise`.

    `spread` is one of `SPREADS`.
    """
    return [
        {
            "env": row["env"],
            "planner": row["planner"],
            "problems": f"{row['problems']}",
            "success %": success(row),
            "time s": _moments(row, "time_s", spread, 3),
            "length": _moments(row, "length", spread, 2),
            "safety margin": _moments(row, "safety_margin", spread, 2),
            "offline s": number(row["offline_s"], 2),
            "outcomes": counted(outcomes(row)) + because(row),
        }
        for row in summary.to_dict("records")
    ]


def common_rows(common: pd.DataFrame) -> list[dict[str, str]]:
    """The table of commonly solved problems; see `bench.report.summary.common_problems`."""
    return [
        {
            "env": row["env"],
            "planner": row["planner"],
            "n": f"{row['problems']}",
            "length": number(row["length_mean"], 2),
            "safety margin": number(row["safety_margin_mean"], 2),
        }
        for row in common.to_dict("records")
    ]


def success(row: dict[Any, Any]) -> str:
    """The success rate of a row of the summary, in percent, with its interval."""
    if pd.isna(row["success_rate"]):
        return _NO_RATE
    rate, low, high = (_percent(row[f"success_{what}"]) for what in ("rate", "low", "high"))
    return f"{rate} [{low}, {high}]"


def number(value: float, digits: int) -> str:
    """A number with so many decimals, a dash for none."""
    return "-" if pd.isna(value) else f"{value:.{digits}f}"


def duration(seconds: float) -> str:
    """Seconds in the unit that suits them: s, min, h or d."""
    if math.isnan(seconds):
        return "-"
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
    `bench.report.summary.left_out_of_common`."""
    parts = [
        f"`{planner}` in `{env}` ({count} solved)"
        for env, planners in left_out.items()
        for planner, count in planners.items()
    ]
    if not parts:
        return ""
    return f"Left out, as no problem was solved by all with them: {', '.join(parts)}."


def counted(outcomes: dict[str, str]) -> str:
    """Such counts as a cell."""
    return ", ".join(f"{name} {count}" for name, count in outcomes.items())


def _moments(row: dict[Any, Any], name: str, spread: str, digits: int) -> str:
    mean, around, median = (
        number(row[f"{name}_{of}"], digits) for of in ("mean", spread, "median")
    )
    return "-" if mean == "-" else f"{mean} ± {around} ({median})"


def _percent(rate: float) -> str:
    return f"{100 * rate:.1f}"
