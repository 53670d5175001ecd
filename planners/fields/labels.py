"""Labels for supervised fields: arrival times by fast marching, from many sources."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.seeding import stream
from planners.fast_marching import SpeedGrid, default_resolution
from planners.fields.physics import PointSampler, Space
from planners.learning.normalizer import Normalizer
from planners.learning.resumable_map import Pieces, made_in_parallel

Single = NDArray[np.float32]

_BLOCK = 5  # sources a process between two savings


@dataclass(frozen=True)
class LabelPlan:
    """How many labels, and from how fine a grid.

    Attributes:
        sources: fields solved.
        goals: labels interpolated from each.
        resolution: nodes per axis of the grid; None for `default_resolution` of the dimension.
        nearest: goals closer than this many spacings are left out, as the grid is too coarse.
    """

    sources: int = 200
    goals: int = 4096
    resolution: int | None = 100
    nearest: float = 3.0


@dataclass(frozen=True)
class Labels(Pieces):
    """In the networks' space, float32: sources (s, d), goals (s, g, d), and the stretch (s, g),
    which is log(T / distance)."""

    sources: Single
    goals: Single
    stretch: Single

    @staticmethod
    def none(dimension: int, goals: int) -> Labels:
        """No labels yet."""
        shapes = (0, dimension), (0, goals, dimension), (0, goals)
        return Labels(*(np.empty(shape, dtype=np.float32) for shape in shapes))

    @property
    def finished(self) -> int:
        return len(self.sources)

    @property
    def consistent(self) -> bool:
        together = len(self.sources) == len(self.goals) == len(self.stretch)
        return together and all(bool(np.isfinite(part).all()) for part in vars(self).values())


def make_labels(
    env: Environment,
    plan: LabelPlan,
    seed: int,
    kept: Path,
    report: Callable[[float], None] = lambda share: None,
) -> tuple[Labels, float]:
    """Solves the fields, in as many processes as there are cores.

    Args:
        kept: a file in which finished ones are kept, to go on from.
        report: is told the share that is done.

    Returns:
        The labels, and the seconds that they took, those in earlier calls included.
    """
    return made_in_parallel(
        _Solver,
        (env, plan, seed),
        plan.sources,
        none=Labels.none(env.dimension, plan.goals),
        block=_BLOCK,
        kept=kept,
        report=report,
    )


class _Solver:
    """What each process keeps."""

    def __init__(self, env: Environment, plan: LabelPlan, seed: int) -> None:
        self._env = env
        self._plan = plan
        self._seed = seed
        resolution = plan.resolution or default_resolution(env.dimension)
        if resolution is None:
            raise ValueError(f"no labels fit in {env.dimension} dimensions")
        self._grid = SpeedGrid(env, resolution, order=2)
        self._points = PointSampler(Space.of(env))
        self._scale = Normalizer.of(env)

    def __call__(self, index: int) -> Labels:
        """Those of source number `index`."""
        plan, grid, scale, env = self._plan, self._grid, self._scale, self._env
        rng = stream("field labels", self._seed, index)
        source = scale.denormalize(self._points.draw(rng, 1)[0])
        times = grid.arrival_times(source)
        nearest = plan.nearest * float(grid.spacing.max())
        goals = scale.denormalize(self._points.draw(rng, 2 * plan.goals))
        distance = env.space.distance(source, goals)
        far = np.flatnonzero(distance >= nearest)[: plan.goals]
        stretch = np.log(grid.times_at(times, source, goals[far]) / distance[far])
        found = scale.normalize(source), scale.normalize(goals[far]), stretch
        return Labels(*(part.astype(np.float32)[None] for part in found))
