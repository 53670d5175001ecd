"""Prints times and errors of the two solvers of `fmm` on c3d, taken in turn:
python tests/benchmarks/fmm_solvers.py [PROBLEMS] [WITH_ERRORS] [RESOLUTION]

Times are seconds of one core, of all that a query takes: `field` a whole field on the nodes,
distances and what is carried between grids included; `planner` the whole of `solve`, for which
scikit-fmm follows the front only as far as it needs. Errors, of the first WITH_ERRORS problems, are
relative, at nodes in free space outside twice the sphere about the goal, from the mean of both
solvers' fields on grids three times as fine (a minute a problem). The gap between these says how
far that is to be trusted.
"""

from __future__ import annotations

import sys
from time import process_time

import numpy as np

import envs
import planners
from envs import Environment, Problem
from envs.grid import node_axes, node_positions
from planners import Budget
from planners.fast_marching import SpeedGrid
from planners.fronts import solver_named

SOLVERS = ("skfmm", "eikonalfm")
FINER = 3


class Comparison:
    """Of both solvers on one environment."""

    def __init__(self, env: Environment, resolution: int) -> None:
        self.env = env
        self.grids = self._grids(resolution)
        self.finer = self._grids(FINER * (resolution - 1) + 1)
        self.nodes = node_positions(node_axes(env.lower, env.upper, [resolution] * 3))
        clearance = env.clearance(self.nodes.reshape(-1, 3))
        self.free = clearance.reshape(self.nodes.shape[:-1]) > 0
        texts = [f"fmm:resolution={resolution},solver={name}" for name in SOLVERS]
        self.planners = [planners.make(text) for text in texts]
        for planner in self.planners:
            planner.setup(env, seed=1)

    def _grids(self, resolution: int) -> list[SpeedGrid]:
        return [SpeedGrid(self.env, resolution, 2, solver_named(name)) for name in SOLVERS]

    def times(self, problem: Problem, order: tuple[int, int]) -> list[float]:
        """Of both solvers' fields, and of both planners."""
        field_s, planner_s = [0.0, 0.0], [0.0, 0.0]
        for i in order:
            begin = process_time()
            self.grids[i].arrival_times(problem.goal)
            field_s[i] = process_time() - begin
            begin = process_time()
            self.planners[i].solve(problem, Budget(np.inf))
            planner_s[i] = process_time() - begin
        return [*field_s, *planner_s]

    def errors(self, goal: np.ndarray) -> list[float]:
        """Of both solvers, and the gap between their finer fields."""
        found = [self._from_goal(grid, goal) for grid in self.grids]
        near = [self._from_goal(grid, goal)[(slice(None, None, FINER),) * 3] for grid in self.finer]
        truth = (near[0] + near[1]) / 2
        far = np.linalg.norm(self.nodes - goal, axis=-1) > 2 * self.grids[0].radius
        pairs = [(found[0], truth), (found[1], truth), (near[0], near[1])]
        return [float((np.abs(a - b) / truth)[self.free & far].mean()) for a, b in pairs]

    def _from_goal(self, grid: SpeedGrid, goal: np.ndarray) -> np.ndarray:
        [speed] = self.env.speed(goal[None])
        return grid.arrival_times(goal) + grid.radius / speed


def main(problems: int = 30, with_errors: int = 4, resolution: int = 100) -> None:
    env = envs.make("c3d")
    comparison = Comparison(env, resolution)
    comparison.times(env.sample_problems(1, 8)[0], (0, 1))  # compiles
    posed = env.sample_problems(problems, 7)
    orders = [(0, 1), (1, 0)]
    times = np.array([comparison.times(p, orders[i % 2]) for i, p in enumerate(posed)])
    tell("field, s", times[:, :2])
    tell("planner, s", times[:, 2:])
    errors = np.array([comparison.errors(p.goal) for p in posed[:with_errors]])
    tell("relative error", errors[:, :2])
    print(f"gap of the finer fields: mean {errors[:, 2].mean():.5f}")


def tell(what: str, pairs: np.ndarray) -> None:
    """Prints means and ratios of pairs (n, 2)."""
    (one, other), medians = pairs.mean(axis=0), np.median(pairs, axis=0)
    print(f"{what}: mean {one:.5f} {SOLVERS[0]}, {other:.5f} {SOLVERS[1]}", end="; ")
    by_pair = pairs[:, 0] / pairs[:, 1]
    print(f"ratio of means {one / other:.2f}, of medians {medians[0] / medians[1]:.2f}", end=", ")
    print(f"of each from {by_pair.min():.2f} to {by_pair.max():.2f}", flush=True)


if __name__ == "__main__":
    main(*[int(text) for text in sys.argv[1:]])
