"""The files of a run's folder besides the store."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bench.report import markdown, summary
from bench.store import Store

FORMATS = ("md", "csv")


def selected_records(store: Store, selection: dict[str, Any]) -> pd.DataFrame:
    """The records of what was asked for last."""
    fingerprints = [env["fingerprint"] for env in selection["envs"]]
    rows = store.records(fingerprints, selection["seed"], selection["settings_digest"])
    wanted = rows["planner"].isin(selection["planners"]) & (rows["problem"] < selection["problems"])
    ranked = rows[wanted].assign(
        env_rank=rows["env_fingerprint"].map(fingerprints.index),
        planner_rank=rows["planner"].map({p: i for i, p in enumerate(selection["planners"])}),
    )
    ordered = ranked.sort_values(["env_rank", "planner_rank", "problem"], ignore_index=True)
    chosen: pd.DataFrame = ordered.drop(columns=["env_rank", "planner_rank"])
    return chosen


def write(
    folder: Path, records: pd.DataFrame, selection: dict[str, Any], formats: Sequence[str]
) -> str:
    """Writes `summary.csv` and `summary.md` as asked for; the Markdown text either way."""
    order = [(env["id"], p) for env in selection["envs"] for p in selection["planners"]]
    rows = summary.summarise(records, order)
    text = markdown.tables(rows, summary.common_problems(records), caption(selection))
    if "csv" in formats:
        rows.to_csv(folder / "summary.csv", index=False)
    if "md" in formats:
        (folder / "summary.md").write_text(text, encoding="utf-8")
    return text


def caption(selection: dict[str, Any]) -> str:
    """How the numbers came about, in a line."""
    settings = selection["settings"]
    text = (
        f"{selection['problems']} problems an environment, seed {selection['seed']}, "
        f"time limit {settings['time_limit_s']:g} s, stop rule `{settings['stop']}`, "
        f"{settings['jobs']} at a time."
    )
    for env in selection["envs"]:
        if env.get("census"):
            facts = ", ".join(
                f"{what.replace('_', ' ')} {n:g}" for what, n in env["census"].items()
            )
            text += f" Problems of {env['id']}: {facts}."
    return text


def write_manifest(
    folder: Path, records: pd.DataFrame, selection: dict[str, Any], sessions: list[dict[str, Any]]
) -> None:
    """Writes `manifest.json`: what was asked for, and each session that measured some of it."""
    measured = [s for s in sessions if s["run_id"] in set(records["run_id"])]
    capacity = sum(s["wall_s"] * s["jobs"] for s in measured)
    planning = sum(s["setup_s"] + s["solve_s"] for s in measured)
    manifest = {
        **selection,
        "overhead_share": round(1 - planning / capacity, 4) if capacity else None,
        "sessions": measured,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
