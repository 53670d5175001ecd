"""The database that Planner Arena shows and OMPL's benchmark scripts work with.

The schema is that of OMPL's `ompl_benchmark_statistics.py`; Planner Arena's help page explains it
(M. Moll, I. A. Sucan, L. E. Kavraki: Benchmarking Motion Planning Algorithms, IEEE Robotics &
Automation Magazine 22(3), 2015). It tells columns apart by their place: what stands in
`experiments` after `setup` is a parameter, what stands in `runs` after `plannerid` is measured.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from bench.analysis.run_results import RunResults, repeats_of
from bench.analysis.summary import attempted_records, why_not_attempted
from bench.judging.metric import Metric
from bench.storage.record import LATE, Fault, Verdict, cost_history
from envs.problem import Array
from planners import Status

STATUSES = {
    outcome: value
    for value, outcome in enumerate(
        [
            *(verdict.value for verdict in Verdict),
            LATE,
            *(status.value for status in Status if status is not Status.EXACT_SOLUTION),
            *(fault.value for fault in Fault),
        ]
    )
}
"""The numbers of all outcomes, as the enumeration `status` has them."""

_SPENT = {
    "time": ("REAL", "solve_s"),
    "memory": ("REAL", "peak_memory_mb"),
    "collision_checks": ("INTEGER", "collision_checks"),
    "setup_time": ("REAL", "setup_s"),
    "training_time": ("REAL", "train_s"),
}
"""What every attempt costs: types, and columns of the records."""

_OMPLS = {
    "time_s": "solution_time",
    "length": "solution_length",
    "smoothness": "solution_smoothness",
    "waypoints": "solution_segments",
}
"""Metrics that OMPL has under another name; of waypoints there is one more than of segments."""

_JUDGED = {"status": "ENUM", "solved": "BOOLEAN", "correct_solution": "BOOLEAN"}


def _shown(run: RunResults) -> list[Metric]:
    """OMPL's, which are always there, and those of ours that have a value: Planner Arena cannot
    plot a column without."""
    return [
        metric
        for metric in run.metrics
        if metric.name in _OMPLS or run.records[metric.name].notna().any()
    ]


def _types(metrics: Sequence[Metric]) -> dict[str, str]:
    """The columns of `runs` besides keys, with their types: first what is spent on any attempt,
    then the metrics, which only verified successes have."""
    found = {_OMPLS.get(metric.name, metric.name): "REAL" for metric in metrics}
    return {
        **{name: kind for name, (kind, _) in _SPENT.items()},
        **found,
        "solution_segments": "INTEGER",
        **_JUDGED,
        "problem": "INTEGER",
    }


_CORRECT = {"": None, Verdict.NOT_JUDGED.value: None, Verdict.VALID.value: 1}
"""What stands there for verdicts; for all others 0."""

_TICKS = 100
"""Periodic samples within the time limit: OMPL's 50 ms if it is 5 s."""

_SCHEMA = """
PRAGMA foreign_keys = ON;
CREATE TABLE experiments
    (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512),
    totaltime REAL, timelimit REAL, memorylimit REAL, runcount INTEGER,
    version VARCHAR(128), hostname VARCHAR(1024), cpuinfo TEXT,
    date DATETIME, seed INTEGER, setup TEXT);
CREATE TABLE plannerConfigs
    (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512) NOT NULL, settings TEXT);
CREATE TABLE enums
    (name VARCHAR(512), value INTEGER, description TEXT, PRIMARY KEY (name, value));
CREATE TABLE runs
    (id INTEGER PRIMARY KEY AUTOINCREMENT, experimentid INTEGER, plannerid INTEGER,
    {measured},
    FOREIGN KEY (experimentid) REFERENCES experiments(id) ON DELETE CASCADE,
    FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON DELETE CASCADE);
CREATE TABLE progress
    (runid INTEGER, time REAL, best_cost REAL, PRIMARY KEY (runid, time),
    FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);
"""


