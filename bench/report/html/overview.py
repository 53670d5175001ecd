"""What the page shows of all problems together, as JSON data: outcomes and curves."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from bench.record import Verdict
from bench.report.html.arenas import Arena
from bench.report.html.curves import Curve, best_by, solved_by

_DIGITS = 5  # that can be told apart in a plot


def overview_data(arena: Arena, numbers: dict[str, int]) -> dict[str, Any]:
    """An arena's `outcomes`: for each of its `problems` a list of the words of its `planners`, None
    without an attempt; and its curves, lists of objects with `planner` and what follows:

    - `solved`: `x` seconds, `y` the share of attempts verified by then;
    - `costs`: `x` seconds, `y` the median of the best length so far, `low` and `high` the ends of
      its interval; None where infinite;
    - `time`, `length`, `margin`: `values` of verified successes.

    Args:
        numbers: the planners' among all of the page.
    """
    table = arena.records.pivot(index="problem", columns="planner", values="outcome")
    table = table.reindex(index=arena.problems, columns=arena.planners)

    def curves(of: Callable[[pd.DataFrame], Curve | None]) -> list[dict[str, Any]]:
        groups = arena.measured.groupby("planner", sort=False)
        made = [(str(planner), of(records)) for planner, records in groups]
        return [{"planner": numbers[name], **_listed(curve)} for name, curve in made if curve]

    return {
        "title": arena.env,
        "limit": arena.time_limit_s,
        "planners": [numbers[planner] for planner in arena.planners],
        "problems": arena.problems,
        "outcomes": table.astype(object).where(table.notna(), None).to_numpy().tolist(),
        "solved": curves(partial(solved_by, limit_s=arena.time_limit_s)),
        "costs": curves(partial(best_by, limit_s=arena.time_limit_s)),
        "time": curves(partial(_values, column="solve_s")),
        "length": curves(partial(_values, column="length")),
        "margin": curves(partial(_values, column="safety_margin")),
    }


def _values(records: pd.DataFrame, column: str) -> Curve | None:
    values = records.loc[records["outcome"] == Verdict.VALID.value, column].dropna()
    return {"values": values.to_numpy(dtype=np.float64)} if len(values) else None


def _listed(curve: Curve) -> dict[str, list[float | None]]:
    """Arrays as lists, with None for what is infinite."""
    return {name: [_short(value) for value in values] for name, values in curve.items()}


def _short(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
