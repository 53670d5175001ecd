"""A planning problem and a path: frozen, and checked when they are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def frozen_array(values: Any, ndim: int, what: str) -> Array:
    """A read-only float64 copy of `values`.

    Raises:
        ValueError: it is not numeric, has not `ndim` axes, or holds NaN or infinities.
    """
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{what} is not an array of numbers: {error}") from None
    if array.ndim != ndim:
        raise ValueError(f"{what} has {array.ndim} axes, not {ndim}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} holds NaN or infinite numbers")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False)
class Problem:
    """Find a path from `start` to `goal`, each (d,) in the environment's units.

    `index` is its place among the problems of a seed; `seed` is the planner's random seed for it.
    Where several goals are given, `goals` (g, d), a path to any of them will do; `goal` is the
    first of them. None where there is one alone.
    """

    start: Array
    goal: Array
    index: int = 0
    seed: int = 1
    goals: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen_array(self.start, 1, "start"))
        object.__setattr__(self, "goal", frozen_array(self.goal, 1, "goal"))
        if self.start.shape != self.goal.shape:
            raise ValueError(f"start has shape {self.start.shape}, goal {self.goal.shape}")
        if self.goals is None:
            return
        object.__setattr__(self, "goals", frozen_array(self.goals, 2, "goals"))
        if len(self.goals) == 0 or not np.array_equal(self.goals[0], self.goal):
            raise ValueError("the goal must be the first of the goals")

    @property
    def all_goals(self) -> Array:
        """Configurations (g, d) that a path may end in."""
        return self.goal[None] if self.goals is None else self.goals


@dataclass(frozen=True, eq=False)
class Path:
    """Waypoints (k, d), k >= 2, joined by the shortest ways of the environment's space."""

    waypoints: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "waypoints", frozen_array(self.waypoints, 2, "path"))
        if self.waypoints.shape[1] == 0:
            raise ValueError("path has waypoints without coordinates")
        if len(self.waypoints) < 2:
            raise ValueError(f"path has {len(self.waypoints)} waypoints, at least 2 are needed")
