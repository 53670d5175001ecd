"""The tables as Markdown, for the terminal and `summary.md`."""

from __future__ import annotations

import json
from typing import Any

import pandas as pd


def tables(summary: pd.DataFrame, common: pd.DataFrame, caption: str) -> str:
    """Both tables with their captions: all attempts, and the commonly solved problems.

    Args:
        summary, common: as `bench.report.summary` makes them.
        caption: a line on how it was measured.
    """
    parts = [
        caption,
        _success_table(summary),
        "Time, length and safety margin are over verified successes: mean ± standard deviation "
        "(median). Success is of all attempts, with the 95 % Wilson interval. Offline is setup, "
        "and training of the weights in use.",
        "On the problems that every planner solved:",
        _common_table(common),
    ]
    return "\n\n".join(parts) + "\n"


def _success_table(summary: pd.DataFrame) -> str:
    rows = [
        {
            "env": row["env"],
            "planner": row["planner"],
            "problems": row["problems"],
            "success %": f"{_percent(row['success_rate'])} "
            f"[{_percent(row['success_low'])}, {_percent(row['success_high'])}]",
            "time s": _spread(row, "time_s", 3),
            "length": _spread(row, "length", 2),
            "safety margin": _spread(row, "safety_margin", 2),
            "offline s": f"{row['setup_s'] + row['train_s']:.2f}",
            "outcomes": _outcomes(row),
        }
        for row in summary.to_dict("records")
    ]
    return _markdown(rows)


def _common_table(common: pd.DataFrame) -> str:
    rows = [
        {
            "env": row["env"],
            "planner": row["planner"],
            "n": row["problems"],
            "length": _number(row["length_mean"], 2),
            "safety margin": _number(row["safety_margin_mean"], 2),
        }
        for row in common.to_dict("records")
    ]
    return _markdown(rows)


def _outcomes(row: dict[Any, Any]) -> str:
    counts = json.loads(row["status_counts"])
    texts = [f"{name} {count}" for name, count in counts.items()]
    if not pd.isna(row["fallbacks"]):
        texts.append(f"with fallback {row['fallbacks']:.0f}")
    return ", ".join(texts)


def _markdown(rows: list[dict[str, Any]]) -> str:
    if not rows:
        return "(none)"
    aligned = ["right" if key in ("problems", "n", "offline s") else "left" for key in rows[0]]
    text: str = pd.DataFrame(rows).to_markdown(index=False, colalign=aligned, disable_numparse=True)
    return text


def _spread(row: dict[Any, Any], name: str, digits: int) -> str:
    if pd.isna(row[f"{name}_mean"]):
        return "-"
    spread = _number(row[f"{name}_std"], digits)
    return f"{row[f'{name}_mean']:.{digits}f} ± {spread} ({row[f'{name}_median']:.{digits}f})"


def _number(value: float, digits: int) -> str:
    return "-" if pd.isna(value) else f"{value:.{digits}f}"


def _percent(rate: float) -> str:
    return f"{100 * rate:.1f}"
