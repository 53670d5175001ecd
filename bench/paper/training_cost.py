"""What was spent before planning: making data and training, from the weights' manifests."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pandas as pd

import envs
import planners
from bench.analysis.comparison import ComparisonVerdict
from bench.paper.experiment import Experiment, Place, Section, Table
from bench.report import formatting
from envs import InputError
from planners.learning import weight_files
from planners.learning.learned_planner import LearnedPlanner
from planners.learning.weight_files import Manifest

_HOW = (
    "Ours is what the manifests of the weights in use say; each is of one training, on the machine "
    "named, without a GPU. So no verdict is given."
)


@dataclass(frozen=True, kw_only=True)
class Offline(Experiment):
    """Data generation and training time.

    Attributes:
        rows: environment and planner of each.
    """

    rows: tuple[tuple[str, str], ...]

    def carried_out(self, place: Place) -> Section:
        theirs = place.figures(self.name).set_index(["env", "planner"])
        rows = [_row(env, planner, theirs) for env, planner in self.rows]
        table = Table([_cells(row) for row in rows], pd.DataFrame(rows))
        return Section(self.name, self.heading, self.caption(_HOW), table)


def _row(env: str, planner: str, theirs: pd.DataFrame) -> dict[str, Any]:
    manifest = _manifest(env, planner)
    paper: Any = theirs.loc[(env, planner)] if (env, planner) in theirs.index else None
    described: Any = {} if manifest is None else manifest.machine.get("machine", {})
    return {
        "env": env,
        "planner": planner,
        "data_s": math.nan if manifest is None else manifest.data_s,
        "train_s": math.nan if manifest is None else manifest.train_s,
        "cores": described.get("physical_cores", math.nan),
        "processor": described.get("processor", ""),
        "paper_data_s": math.nan if paper is None else float(paper["data_s"]),
        "paper_train_s": math.nan if paper is None else float(paper["train_s"]),
        "verdict": ComparisonVerdict.NOT_COMPARABLE.value,
        "reason": "no weights here" if manifest is None else _reason(paper),
    }


def _reason(paper: Any) -> str:
    return "not in the paper's table" if paper is None else "other machines, one training each"


def _manifest(env: str, planner: str) -> Manifest | None:
    """That of the weights that runs use."""
    world, made = envs.make(env), planners.make(planner)
    if not isinstance(made, LearnedPlanner):
        raise InputError(f"{planner} is not trained, so it has no place in a table of training")
    file = made.weights_file(world)
    return None if file is None else weight_files.read(file, made.name, made.domain(world))[1]


def _cells(row: dict[str, Any]) -> dict[str, str]:
    machine = f"{row['cores']} cores, {row['processor']}" if row["processor"] else "-"
    return {
        "env": row["env"],
        "planner": row["planner"],
        "data": formatting.duration(row["data_s"]),
        "paper's data": formatting.duration(row["paper_data_s"]),
        "training": formatting.duration(row["train_s"]),
        "paper's training": formatting.duration(row["paper_train_s"]),
        "machine": machine,
        "verdict": f"**{row['verdict']}**: {row['reason']}",
    }
