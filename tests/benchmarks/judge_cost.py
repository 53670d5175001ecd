"""Prints what the judge costs on typical c3d paths: python tests/benchmarks/judge_cost.py

Typical is a path of fast marching, thinned to about 40 waypoints, on 40 problems.
"""

from __future__ import annotations

from itertools import pairwise
from time import perf_counter

import numpy as np

import envs
import planners
from bench.judging.judge import Judge
from planners import Budget


def main() -> None:
    env = envs.make("c3d")
    planner = planners.make("fmm")
    planner.setup(env, seed=1)
    judge, model = Judge(env), env.collision_model()
    rows = []
    for problem in env.sample_problems(40, 7):
        path = np.asarray(planner.solve(problem, Budget(perf_counter() + 60)).path)
        path = path[np.unique(np.linspace(0, len(path) - 1, 40).astype(int))]
        begin = perf_counter()
        free = all(model.segment_is_free(a, b) for a, b in pairwise(path))
        checked = perf_counter()
        model.min_clearance(path)
        margin = perf_counter()
        judge(problem, path)
        judged = perf_counter()
        if free:
            times = np.diff([begin, checked, margin, judged]) * 1000
            rows.append([len(path), env.space.length(path), *times])
    names = ("waypoints", "length", "free? ms", "margin ms", "whole verdict ms")
    for name, column in zip(names, np.array(rows).T, strict=True):
        print(f"{name:>18}: median {np.median(column):7.2f}   maximum {column.max():7.2f}")


if __name__ == "__main__":
    main()
