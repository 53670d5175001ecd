"""Prints the time of `fmm` beside a bare scikit-fmm solve of the same grid, taken in turn:
python tests/benchmarks/fmm_cost.py
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
import skfmm

import envs
import planners
from planners import Budget


def main() -> None:
    env = envs.make("c3d")
    planner = planners.make("fmm")
    planner.setup(env, seed=1)
    axis = np.linspace(env.lower[0], env.upper[0], 100)
    spacing = float(axis[1] - axis[0])
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    speed = env.speed(nodes.reshape(-1, 3)).reshape(100, 100, 100)
    whole, bare = [], []
    for problem in env.sample_problems(30, 7):
        begin = perf_counter()
        planner.solve(problem, Budget(begin + 60))
        whole.append(perf_counter() - begin)
        source = np.linalg.norm(nodes - problem.goal, axis=-1) - 1.5 * spacing
        begin = perf_counter()
        skfmm.travel_time(source, speed, dx=spacing, order=2)
        bare.append(perf_counter() - begin)
    print(
        f"fmm median {np.median(whole):.3f} s, scikit-fmm alone {np.median(bare):.3f} s, ", end=""
    )
    print(f"ratio of medians {np.median(whole) / np.median(bare):.3f}")


if __name__ == "__main__":
    main()
