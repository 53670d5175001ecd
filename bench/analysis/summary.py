"""One row per environment and planner, from records."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

import pandas as pd

from bench.analysis import claims, timing
from bench.analysis.statistics import censored_median, clustered_wilson_interval
from bench.analysis.timing import cpu_shares
from bench.judging.metric import Metric
from bench.storage.record import LEFT_OUT, NOT_ATTEMPTED, Fault, Verdict

_MOMENTS = ("mean", "std", "var", "median")

CLAIMED_TIME = "claimed_time_s"

_FIRST = ("env", "planner", "problems", "solved", "success_rate", "success_low", "success_high")
_REST = (
    *("setup_s", "train_s", "offline_s", "status_counts", "fallbacks", "attempted", "reason"),
    *("cpu_share_median", "processors", "scene_s_median", "invalid_problems"),
    *("blocked_attempted", "blocked_solved", "blocked_success_rate", "blocked_length_mean"),
    "held_to",
    *timing.COLUMNS,
    *("time_source", *(f"{CLAIMED_TIME}_{name}" for name in _MOMENTS)),
)

_PROBLEM = ["env_fingerprint", "problem"]
"""What tells a problem from others, also where several environments are summed up as one."""

CENSORED_TIME = "time_s_median_censored"

NONE_VALID = "no problem is valid as posed; `bench problems` says why"

_FAULTS = [fault.value for fault in Fault if fault.value not in NOT_ATTEMPTED]
_LONGEST_FAULT = 200


def columns(metrics: Sequence[Metric]) -> list[str]:
    """Those of `summarise`: of the primary metrics in the middle, of the others at the end."""
    primary = [name for metric in metrics if metric.primary for name in _columns_of(metric)]
    others = [name for metric in metrics if not metric.primary for name in _columns_of(metric)]
    return [*_FIRST, *primary, *_REST, *others]


def _columns_of(metric: Metric) -> list[str]:
    names = [f"{metric.name}_{moment}" for moment in _MOMENTS]
    return [*names, CENSORED_TIME] if metric.name == "time_s" else names


def summarise(
    records: pd.DataFrame, order: Sequence[tuple[str, str]], metrics: Sequence[Metric]
) -> pd.DataFrame:
    """Success with its 95 % Wilson interval, and what verified successes cost.

    Means, (sample) standard deviations and variances, and medians are over verified successes;
    rates over the `attempted` problems (without UNSUPPORTED, SKIPPED and INVALID_PROBLEM ones; how
    many problems are of the last is `invalid_problems`), and so is
    `time_s_median_censored`, in which a failure takes for ever. Where none was attempted nothing is
    known but the `reason`: rates, times and costs are empty. `status_counts` is JSON: how many
    attempts had each outcome. `setup_s` is the longest, since a restarted process sets up again;
    `offline_s` adds training to it. `fallbacks` counts the verified successes that needed another
    planner's help, of planners whose `stats` say so. `cpu_share_median` is how much of a core an
    attempt had while it planned (`shared_cores`), `processors` how many processors there
    were, by name. `scene_s_median` is of getting ready for problems' scenes, empty where all have
    the same. What was planned elsewhere has no times, setting up included, but `claimed_time_s` of
    verified successes; `time_source` says so. Columns with `blocked_` in front are of the problems
    whose straight line is blocked, empty where that is not known. `held_to`, and what is of common
    lengths, is for `RunResults.summary` to say.

    Args:
        records: rows of the store, which may have a column `blocked`.
        order: (env, planner) of the rows wanted, in their order; those without records are left
            out.
        metrics: each has its moments over verified successes, empty where none has a value.
    """
    groups = dict(tuple(records.groupby(["env", "planner"], sort=False)))
    rows = [
        _row(env, planner, groups[env, planner], metrics)
        for env, planner in order
        if (env, planner) in groups
    ]
    table: pd.DataFrame = pd.DataFrame(rows, columns=columns(metrics))
    return table


def _row(
    env: str, planner: str, all_records: pd.DataFrame, metrics: Sequence[Metric]
) -> dict[str, object]:
    records = attempted_records(all_records)
    successes = records["outcome"] == Verdict.VALID.value
    solved = records[successes]
    low, high = _success_interval(records, successes)
    setup_s, train_s = (records[name].astype(float).max() for name in ("setup_s", "train_s"))
    row: dict[str, object] = {
        "env": env,
        "planner": planner,
        "problems": _problems_of(all_records),
        "attempted": len(records),
        "solved": len(solved),
        "success_rate": len(solved) / len(records) if len(records) else math.nan,
        "success_low": low,
        "success_high": high,
        "setup_s": setup_s,
        "train_s": train_s,
        "offline_s": setup_s + train_s,
        "status_counts": json.dumps(all_records["outcome"].value_counts().to_dict()),
        "fallbacks": _fallbacks(solved),
        CENSORED_TIME: _censored_time(claims.planned_here(records)),
        "time_source": claims.time_source(records),
        "reason": why_not_attempted(all_records),
        "cpu_share_median": cpu_shares(records).median(),
        "scene_s_median": records["scene_s"].astype(float).median(),
        "invalid_problems": _problems_of(all_records[_are_invalid(all_records)]),
        "processors": records.loc[records["processor"] != "", "processor"].nunique(),
    }
    for metric in metrics:
        row |= _moments(metric.name, solved[metric.name])
    if claims.were_planned_elsewhere(records):
        row |= _moments(CLAIMED_TIME, solved[claims.CLAIMED_S])
    return row | _of_blocked(records)


def _censored_time(records: pd.DataFrame) -> float:
    solved = records["outcome"] == Verdict.VALID.value
    return censored_median(records["solve_s"].astype(float), solved)


def _moments(name: str, column: pd.Series) -> dict[str, object]:
    values = column.astype(float)
    moments = values.mean(), values.std(), values.var(), values.median()
    return {f"{name}_{what}": moment for what, moment in zip(_MOMENTS, moments, strict=True)}


def _problems_of(records: pd.DataFrame) -> int:
    """How many problems they are of."""
    return int(records.groupby(_PROBLEM).ngroups)


def _are_invalid(records: pd.DataFrame) -> pd.Series:
    """Which are of problems that cannot be solved as they are posed."""
    invalid: pd.Series = records["status"] == Fault.INVALID_PROBLEM.value
    return invalid


def _success_interval(records: pd.DataFrame, successes: pd.Series) -> tuple[float, float]:
    """Of the success rate; attempts at one problem are not independent of each other."""
    if records.empty:
        return math.nan, math.nan
    by_problem = successes.groupby([records[column] for column in _PROBLEM])
    return clustered_wilson_interval(by_problem.sum(), by_problem.count())


def _of_blocked(records: pd.DataFrame) -> dict[str, object]:
    known = records["blocked"].dropna() if "blocked" in records else pd.Series(dtype=bool)
    if known.empty:
        return {}
    blocked = records.loc[known.index[known.astype(bool)]]
    solved = blocked[blocked["outcome"] == Verdict.VALID.value]
    return {
        "blocked_attempted": len(blocked),
        "blocked_solved": len(solved),
        "blocked_success_rate": len(solved) / len(blocked) if len(blocked) else math.nan,
        "blocked_length_mean": solved["length"].astype(float).mean(),
    }


def _fallbacks(solved: pd.DataFrame) -> int | None:
    counts = [json.loads(stats).get("fallbacks") for stats in solved["stats"]]
    known = [count for count in counts if isinstance(count, int)]
    return sum(count > 0 for count in known) if known else None


def why_not_attempted(records: pd.DataFrame) -> str | None:
    """Why a planner was not attempted, in a line; None if it always was."""
    told = records.loc[records["status"].isin(LEFT_OUT), "error"]
    if told.empty:
        return NONE_VALID if len(records) and _are_invalid(records).all() else None
    lines = [str(text).strip().partition("\n")[0] for text in told.unique() if text]
    return "; ".join(lines) or "it did not say why"


def faults(records: pd.DataFrame) -> list[str]:
    """A line for each environment, planner and fault: how often, and what was said the first time.
    Of an exception that is the last line of its traceback, of anything else the first."""
    words = records["error"].fillna("").str.strip()
    told = records[records["status"].isin(_FAULTS) & (words != "")]
    lines = []
    for (env, planner, status), rows in told.groupby(["env", "planner", "status"], sort=False):
        first = rows.iloc[0]
        said = str(first["error"]).strip().splitlines()
        why = said[-1 if status == Fault.ERROR.value else 0].strip().rstrip(".")
        if len(why) > _LONGEST_FAULT:
            why = f"{why[: _LONGEST_FAULT - 1]}…"
        times = f"{len(rows)} {status}" + (", first" if len(rows) > 1 else "")
        lines.append(f"`{planner}` in `{env}`: {times} on problem {first['problem']}: {why}")
    return lines


def common_problems(records: pd.DataFrame, metrics: Sequence[Metric]) -> pd.DataFrame:
    """Means of the primary metrics where they compare: on the problems that every planner solved,
    besides those in `left_out_of_common`. Of times, which compare only under the same stop rule,
    there is how soon each reached common lengths.

    Planners that do not support an environment do not take part there. One row per environment
    and planner, with `problems`, the number of common ones, and how soon it reached common lengths
    there (`bench.analysis.timing.times_to_lengths`).
    """
    compared = [metric.name for metric in metrics if metric.primary and not metric.timed]
    means = [f"{name}_mean" for name in compared]
    rows = []
    for env, group in attempted_records(records).groupby("env", sort=False):
        left_out = _left_out(group)
        planners = [planner for planner in group["planner"].unique() if planner not in left_out]
        common = _commonly_solved(group, planners)
        reached = timing.times_to_lengths(common).reindex(planners)
        for planner in planners:
            own = common[common["planner"] == planner]
            rows.append(
                {
                    "env": env,
                    "planner": planner,
                    "problems": len(own),
                    **{f"{name}_mean": own[name].astype(float).mean() for name in compared},
                    **reached.loc[planner].to_dict(),
                }
            )
    titles = ["env", "planner", "problems", *means, *timing.COLUMNS]
    table: pd.DataFrame = pd.DataFrame(rows, columns=titles)
    return table


def left_out_of_common(records: pd.DataFrame) -> dict[str, dict[str, int]]:
    """By environment, planners without whom there are commonly solved problems, or more than two
    planners to compare on them, and how many problems each solved: those that solved none; those
    that solved none whose straight line is blocked, if two others did, since on straight lines
    there is nothing to compare; and then, as long as the others have none in common, the one that
    solved fewest.

    `records` may have a column `blocked`, as in `summarise`.
    """
    groups = attempted_records(records).groupby("env", sort=False)
    found = {str(env): _left_out(group) for env, group in groups}
    return {env: left_out for env, left_out in found.items() if left_out}


def _left_out(attempts: pd.DataFrame) -> dict[str, int]:
    solved = attempts[attempts["outcome"] == Verdict.VALID.value]
    order = attempts["planner"].unique()
    counts = solved["planner"].value_counts().reindex(order, fill_value=0)
    rest = counts[_tells(solved, counts)].sort_values(kind="stable", ascending=False)
    left_out = counts[~counts.index.isin(rest.index)]
    while len(rest) > 2 and _commonly_solved(attempts, list(rest.index)).empty:
        left_out = pd.concat([left_out, rest.iloc[-1:]])
        rest = rest.iloc[:-1]
    return {str(planner): int(count) for planner, count in left_out.items()}


def _tells(solved: pd.DataFrame, counts: pd.Series) -> pd.Series:
    """Which planners, by how many problems each solved, solved some that tell planners apart."""
    if "blocked" in solved:
        blocked = solved[solved["blocked"].isin([True])]
        solved_blocked = blocked["planner"].value_counts().reindex(counts.index, fill_value=0)
        if (solved_blocked > 0).sum() >= 2:
            counts = solved_blocked
    tells: pd.Series = counts > 0
    return tells


def _commonly_solved(attempts: pd.DataFrame, planners: Sequence[str]) -> pd.DataFrame:
    """The attempts at problems that all of some planners solved; of several attempts at a problem,
    those with the same number."""
    solved = attempts[(attempts["outcome"] == Verdict.VALID.value)]
    solved = solved[solved["planner"].isin(planners)]
    counts = solved.groupby(["problem", "repeat"])["planner"].transform("nunique")
    common: pd.DataFrame = solved[counts == len(planners)]
    return common


def attempted_records(records: pd.DataFrame) -> pd.DataFrame:
    """The rows in which something was measured."""
    made: pd.DataFrame = records[~records["status"].isin(NOT_ATTEMPTED)]
    return made


def attempted(records: pd.DataFrame) -> bool:
    """Whether anything was measured at all."""
    return not attempted_records(records).empty
