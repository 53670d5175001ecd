"""Writes how long fast marching takes from one source on arms of 4, 5 and 6 joints with 11, 21 and
51 nodes along each axis, as in the paper's appendix, and what IEF3D's data would take with a
million fields. What would not fit in memory is not tried.

python tests/benchmarks/fmm_dimensions.py results/arms/fmm_dimensions.csv
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
import psutil

import envs
from planners.fast_marching import SpeedGrid

ARMS = ("arm4", "arm5", "arm6")
RESOLUTIONS = (11, 21, 51)
REPEATS = 3  # of solves of less than `LONG` seconds; the median counts
LONG = 30.0

BYTES_PER_NODE = 80
"""What a solve holds at its peak: 16 of our speeds and distances, 20 to 45 of scikit-fmm's and the
times were seen."""

FIELDS = 1_000_000
"""Of IEF3D's data: one for each pair of configurations, as in the paper."""


def main() -> None:
    rows = []
    for arm, resolution in product(ARMS, RESOLUTIONS):
        rows.append(measured(arm, resolution))
        print(rows[-1], flush=True)
        if len(sys.argv) > 1:  # what is there so far: the whole takes half an hour
            Path(sys.argv[1]).parent.mkdir(parents=True, exist_ok=True)
            pd.DataFrame(rows).to_csv(sys.argv[1], index=False)
    print(pd.DataFrame(rows).to_markdown(index=False))


def measured(arm: str, resolution: int) -> dict[str, object]:
    """A row of the table."""
    env = envs.make(arm)
    nodes = resolution**env.dimension
    row: dict[str, object] = {
        "env": arm,
        "dimension": env.dimension,
        "resolution": resolution,
        "nodes": nodes,
        "memory_gb": round(BYTES_PER_NODE * nodes / 1e9, 3),
    }
    if BYTES_PER_NODE * nodes > psutil.virtual_memory().available:
        return row | {"outcome": "out of memory, by prediction"}
    begin = perf_counter()
    grid = SpeedGrid(env, resolution, order=2)
    speeds_s = perf_counter() - begin
    [problem] = env.sample_problems(1, 0)
    solves: list[float] = []
    while len(solves) < REPEATS and (not solves or solves[0] < LONG):
        begin = perf_counter()
        grid.arrival_times(problem.goal)
        solves.append(perf_counter() - begin)
    solve_s = float(np.median(solves))
    return row | {
        "outcome": "solved",
        "speeds_s": round(speeds_s, 3),
        "solve_s": round(solve_s, 4),
        "ief3d_data_hours": round(solve_s * FIELDS / 3600, 2),
    }


if __name__ == "__main__":
    main()
