"""Attempts that were planned elsewhere: their times are claims, and are kept apart from what was
measured here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from bench.storage.record import claimed_solve_s

ELSEWHERE, CLAIMED_S = "planned_elsewhere", "claimed_solve_s"
"""Columns that `with_claims` adds."""

CLAIM = "claimed, not timed here"

_OFFLINE = ("setup_s", "train_s", "scene_s")

MEASURED, CLAIMED = "measured", "claimed"
"""Where times are from."""


def with_claims(records: pd.DataFrame, selection: Mapping[str, Any]) -> pd.DataFrame:
    """Records of a run with two more columns: whether the path was planned elsewhere, and the
    seconds that were claimed of it, NaN without a claim. What reading a file took here is not what
    setting up took there, and becomes NaN.

    Args:
        selection: of the run; older ones do not say, as there was nothing then.
    """
    elsewhere = records["planner"].isin(selection.get(ELSEWHERE, ()))
    claimed = [
        claimed_solve_s(stats) if there else None
        for there, stats in zip(elsewhere, records["stats"], strict=True)
    ]
    columns: dict[str, Any] = {
        ELSEWHERE: elsewhere,
        CLAIMED_S: np.array(claimed, dtype=float),
        **{name: records[name].mask(elsewhere) for name in _OFFLINE},
    }
    whole: pd.DataFrame = records.assign(**columns)
    return whole


def were_planned_elsewhere(attempts: pd.DataFrame) -> bool:
    """Whether any of some attempts was. Records may lack the column, as none were then."""
    return ELSEWHERE in attempts and bool(attempts[ELSEWHERE].any())


def time_source(attempts: pd.DataFrame) -> str | None:
    """Where one planner's times are from; None without attempts."""
    if attempts.empty:
        return None
    return CLAIMED if were_planned_elsewhere(attempts) else MEASURED


def planned_here(records: pd.DataFrame) -> pd.DataFrame:
    """The rows whose times were measured here."""
    if ELSEWHERE not in records:
        return records
    here: pd.DataFrame = records[~records[ELSEWHERE].astype(bool)]
    return here


def remarks(records: pd.DataFrame) -> Iterator[str]:
    """A line for each environment and planner whose paths were planned elsewhere."""
    for (env, planner), attempts in records.groupby(["env", "planner"], sort=False):
        if were_planned_elsewhere(attempts):
            yield (
                f"`{planner}` in `{env}` was planned elsewhere: its times are {CLAIM}, and in no "
                "comparison of times; its paths are judged as all others"
            )