def write(run: RunResults, file: Path) -> None:
    """Writes the database afresh; until it is whole, what was there before stays.

    An environment of a folder is an experiment, an attempt a run. Names and meanings are OMPL's
    where it has them. As there, `time` (s), `memory` (MB) and `collision_checks` are what was spent
    on any attempt, and what describes a path is NULL unless the attempt was a verified success
    (`solved`): `solution_length`, `solution_smoothness`, `solution_segments`, and besides the other
    metrics by their own names (OMPL's clearance is a mean over waypoints, none of ours), and
    `solution_time`, which is `time` without what failures took. `status` is the
    outcome, `correct_solution` what the judge says of a claimed path, NULL without one or if the
    judge did not decide. Times of what was planned elsewhere are NULL, as nobody measured them.
    `progress` has the best length over time of verified successes. What was not attempted is no
    run, since rates are of all runs: `setup` has the reason, by planner, as `not_attempted`.

    Raises:
        OSError: it cannot be written.
    """
    with TemporaryDirectory(dir=file.parent, prefix=f".{file.name}-") as folder:
        made = Path(folder) / file.name
        try:
            with closing(sqlite3.connect(made)) as connection, connection:
                columns = (f"{name} {kind}" for name, kind in _types(_shown(run)).items())
                connection.executescript(_SCHEMA.format(measured=", ".join(columns)))
                _fill(connection, run)
        except sqlite3.OperationalError as error:  # a full disk, for one
            raise OSError(f"{file}: {error}") from error
        made.replace(file)


def _fill(connection: sqlite3.Connection, run: RunResults) -> None:
    for outcome, value in STATUSES.items():
        row = {"name": "status", "value": value, "description": outcome}
        _insert(connection, "enums", row)
    sessions = {session["run_id"]: session for session in run.sessions}
    configs = _planner_configs(connection, attempted_records(run.records))
    for selection in run.selections:
        for env in selection["envs"]:
            asked = run.records["planner"].isin(selection["planners"])
            rows = run.records[asked & (run.records["env"] == env["id"])]
            if not rows.empty:
                measured = [sessions[r] for r in rows["run_id"].unique() if r in sessions]
                experiment = _experiment(env, selection, rows, measured)
                made = attempted_records(rows)
                _put_runs(connection, experiment, configs, made, _shown(run))


def _planner_configs(
    connection: sqlite3.Connection, records: pd.DataFrame
) -> dict[tuple[str, int], int]:
    """Planners and their versions to ids."""
    ids = {}
    known = records[["planner", "planner_version"]].drop_duplicates()
    for planner, version in known.itertuples(index=False):
        settings = json.dumps({"id": planner, "version": int(version)})
        config = {"name": planner, "settings": settings}
        ids[planner, version] = _insert(connection, "plannerConfigs", config)
    return ids


def _experiment(
    env: Mapping[str, Any],
    selection: Mapping[str, Any],
    rows: pd.DataFrame,
    sessions: list[dict[str, Any]],
) -> dict[str, Any]:
    """`totaltime` is that of the whole sessions, even if they measured other environments, too. A
    host's name is recorded nowhere: what system it has stands there."""
    settings = selection["settings"]
    machines = [session.get("machine", {}) for session in sessions]
    setup = {
        "environment": dict(env),
        "settings": settings,
        "versions": [session.get("versions", {}) for session in sessions],
        "git": [session.get("git") for session in sessions],
        "not_attempted": _not_attempted(rows),
    }
    return {
        "name": env["id"],
        "totaltime": sum(session["wall_s"] for session in sessions),
        "timelimit": settings["time_limit_s"],
        "memorylimit": settings.get("memory_limit_mb"),
        "runcount": _count(selection, env) * repeats_of(selection),
        "version": _version(sessions),
        "hostname": _distinct(machine.get("system") for machine in machines),
        "cpuinfo": _distinct(json.dumps(machine) for machine in machines if machine),
        "date": rows["measured_at"].min(),
        "seed": selection["seed"],
        "setup": json.dumps(setup, indent=2),
    }


