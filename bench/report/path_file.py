"""A run's paths as a file that `bench judge` and the planner `recorded` read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import envs
import planners
from bench.analysis import claims
from bench.analysis.run_results import RunResults
from bench.storage.record import NOT_ATTEMPTED, Verdict, decode_path
from envs import InputError
from envs.errors import UnknownNameError, printable
from planners import Status
from planners.recorded import path_file
from planners.recorded.path_file import PathFile, RecordedPath


def write(
    run: RunResults, file: Path, planner: str | None = None, env: str | None = None, repeat: int = 0
) -> int:
    """Writes what one planner did in one environment: every path as it was judged, with its
    problem, planning time and status, and of every other attempt the problem and what came of it.
    A path that the judge found to be malformed is left out, so that the claim stays malformed.

    Args:
        planner, env: as on the command line; either may be left out where the run has only one.
        repeat: which of the attempts at each problem, from 0.

    Returns:
        How many attempts.

    Raises:
        InputError: the run has no such planner, environment or attempts, or the file cannot be
            written.
    """
    known = list(dict.fromkeys(name for name, _ in run.order))
    env = _chosen("env", env, known, envs.REGISTRY.id_among)
    known = [name for where, name in run.order if where == env]
    planner = _chosen("planner", planner, known, planners.REGISTRY.id_among)
    rows = run.records[(run.records["env"] == env) & (run.records["planner"] == planner)]
    rows = rows[(rows["repeat"] == repeat) & ~rows["status"].isin(NOT_ATTEMPTED)]
    if rows.empty:
        raise InputError(f"{run.folders[0]} has no attempts of {planner} in {env} to write")
    first = rows.iloc[0]
    paths = [_recorded(row) for row in rows.to_dict("records")]
    fingerprint, seed = str(first["env_fingerprint"]), int(first["problems_seed"])
    path_file.write(PathFile(tuple(paths), fingerprint, seed), file)
    return len(paths)


def _chosen(kind: str, name: str | None, known: Sequence[str], id_among: Any) -> str:
    if name is None:
        if len(known) > 1:
            raise InputError(f"--{kind}: the run has several; choose one of {', '.join(known)}")
        return known[0]
    id: str = id_among(name, known)
    if id not in known:
        raise UnknownNameError(f"{kind} of the run", id, known)
    return id


def _recorded(row: Mapping[Any, Any]) -> RecordedPath:
    told = row["status"] in [status.value for status in Status]
    judged = row["path"] is not None and row["verdict"] not in ("", Verdict.MALFORMED.value)
    took = row[claims.CLAIMED_S] if row[claims.ELSEWHERE] else row["solve_s"]
    error = str(row["error"] or "").strip().splitlines()
    failure = "" if told else f"{row['status']}: {error[-1] if error else ''}"
    return RecordedPath(
        decode_path(row["path"]) if judged else None,
        int(row["problem"]),
        None if took is None or took != took else float(took),
        Status(row["status"]) if told else Status.TIMEOUT,
        printable(" ".join(failure.split())),
    )
