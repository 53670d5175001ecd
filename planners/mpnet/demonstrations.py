"""Demonstrations: paths of a sampling planner in many scenes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

import planners
from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.seeding import derived_seed, training_seed
from planners.base import Budget, Planner, Status
from planners.mpnet.contraction import contracted
from planners.parallel import Pieces, made_in_parallel


@dataclass(frozen=True)
class DemonstrationPlan:
    """Who demonstrates, and how often.

    Attributes:
        planner: that demonstrates, as in `bench run --planners`.
        seconds: which it may improve its path for.
        problems: in each scene.
    """

    planner: str = "rrtstar"
    seconds: float = 0.12
    problems: int = 400


@dataclass(frozen=True)
class Demonstrations(Pieces):
    """Paths after lazy vertex contraction, in the environments' unit.

    Attributes:
        waypoints: (n, d), of all paths, one after another.
        lengths: (p,) how many of them each path has.
        scenes: (p,) in which of the scenes each path is.
        tried: (s,) for each scene finished so far, how many problems there were.
    """

    waypoints: Array
    lengths: NDArray[np.int64]
    scenes: NDArray[np.int64]
    tried: NDArray[np.int64]

    @staticmethod
    def none(dimension: int) -> Demonstrations:
        """No demonstrations yet."""
        empty = np.zeros(0, dtype=np.int64)
        return Demonstrations(np.zeros((0, dimension)), empty, empty, empty)

    @property
    def finished(self) -> int:
        return len(self.tried)

    def is_consistent(self) -> bool:
        scenes = self.scenes
        return bool(
            len(self.lengths) == len(scenes)
            and (self.lengths >= 2).all()
            and self.lengths.sum() == len(self.waypoints)
            and ((scenes >= 0) & (scenes < len(self.tried))).all()
        )


def make_demonstrations(
    scenes: Sequence[Environment],
    plan: DemonstrationPlan,
    seed: int,
    kept: Path,
    report: Callable[[float], None] = lambda share: None,
) -> tuple[Demonstrations, float]:
    """Demonstrates in all scenes, in as many processes as there are cores.

    Args:
        kept: a file in which finished scenes are kept, to go on from.
        report: is told the share that is done.

    Returns:
        The demonstrations, and the seconds that they took, those in earlier calls included.
    """
    return made_in_parallel(
        _Demonstrator,
        (scenes, plan, seed),
        len(scenes),
        none=Demonstrations.none(scenes[0].dimension),
        block=1,
        kept=kept,
        report=report,
    )


def problems_of(scene: Environment, plan: DemonstrationPlan, seed: int) -> list[Problem]:
    """What is demonstrated in a scene: problems that are no test problems."""
    return scene.sample_problems(plan.problems, training_seed("mpnet demonstrations", seed))


class _Demonstrator:
    """What each process keeps."""

    def __init__(self, scenes: Sequence[Environment], plan: DemonstrationPlan, seed: int) -> None:
        self._scenes = scenes
        self._plan = plan
        self._seed = seed

    def __call__(self, index: int) -> Demonstrations:
        """Those of scene number `index`."""
        scene, plan = self._scenes[index], self._plan
        planner = planners.make(plan.planner)
        planner.setup(scene, seed=derived_seed("mpnet demonstrator", self._seed, index))
        model = scene.collision_model()
        tried = problems_of(scene, plan, self._seed)
        shown = (_demonstrated(scene, model, planner, p, plan.seconds) for p in tried)
        paths = [path for path in shown if path]
        lengths = np.array([len(path) for path in paths], dtype=np.int64)
        waypoints = [np.zeros((0, scene.dimension)), *(np.array(path) for path in paths)]
        return Demonstrations(
            np.concatenate(waypoints),
            lengths,
            np.full(len(paths), index, dtype=np.int64),
            np.array([len(tried)], dtype=np.int64),
        )


def _demonstrated(
    scene: Environment, model: CollisionModel, planner: Planner, problem: Problem, seconds: float
) -> list[Array] | None:
    """A path that the judge's certified check proves free, or None."""
    result = planner.solve(problem, Budget(perf_counter() + seconds, stop_cost=0.0))
    if result.status is not Status.EXACT_SOLUTION:
        return None
    path = np.asarray(result.path)
    if not scene.contains(path).all() or model.min_clearance(path) <= model.tolerance:
        return None
    return contracted(list(path), model.segment_is_free)
