"""Verdict and metrics of attempts: of one that was just made, and of stored ones that lack some."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import pandas as pd

from bench.execution.worker_process import Attempt
from bench.judging.judge import Judge, Judgement
from bench.judging.metric import Metric, SolvedAttempt, measure
from bench.judging.metrics import REGISTERED
from bench.judging.simplification import Simplifier
from bench.storage.record import (
    KEY,
    OF_ANY_PATH,
    VERSIONS,
    Verdict,
    cost_history,
    decode_path,
    metrics_of,
    versions_of,
)
from bench.storage.store import Store
from envs import Environment, Path, Problem

logger = logging.getLogger(__name__)

_SOME = 100
"""Rows after which what was computed is stored."""


def judged(
    judge: Judge, problem: Problem, attempt: Attempt, simplifier: Simplifier | None = None
) -> Judgement | None:
    """What the judge finds of an attempt, with the metrics of a valid path; None if it claims
    none."""
    if not attempt.claims:
        return None
    costs = attempt.solve_s, attempt.cpu_s, attempt.stats
    return judged_path(judge, problem, attempt.path, *costs, simplifier)


def judged_path(
    judge: Judge,
    problem: Problem,
    path: Any,
    solve_s: float | None = None,
    cpu_s: float | None = None,
    stats: Mapping[str, Any] = MappingProxyType({}),
    simplifier: Simplifier | None = None,
) -> Judgement:
    """What the judge finds of a path, as whatever was claimed, with its metrics if it is valid."""
    found = judge(problem, path)
    if found.verdict is not Verdict.VALID or found.safety_margin is None:
        return found
    history = cost_history(json.dumps(dict(stats)))
    waypoints, scene = Path(path).waypoints, judge.scene_of(problem)
    simplified = None if simplifier is None else simplifier(scene, problem, waypoints)
    if simplified is not None and judge(problem, simplified.path).verdict is not Verdict.VALID:
        simplified = None
    facts = SolvedAttempt(solve_s, cpu_s, found.safety_margin, history, stats, simplified)
    return replace(found, metrics=measure(REGISTERED, scene, problem, waypoints, facts))


def stored_metrics(judgement: Judgement | None) -> str:
    """A record's `metrics`: of a valid path all, of another what means something of it, too."""
    if judgement is None:
        return "{}"
    if judgement.metrics:
        return _with_versions(judgement.metrics)
    known = {name: getattr(judgement, name) for name in OF_ANY_PATH}
    return json.dumps({name: value for name, value in known.items() if value is not None})


def _with_versions(values: Mapping[str, float | None]) -> str:
    """Values as a record keeps them, with the versions of the metrics that have one."""
    versions = {m.name: m.version for m in REGISTERED if m.version and m.name in values}
    return json.dumps({**values, **({VERSIONS: versions} if versions else {})})


def add_missing_metrics(
    store: Store, held: pd.DataFrame, env: Environment, problems: Mapping[int, Problem]
) -> None:
    """Computes what stored solutions have no value of, since they were made before there was the
    metric, or by another version of it, from their paths as they were judged.

    Args:
        held: rows of the store, in this environment.
        problems: by index; rows of others stay as they are.

    Raises:
        InputError: the store cannot be written to.
    """
    valid = held[(held["verdict"] == Verdict.VALID.value) & held["problem"].isin(list(problems))]
    rows = [(row, missing) for row in valid.to_dict("records") if (missing := _missing(row))]
    if rows:
        names = dict.fromkeys(metric.name for _, missing in rows for metric in missing)
        logger.info("computing %s of %d stored solutions", ", ".join(names), len(rows))
    for begin in range(0, len(rows), _SOME):
        store.add_metrics(list(_completed(rows[begin : begin + _SOME], env, problems)))


def _missing(row: Mapping[Any, Any]) -> list[Metric]:
    known, versions = metrics_of(row["metrics"]), versions_of(row["metrics"])
    return [
        metric
        for metric in REGISTERED
        if metric.name not in known or versions.get(metric.name, "") != metric.version
    ]


def _completed(
    rows: list[tuple[dict[Any, Any], list[Metric]]],
    env: Environment,
    problems: Mapping[int, Problem],
) -> Iterator[tuple[list[Any], str]]:
    """Keys of rows, and their metrics with what they lacked."""
    for row, missing in rows:
        facts = SolvedAttempt(
            row["solve_s"],
            row["cpu_s"],
            row["safety_margin"],
            cost_history(row["stats"]),
            json.loads(row["stats"]),
        )
        path = decode_path(row["path"])
        problem = problems[row["problem"]]
        found = measure(missing, env.scene_of(problem), problem, path, facts)
        anew = {metric.name for metric in missing}
        kept = {n: v for n, v in metrics_of(row["metrics"]).items() if n not in anew}
        yield [row[name] for name in KEY], _with_versions(kept | found)
