"""What fast marching costs by dimension and resolution, on arms."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pandas as pd
import psutil

import envs
from bench.analysis.comparison import ComparisonVerdict
from bench.paper.experiment import Experiment, Place, Section, Table
from bench.report import formatting
from planners.fast_marching import SpeedGrid

logger = logging.getLogger(__name__)

BYTES_PER_NODE = 80
"""What a solve holds at its peak: 16 of our speeds and distances, 20 to 45 of scikit-fmm's and the
times were seen."""

_REPEATS, _LONG = 3, 30.0
"""Solves of less than so many seconds are repeated; the median counts."""

SOLVED, TOO_LARGE, LEFT_OUT = "solved", "out of memory, by prediction", "left out by --quick"

_HOW = (
    "One front from one source, of first order, in seconds of one core; data is what IEF3D's would "
    "take with a million of them. What would not fit in memory is not tried."
)


@dataclass(frozen=True, kw_only=True)
class Dimensions(Experiment):
    """Fast marching on grids of arms' joints.

    Attributes:
        env: arms.
        resolutions: nodes along each axis.
        fields: solves that IEF3D's data takes, one a pair as in the paper.
        quick_nodes: how many nodes a grid may have for a quick look.
    """

    env: tuple[str, ...]
    resolutions: tuple[int, ...]
    fields: int = 1_000_000
    quick_nodes: int = 1_000_000

    def carried_out(self, place: Place) -> Section:
        file = place.out / f"{self.name}-measured.csv"
        most = self.quick_nodes if place.quick else math.inf
        for env in self.env:
            for resolution in self.resolutions:
                _measure_once(file, env, resolution, most)
        held = sorted(_held(file), key=lambda row: (row["dimension"], row["resolution"]))
        rows = [self._beside(row, place.figures(self.name)) for row in held]
        table = Table([_cells(row) for row in rows], pd.DataFrame(rows))
        scaled = f"Quick look: grids of more than {self.quick_nodes} nodes are left out."
        return Section(
            self.name, self.heading, self.caption(scaled if place.quick else "", _HOW), table
        )

    def _beside(self, row: dict[str, Any], figures: pd.DataFrame) -> dict[str, Any]:
        same = (figures["env"] == row["env"]) & (figures["resolution"] == row["resolution"])
        [theirs] = figures[same].to_dict("records")
        solved = row["outcome"] == SOLVED
        return {
            **row,
            "ief3d_data_s": row["solve_s"] * self.fields if solved else math.nan,
            "paper_solve_s": theirs["solve_s"],
            "paper_ief3d_data_s": theirs["ief3d_data_s"],
            "verdict": ComparisonVerdict.NOT_COMPARABLE.value,
            "reason": "other machines, one source" if solved else row["outcome"],
        }


def _held(file: Path) -> list[dict[str, Any]]:
    if not file.is_file():
        return []
    rows: list[dict[str, Any]] = pd.read_csv(file).to_dict("records")  # type: ignore[assignment]
    return rows


def _measure_once(file: Path, env: str, resolution: int, most_nodes: float) -> None:
    """Adds a row to the file, unless it holds that solve: the largest grids take long."""
    held = _held(file)
    same = [row for row in held if row["env"] == env and row["resolution"] == resolution]
    if any(row["outcome"] == SOLVED for row in same):
        return
    row = measured(env, resolution, most_nodes)
    others = [one for one in held if one not in same]
    pd.DataFrame([*others, row]).to_csv(file, index=False)


def measured(env: str, resolution: int, most_nodes: float = math.inf) -> dict[str, Any]:
    """What a solve costs on a grid with so many nodes along each axis of an environment.

    `speeds_s` are the seconds that the speeds on the nodes take, `solve_s` those of a front from
    one source, both of one core.
    """
    world = envs.make(env)
    nodes = resolution**world.dimension
    row: dict[str, Any] = {
        "env": env,
        "dimension": world.dimension,
        "resolution": resolution,
        "nodes": nodes,
        "memory_gb": round(BYTES_PER_NODE * nodes / 1e9, 3),
        "speeds_s": math.nan,
        "solve_s": math.nan,
    }
    if BYTES_PER_NODE * nodes > psutil.virtual_memory().available:
        return row | {"outcome": TOO_LARGE}
    if nodes > most_nodes:
        return row | {"outcome": LEFT_OUT}
    logger.info("fast marching on %s with %d nodes along each axis", env, resolution)
    begin = process_time()
    grid = SpeedGrid(world, resolution, order=1)
    speeds_s = process_time() - begin
    [problem] = world.sample_problems(1, 0)
    solves: list[float] = []
    while len(solves) < _REPEATS and (not solves or solves[0] < _LONG):
        begin = process_time()
        grid.arrival_times(problem.goal)
        solves.append(process_time() - begin)
    return row | {"outcome": SOLVED, "speeds_s": speeds_s, "solve_s": float(np.median(solves))}


def _cells(row: dict[str, Any]) -> dict[str, str]:
    return {
        "env": row["env"],
        "resolution": f"{row['resolution']}",
        "nodes": f"{row['nodes']:.3g}",
        "memory GB": f"{row['memory_gb']:.3g}",
        "solve": formatting.duration(row["solve_s"])
        if row["outcome"] == SOLVED
        else row["outcome"],
        "paper's solve": formatting.duration(row["paper_solve_s"]),
        "IEF3D's data": formatting.duration(row["ief3d_data_s"]),
        "paper's data": formatting.duration(row["paper_ief3d_data_s"]),
        "verdict": f"**{row['verdict']}**: {row['reason']}",
    }
