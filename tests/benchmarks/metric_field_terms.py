"""Prints what each term of `ntrl`'s loss is worth, as the ablation of its paper does:
python tests/benchmarks/metric_field_terms.py [ENV] [STEPS] [PROBLEMS]

A field is trained with all of them, and one without each. Errors are those of T against fast
marching on a grid of 100 nodes along a side, at free places farther than three spacings from one of
a few free sources: the mean of |T - T*| in units of the longest side at the highest speed, and the
median of |T / T* - 1|. Solved are problems of a training's validation, with all attempts.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

import envs
from envs import Environment
from envs.problem import Array
from envs.seeding import training_seed
from planners import Status
from planners.fast_marching import SpeedGrid
from planners.fields.methods import method
from planners.fields.planner import FieldPlanner
from planners.fields.temporal_difference import TemporalDifference
from planners.learning.learned_planner import Training
from planners.learning.trainer import learn

SOURCES, PLACES = 8, 1500
NODES = 100

WITHOUT: dict[str, Callable[[], TemporalDifference]] = {
    "all terms": TemporalDifference,
    "without temporal difference": lambda: TemporalDifference(difference_weight=0.0),
    "without normals": lambda: TemporalDifference(normal_weight=0.0),
    "without causality": lambda: TemporalDifference(causality=0.0),
    "without eikonal": lambda: TemporalDifference(eikonal_weight=0.0),
}


@dataclass(frozen=True)
class Truth:
    """Arrival times (n, m) by fast marching from sources (n, d) at places (n, m, d), NaN near."""

    sources: Array
    places: Array
    times: Array

    @staticmethod
    def of(env: Environment) -> Truth:
        grid = SpeedGrid(env, NODES, 2)
        rng = np.random.default_rng(12)
        sources = free(env, rng, SOURCES)
        places = np.stack([free(env, rng, PLACES) for _ in sources])
        times = [
            grid.times_at(grid.arrival_times(source), source, q)
            for source, q in zip(sources, places, strict=True)
        ]
        apart = np.linalg.norm(places - sources[:, None], axis=-1)
        near = apart < 3 * (env.upper - env.lower).max() / (NODES - 1)
        return Truth(sources, places, np.where(near, np.nan, times))

    def errors(self, planner: FieldPlanner, extent: float) -> tuple[float, float]:
        """The mean of |T - T*| by the extent, and the median of |T / T* - 1|."""
        found = np.stack(
            [
                planner.times_and_speeds(source, q)[0]
                for source, q in zip(self.sources, self.places, strict=True)
            ]
        )
        absolute = np.nanmean(np.abs(found - self.times)) / extent
        return float(absolute), float(np.nanmedian(np.abs(found / self.times - 1)))


def free(env: Environment, rng: np.random.Generator, n: int) -> Array:
    """Free places (n, d)."""
    found = np.empty((0, env.dimension))
    while len(found) < n:
        q = rng.uniform(*env.free_bounds, (4 * n, env.dimension))
        found = np.concatenate([found, q[env.clearance(q) > 0]])
    return found[:n]


def trained(
    env: Environment, steps: int, objective: Callable[[], TemporalDifference]
) -> FieldPlanner:
    """A planner whose field was trained on another objective."""
    ours = method("ntrl", env)
    other = replace(ours, objective=objective, recipe=replace(ours.recipe, steps=steps))
    with tempfile.TemporaryDirectory() as folder:
        how = Training(seed=0, minutes=None, device="cpu", checkpoint=Path(folder) / "checkpoint")
        tensors = learn(other, env, how, lambda net, problems: 0).tensors
    planner = FieldPlanner("ntrl")
    planner.load(env, tensors)
    return planner


def main(name: str, steps: int = 1500, problems: int = 100) -> None:
    torch.set_num_threads(1)
    env = envs.make(name)
    truth = Truth.of(env)
    posed = env.sample_problems(problems, training_seed("validation", 0))
    extent = float((env.upper - env.lower).max())
    for what, objective in WITHOUT.items():
        planner = trained(env, steps, objective)
        absolute, relative = truth.errors(planner, extent)
        solved = sum(r.status is Status.EXACT_SOLUTION for r in planner.solve_batch(posed))
        print(f"{what}: {absolute:.3f}, {100 * relative:.1f} %, solved {solved}", flush=True)


if __name__ == "__main__":
    chosen, *numbers = sys.argv[1:] or ["maze"]
    main(chosen, *map(int, numbers))
