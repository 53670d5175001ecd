"""Prints what neural time fields cost: data, a batch, and one problem beside fast marching:
python tests/benchmarks/field_cost.py, with OMP_NUM_THREADS=1 for one problem on one thread
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

import envs
import planners
from planners import Budget, Planner
from planners.fields.paper import sample_pairs
from planners.fields.physics import GroupPlan, GroupSampler, Space
from planners.fields.planner import FieldPlanner

PAIRS = 1_000_000


def main() -> None:
    env = envs.make("c3d")
    rng = np.random.default_rng(0)
    plan = GroupPlan()
    sampler = GroupSampler(Space.of(env), plan)
    draws = -(-PAIRS // (plan.groups * plan.starts * plan.goals))
    grouped = timed(lambda: [sampler.draw(rng) for _ in range(draws)])
    print(f"1M pairs in groups, with speeds: {grouped:.2f} s")
    published = timed(lambda: env.speed(sample_pairs(env, rng, PAIRS)[1]))
    print(f"1M pairs as published, with speeds: {published:.2f} s")

    field, fmm = FieldPlanner("ntfields"), planners.make("fmm")
    for planner in (field, fmm):
        planner.setup(env, seed=0)
    problems = env.sample_problems(1000, 5)
    field.solve_batch(problems[:10])
    print(f"1000 problems in one batch: {timed(lambda: field.solve_batch(problems)):.2f} s")

    def solving(planner: Planner, n: int) -> float:
        begun = [perf_counter()]
        for problem in problems[:n]:
            planner.solve(problem, Budget(begun[-1] + 60))
            begun.append(perf_counter())
        return float(np.median(np.diff(begun)))

    quick, slow = solving(field, 300), solving(fmm, 10)
    print(f"one problem, median: {1e3 * quick:.2f} ms; fmm {1e3 * slow:.0f} ms")
    print(f"ratio {slow / quick:.0f}")


def timed(work: Callable[[], object]) -> float:
    begin = perf_counter()
    work()
    return perf_counter() - begin


if __name__ == "__main__":
    main()
