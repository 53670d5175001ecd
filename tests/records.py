"""Runs of records made by hand, for tests of reports."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bench.analysis.run_results import RunResults
from bench.judging.metrics import REGISTERED
from bench.storage.record import COLUMNS, Record, encode_path, with_metrics

METRICS = [metric.name for metric in REGISTERED]


def row(planner: str, problem: int, outcome: str, **others: Any) -> dict[str, Any]:
    """An attempt in c3d, claimed if the judge had something to say of it; `path` is an array, and
    values of metrics have their names."""
    judged = outcome in ("VALID", "COLLISION", "LATE")
    path = others.pop("path", None)
    values = {name: others.pop(name) for name in METRICS if name in others}
    if outcome == "VALID":
        values = {"time_s": others.get("solve_s"), **values}
    return {
        **dict.fromkeys(COLUMNS),
        "metrics": json.dumps(values),
        "run_id": "r",
        "env": "c3d",
        "env_fingerprint": "f",
        "planner": planner,
        "planner_version": 1,
        "weights": "",
        "problem": problem,
        "repeat": 0,
        "problems_seed": 0,
        "settings": "s",
        "seed": 0,
        "status": "EXACT_SOLUTION" if judged else outcome,
        "verdict": outcome if judged else "",
        "outcome": outcome,
        "solved": int(outcome == "VALID"),
        "setup_s": 1.0,
        "train_s": 2.0,
        "scene_s": None,
        "warm": 1,
        "processor": "P",
        "measured_at": "2026-01-01T00:00:00",
        "error": "",
        "stats": "{}",
        "path": encode_path(path),
        **others,
    }


def value(row: dict[str, Any], metric: str) -> Any:
    """Of such a row."""
    return json.loads(row["metrics"])[metric]


def changed(row: dict[str, Any], **values: Any) -> dict[str, Any]:
    """Such a row with other values of metrics."""
    return {**row, "metrics": json.dumps(json.loads(row["metrics"]) | values)}


def frame_of(rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Such rows as a run's records, with a column for each metric."""
    records = with_metrics(pd.DataFrame(rows, columns=list(COLUMNS)))
    missing = [name for name in METRICS if name not in records]
    return records.assign(**dict.fromkeys(missing, math.nan))


def recorded(rows: Sequence[dict[str, Any]], **selection: Any) -> RunResults:
    """A run of such rows, whose planners are in the order in which they appear."""
    records = frame_of(rows)
    chosen = {
        "envs": [{"id": env, "fingerprint": "f"} for env in records["env"].unique()],
        "planners": records["planner"].unique().tolist(),
        "problems": int(records["problem"].max()) + 1,
        "seed": 0,
        "settings": {"time_limit_s": 5.0, "stop": "first", "jobs": 1},
        "settings_digest": "s",
    }
    session = {
        "run_id": "r",
        "started_at": "2026-01-01T00:00:00",
        "wall_s": 10.0,
        "jobs": 1,
        "setup_s": 1.0,
        "solve_s": 5.0,
    }
    return RunResults((Path("somewhere"),), ({**chosen, **selection},), records, (session,))


def record_of(row: dict[str, Any]) -> Record:
    """Such a row as a record, to be stored."""
    return Record(**{name: row[name] for name in COLUMNS})
