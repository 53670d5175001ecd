"""The judge: decides whether a claimed path solves its problem, with its own collision model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench import metrics
from bench.record import Verdict
from envs import Environment, Path, Problem
from envs.collision.fcl_model import DEFAULT_TOLERANCE
from envs.problem import Array

ENDPOINT_TOLERANCE = 1e-6
"""How far first and last waypoint may be from start and goal, in the configurations' unit."""


@dataclass(frozen=True)
class Judgement:
    """A verdict with its reason, and the path's numbers as far as they mean something.

    `safety_margin` is the least clearance along the path, in workspace units, to the judge's
    tolerance; None unless the path is valid.
    """

    verdict: Verdict
    reason: str = ""
    waypoints: int | None = None
    length: float | None = None
    safety_margin: float | None = None
    travel_time: float | None = None
    smoothness: float | None = None


class Judge:
    """Judges paths in one environment.

    Args:
        env: must be the judge's own, made from the spec, never one that a planner has held.
        tolerance: of the collision check and the safety margin, in workspace units.
    """

    def __init__(self, env: Environment, tolerance: float = DEFAULT_TOLERANCE) -> None:
        self._env = env
        self._model = env.collision_model(tolerance)
        self._spacing = float(np.linalg.norm(env.upper - env.lower)) / 1000

    def __call__(self, problem: Problem, claimed: Array | None) -> Judgement:
        """The verdict on a path (k, d) claimed for `problem`."""
        try:
            path = Path(claimed).waypoints  # type: ignore[arg-type]  # whatever was claimed
        except ValueError as error:
            return Judgement(Verdict.MALFORMED, str(error))
        if path.shape[1] != self._env.dimension:
            reason = f"waypoints have {path.shape[1]} coordinates, not {self._env.dimension}"
            return Judgement(Verdict.MALFORMED, reason)
        ends = (("start", path[0], problem.start), ("goal", path[-1], problem.goal))
        for name, there, wanted in ends:
            gap = float(np.abs(there - wanted).max())
            if gap > ENDPOINT_TOLERANCE:
                reason = f"path is {gap:.3g} off the {name}"
                return Judgement(Verdict.WRONG_ENDPOINT, reason, len(path))
        inside = self._env.contains(path)
        if not inside.all():
            where = int(np.argmin(inside))
            reason = f"waypoint {where} of {len(path)} is out of bounds"
            return Judgement(Verdict.OUT_OF_BOUNDS, reason, len(path))
        margin = self._model.min_clearance(path)
        length = metrics.path_length(path)
        if margin <= self._model.tolerance:
            return Judgement(Verdict.COLLISION, "not proved free of collision", len(path), length)
        return Judgement(
            Verdict.VALID,
            "",
            len(path),
            length,
            margin,
            metrics.travel_time(path, self._env.speed, self._spacing),
            metrics.smoothness(path),
        )
