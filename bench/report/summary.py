"""One row per environment and planner, from records."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pandas as pd

from bench.record import NOT_ATTEMPTED, Verdict
from bench.stats import censored_median, wilson_interval

COLUMNS = (
    "env",
    "planner",
    "problems",
    "solved",
    "success_rate",
    "success_low",
    "success_high",
    "time_s_mean",
    "time_s_std",
    "time_s_var",
    "time_s_median",
    "time_s_median_censored",
    "length_mean",
    "length_std",
    "length_var",
    "length_median",
    "safety_margin_mean",
    "safety_margin_std",
    "safety_margin_var",
    "safety_margin_median",
    "setup_s",
    "train_s",
    "offline_s",
    "status_counts",
    "fallbacks",
)

_MEASURED = {"time_s": "solve_s", "length": "length", "safety_margin": "safety_margin"}


def summarise(records: pd.DataFrame, order: Sequence[tuple[str, str]]) -> pd.DataFrame:
    """Success with its 95 % Wilson interval, and what verified successes cost.

    Means, (sample) standard deviations and variances, and medians are over verified successes;
    rates over all attempts, and so is `time_s_median_censored`, in which a failure takes for ever.
    `status_counts` is JSON: how many attempts had each outcome. `setup_s` is the longest, since a
    restarted process sets up again; `offline_s` adds training to it. `fallbacks` counts the
    verified successes that needed another planner's help, of planners whose `stats` say so.

    Args:
        records: rows of the store.
        order: (env, planner) of the rows wanted, in their order; those without records are left
            out.
    """
    groups = dict(tuple(records.groupby(["env", "planner"], sort=False)))
    rows = [
        _row(env, planner, groups[env, planner])
        for env, planner in order
        if (env, planner) in groups
    ]
    table: pd.DataFrame = pd.DataFrame(rows, columns=list(COLUMNS))
    return table


def _row(env: str, planner: str, records: pd.DataFrame) -> dict[str, object]:
    successes = records["outcome"] == Verdict.VALID.value
    solved = records[successes]
    low, high = wilson_interval(len(solved), len(records))
    row: dict[str, object] = {
        "env": env,
        "planner": planner,
        "problems": len(records),
        "solved": len(solved),
        "success_rate": len(solved) / len(records),
        "success_low": low,
        "success_high": high,
        "setup_s": records["setup_s"].astype(float).max(),
        "train_s": records["train_s"].astype(float).max(),
        "offline_s": records["setup_s"].astype(float).max()
        + records["train_s"].astype(float).max(),
        "status_counts": json.dumps(records["outcome"].value_counts().to_dict()),
        "fallbacks": _fallbacks(solved),
        "time_s_median_censored": censored_median(records["solve_s"].astype(float), successes),
    }
    for name, column in _MEASURED.items():
        values = solved[column].astype(float)
        row[f"{name}_mean"] = values.mean()
        row[f"{name}_std"], row[f"{name}_var"] = values.std(), values.var()
        row[f"{name}_median"] = values.median()
    return row


def _fallbacks(solved: pd.DataFrame) -> int | None:
    counts = [json.loads(stats).get("fallbacks") for stats in solved["stats"]]
    known = [count for count in counts if isinstance(count, int)]
    return sum(count > 0 for count in known) if known else None


def common_problems(records: pd.DataFrame) -> pd.DataFrame:
    """Length and margin where they compare: on the problems that every planner solved.

    Planners that do not support an environment do not take part there. One row per environment
    and planner, with `problems`, the number of common ones.
    """
    columns = ["env", "planner", "problems", *(f"{n}_mean" for n in _MEASURED if n != "time_s")]
    rows = []
    taking_part = records[~records["status"].isin(NOT_ATTEMPTED)]
    for env, group in taking_part.groupby("env", sort=False):
        planners = group["planner"].nunique()
        solved = group[group["outcome"] == Verdict.VALID.value]
        counts = solved.groupby("problem")["planner"].nunique()
        common = solved[solved["problem"].isin(counts.index[counts == planners])]
        for planner in group["planner"].unique():
            own = common[common["planner"] == planner]
            rows.append(
                {
                    "env": env,
                    "planner": planner,
                    "problems": len(own),
                    "length_mean": own["length"].astype(float).mean(),
                    "safety_margin_mean": own["safety_margin"].astype(float).mean(),
                }
            )
    table: pd.DataFrame = pd.DataFrame(rows, columns=columns)
    return table


def attempted(records: pd.DataFrame) -> bool:
    """Whether anything was measured at all."""
    return bool((~records["status"].isin(NOT_ATTEMPTED)).any())
