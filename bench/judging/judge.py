"""The judge: decides whether a claimed path solves its problem, with its own collision model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bench.judging.contact import Contact, first_contact
from bench.storage.record import MOST_WAYPOINTS, Verdict
from envs import Environment, Path, Problem
from envs.collision.continuous import UndecidedError
from envs.collision.fcl_model import CollisionModel
from envs.collision.margin_search import FIRST_QUERIES
from envs.problem import Array

ENDPOINT_TOLERANCE = 1e-6
"""How far first and last waypoint may be from start and goal, by the space's distance."""


MOST_DIAGONALS = 100.0
"""How long a path may be, as many times as the space is wide."""

_MOST_QUERIES = 100_000
"""How often the distance of one of the robot's bodies is asked for, for one verdict; each takes
some hundredths of a millisecond, among meshes tenths."""


@dataclass(frozen=True)
class Judgement:
    """A verdict with its reason, and the path's numbers as far as they mean something.

    `safety_margin` is the least clearance along the path, in workspace units, to the judge's
    tolerance; None unless the path is valid. `metrics` has a valid path's value of each metric by
    name, and `contact` says where a path of verdict `COLLISION` first collides and what with, where
    the caller asked for them (`bench.judge` does).
    """

    verdict: Verdict
    reason: str = ""
    waypoints: int | None = None
    length: float | None = None
    safety_margin: float | None = None
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    contact: Contact | None = None


class SceneModels:
    """Collision models of the scenes that problems live in, of which the last is kept.

    Args:
        env: whose problems these are.
    """

    def __init__(self, env: Environment) -> None:
        self._env = env
        self._last: tuple[Environment, CollisionModel] | None = None

    def of(self, problem: Problem) -> CollisionModel:
        """That of a problem's scene."""
        scene = self._env.scene_of(problem)
        if self._last is None or self._last[0] is not scene:
            self._last = scene, scene.collision_model()
        return self._last[1]


class Judge:
    """Judges paths in one environment, each within a budget that is counted, not timed, so that
    verdicts are the same on every machine. Paths that planners find on the way from start to goal
    stay far within it.

    Args:
        env: must be the judge's own, made from the spec, never one that a planner has held.
    """

    def __init__(self, env: Environment) -> None:
        self._env = env
        self._space = env.space
        self._models = SceneModels(env)

    def scene_of(self, problem: Problem) -> Environment:
        """The environment in which it judges paths of a problem."""
        return self._env.scene_of(problem)

    def __call__(self, problem: Problem, claimed: Array | None) -> Judgement:
        """The verdict on a path (k, d) claimed for `problem`."""
        model = self._models.of(problem)
        try:
            path = Path(claimed).waypoints  # type: ignore[arg-type]  # whatever was claimed
        except ValueError as error:
            return Judgement(Verdict.MALFORMED, str(error))
        if path.shape[1] != self._space.size:
            reason = f"waypoints have {path.shape[1]} coordinates, not {self._space.size}"
            return Judgement(Verdict.MALFORMED, reason)
        goals = problem.all_goals
        nearest = "goal" if len(goals) == 1 else "nearest goal"
        ends = (("start", path[0], problem.start[None]), (nearest, path[-1], goals))
        for name, there, wanted in ends:
            with np.errstate(over="ignore"):  # of what is that far off the square is infinite
                gap = self._space.distance(np.broadcast_to(there, wanted.shape), wanted).min()
            if not gap <= ENDPOINT_TOLERANCE:  # also of what is no number
                reason = f"path is {gap:.3g} off the {name}"
                return Judgement(Verdict.WRONG_ENDPOINT, reason, len(path))
        inside = self._space.contains(path)
        if not inside.all():
            where = int(np.argmin(inside))
            reason = f"waypoint {where} of {len(path)} is out of bounds"
            return Judgement(Verdict.OUT_OF_BOUNDS, reason, len(path))
        length = self._space.length(path)
        too_long = self._too_long(path, length)
        if too_long:
            return Judgement(Verdict.NOT_JUDGED, too_long, len(path), length)
        most_queries = self._most_queries(model, length)
        try:
            margin = model.min_clearance(path, most_queries)
        except UndecidedError:
            reason = f"{most_queries} configurations on it do not decide whether it is free"
            return Judgement(Verdict.NOT_JUDGED, reason, len(path), length)
        if margin <= model.tolerance:
            return Judgement(Verdict.COLLISION, "not proved free of collision", len(path), length)
        return Judgement(Verdict.VALID, "", len(path), length, margin)

    def with_contact(
        self, judgement: Judgement, problem: Problem, claimed: Array | None
    ) -> Judgement:
        """A judgement of this judge on a path for a problem, with where it collides and what with,
        if it does. That takes longer than the verdict, so it is for whoever asks about one path."""
        if judgement.verdict is not Verdict.COLLISION:
            return judgement
        path = Path(claimed).waypoints  # type: ignore[arg-type]  # it has been looked at
        contact = first_contact(self.scene_of(problem), self._models.of(problem), path)
        return replace(judgement, reason=f"{judgement.reason}: {contact}", contact=contact)

    def _too_long(self, path: Array, length: float) -> str:
        """Why a path is not looked at, if it is not."""
        if len(path) > MOST_WAYPOINTS:
            return f"it has {len(path)} waypoints, more than {MOST_WAYPOINTS}"
        if length > MOST_DIAGONALS * self._space.extent:
            return f"it is longer than {MOST_DIAGONALS:g} times the diagonal of the bounds"
        return ""

    def _most_queries(self, model: CollisionModel, length: float) -> int:
        """Twice what decides about a path that keeps just above the tolerance all the way, up to
        some number; see `path_min_clearance`."""
        robot = self._env.robot
        enough = 2 * (FIRST_QUERIES + 2 * robot.rate_bound * length / model.tolerance)
        most = max(_MOST_QUERIES // max(robot.moving, 1), 2 * FIRST_QUERIES)
        return int(min(enough, most))