def _count(selection: Mapping[str, Any], env: Mapping[str, Any]) -> int:
    """Of an environment's problems. Older runs say only which number comes after the last."""
    return int(env.get("count", env.get("problems", selection["problems"])))


def _not_attempted(rows: pd.DataFrame) -> dict[str, str]:
    """Reasons by planner."""
    reasons = {
        str(planner): why_not_attempted(attempts)
        for planner, attempts in rows.groupby("planner", sort=False)
    }
    return {planner: reason for planner, reason in reasons.items() if reason is not None}


def _version(sessions: list[dict[str, Any]]) -> str:
    """That of the last session. Planner Arena sorts versions by the numbers in them, so it must be
    numbers with dots; OMPL's script has zeros, too, for one that is not known."""
    known = [session.get("versions", {}).get("plannerbench") for session in sessions]
    return f"plannerbench {next(filter(None, reversed(known)), '0.0.0')}"


def _distinct(texts: Any) -> str:
    return "; ".join(dict.fromkeys(filter(None, texts)))


def _put_runs(
    connection: sqlite3.Connection,
    experiment: Mapping[str, Any],
    configs: Mapping[tuple[str, int], int],
    rows: pd.DataFrame,
    metrics: Sequence[Metric],
) -> None:
    number = _insert(connection, "experiments", experiment)
    for row in rows.to_dict("records"):
        config = configs[row["planner"], row["planner_version"]]
        keys = {"experimentid": number, "plannerid": config}
        run = _insert(connection, "runs", {**keys, **_attributes(row, metrics)})
        if row["solved"]:
            samples = _samples(cost_history(row["stats"]), row["solve_s"], experiment["timelimit"])
            connection.executemany(f"INSERT INTO progress VALUES ({run}, ?, ?)", samples)


def _samples(history: Array, end_s: float, limit_s: float) -> list[list[float]]:
    """Times and the best length at each: whenever it fell, and in between as periodically as OMPL
    asks its planners, until the end. Planner Arena smooths all runs' points into one curve, in
    which a run that had found its best path early would have no weight later on."""
    if not len(history):
        return []
    ticks = limit_s / _TICKS * np.arange(1, _TICKS + 1)
    asked = ticks[(ticks > history[0, 0]) & (ticks <= end_s)]
    times = np.unique(np.concatenate([history[:, 0], asked]))
    # Of two lengths at the same time the later is the best so far.
    latest = np.searchsorted(history[:, 0], times, side="right") - 1
    samples: list[list[float]] = np.column_stack([times, history[latest, 1]]).tolist()
    return samples


def _attributes(row: Mapping[Any, Any], metrics: Sequence[Metric]) -> dict[str, Any]:
    """What is known of an attempt, in the columns of `runs`."""
    spent = {name: _finite(row[column]) for name, (_, column) in _SPENT.items()}
    found = {_OMPLS.get(m.name, m.name): _finite(row[m.name]) for m in metrics}
    waypoints = found["solution_segments"]
    found["solution_segments"] = None if waypoints is None else int(waypoints) - 1
    return {
        **spent,
        **(found if row["solved"] else dict.fromkeys(found)),
        "status": STATUSES[row["outcome"]],
        "solved": row["solved"],
        "correct_solution": _CORRECT.get(row["verdict"], 0),
        "problem": row["problem"],
    }


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else value


def _insert(connection: sqlite3.Connection, table: str, row: Mapping[str, Any]) -> int:
    """The new row's id."""
    marks = ", ".join("?" * len(row))
    statement = f"INSERT INTO {table} ({', '.join(row)}) VALUES ({marks})"
    number = connection.execute(statement, tuple(row.values())).lastrowid
    assert number is not None
    return number
