"""Runs of records made by hand, for tests of reports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bench.analysis.run_results import RunResults
from bench.storage.record import COLUMNS, encode_path


def row(planner: str, problem: int, outcome: str, **others: Any) -> dict[str, Any]:
    """An attempt in c3d, claimed if the judge had something to say of it; `path` is an array."""
    judged = outcome in ("VALID", "COLLISION", "LATE")
    path = others.pop("path", None)
    return {
        **dict.fromkeys(COLUMNS),
        "run_id": "r",
        "env": "c3d",
        "env_fingerprint": "f",
        "planner": planner,
        "planner_version": 1,
        "weights": "",
        "problem": problem,
        "problems_seed": 0,
        "settings": "s",
        "seed": 0,
        "status": "EXACT_SOLUTION" if judged else outcome,
        "verdict": outcome if judged else "",
        "outcome": outcome,
        "solved": int(outcome == "VALID"),
        "setup_s": 1.0,
        "train_s": 2.0,
        "warm": 1,
        "processor": "P",
        "measured_at": "2026-01-01T00:00:00",
        "error": "",
        "stats": "{}",
        "path": encode_path(path),
        **others,
    }


def recorded(rows: Sequence[dict[str, Any]], **selection: Any) -> RunResults:
    """A run of such rows, whose planners are in the order in which they appear."""
    records = pd.DataFrame(rows, columns=list(COLUMNS))
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
