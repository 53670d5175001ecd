"""Labels for supervised fields: arrival times by fast marching, from many sources."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.seeding import stream
from planners.fast_marching import SpeedGrid
from planners.fields.sampling import PointSampler, Space
from planners.parallel import in_parallel
from planners.scale import Scale

Single = NDArray[np.float32]

_BLOCK = 5  # sources a process between two savings


@dataclass(frozen=True)
class LabelPlan:
    """How many labels, and from how fine a grid.

    Attributes:
        sources: fields solved.
        goals: labels interpolated from each.
        resolution: nodes per axis of the grid.
        nearest: goals closer than this many spacings are left out, as the grid is too coarse.
    """

    sources: int = 200
    goals: int = 4096
    resolution: int = 100
    nearest: float = 3.0


@dataclass(frozen=True)
class Labels:
    """In the networks' space, float32: sources (s, d), goals (s, g, d), and the stretch (s, g),
    which is log(T / distance)."""

    sources: Single
    goals: Single
    stretch: Single

    def joined(self, others: Sequence[Labels]) -> Labels:
        """These and others."""
        parts = zip(*(vars(labels).values() for labels in (self, *others)), strict=True)
        return Labels(*(np.concatenate(part) for part in parts))


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
    labels, spent = _read(kept, env.dimension, plan)
    begin = monotonic()
    open_sources = range(len(labels.sources), plan.sources)
    for solved in in_parallel(_Solver, (env, plan, seed), open_sources, _BLOCK):
        labels = labels.joined(solved)
        _write(kept, labels, spent + monotonic() - begin)
        report(len(labels.sources) / plan.sources)
    return labels, spent + monotonic() - begin


class _Solver:
    """What each process keeps."""

    def __init__(self, env: Environment, plan: LabelPlan, seed: int) -> None:
        self._plan = plan
        self._seed = seed
        self._grid = SpeedGrid(env, plan.resolution, order=2)
        self._points = PointSampler(Space.of(env))
        self._scale = Scale.of(env)

    def __call__(self, index: int) -> Labels:
        """Those of source number `index`."""
        plan, grid, scale = self._plan, self._grid, self._scale
        rng = stream("field labels", self._seed, index)
        source = scale.grow(self._points.draw(rng, 1)[0])
        times = grid.arrival_times(source)
        nearest = plan.nearest * float(grid.spacing.max())
        goals = scale.grow(self._points.draw(rng, 2 * plan.goals))
        distance = np.linalg.norm(goals - source, axis=1)
        far = np.flatnonzero(distance >= nearest)[: plan.goals]
        stretch = np.log(grid.times_at(times, source, goals[far]) / distance[far])
        found = scale.shrink(source), scale.shrink(goals[far]), stretch
        return Labels(*(part.astype(np.float32)[None] for part in found))


def _read(kept: Path, dimension: int, plan: LabelPlan) -> tuple[Labels, float]:
    if not kept.is_file():
        shapes = (0, dimension), (0, plan.goals, dimension), (0, plan.goals)
        return Labels(*(np.empty(shape, dtype=np.float32) for shape in shapes)), 0.0
    with np.load(kept) as held:
        return Labels(*(held[part.name] for part in fields(Labels))), float(held["seconds"])


def _write(kept: Path, labels: Labels, seconds: float) -> None:
    part = kept.with_name(f"{os.getpid()}.part.{kept.name}")
    np.savez(part, seconds=seconds, **vars(labels))
    part.replace(kept)
