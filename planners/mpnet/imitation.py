"""What MPNet is trained on: demonstrations by another planner, and to step to the next waypoint of
one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

import planners
from envs import Environment, InputError, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.seeding import derived_seed, training_seed
from planners.base import Budget, Planner, Status
from planners.learning.normalizer import Normalizer, obstacle_point_cloud
from planners.learning.resumable_map import Pieces, made_in_parallel
from planners.learning.training_loop import Batch, as_float32
from planners.mpnet.search import Mpnet, contracted


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

    @property
    def consistent(self) -> bool:
        paths, scenes = self.lengths, self.scenes
        return (
            len(paths) == len(scenes)
            and bool((paths >= 2).all() and (self.tried >= 0).all())
            and bool(((scenes >= 0) & (scenes < self.finished)).all())
            and int(paths.sum()) == len(self.waypoints)
            and bool(np.isfinite(self.waypoints).all())
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


@dataclass
class Imitation:
    """The mean squared error of the next waypoint.

    A sample is a demonstration, forwards or backwards, a place on it, a later waypoint for a goal,
    and the next waypoint as the answer: expansion goes from both ends, replanning between any two
    waypoints. Scenes are turned by the symmetries of their family.

    Attributes:
        scenes: in a batch.
        samples: a scene.
        points: of a scene's surface points, drawn anew each time.
        along: share of the samples that begin on the way to the next waypoint instead of at one.
    """

    plan: DemonstrationPlan = field(default_factory=DemonstrationPlan)
    scenes: int = 8
    samples: int = 128
    points: int = 1024
    along: float = 0.5

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        family = env.family()
        made, seconds = make_demonstrations(family, self.plan, seed, kept, report)
        self._turns = _turns(env)
        shown = sorted(set(made.scenes.tolist()))
        if not shown:
            raise InputError(f"{self.plan.planner} demonstrated nothing in {self.plan.seconds} s")
        self._clouds = [obstacle_point_cloud(family[scene]) for scene in shown]
        self._paths = _by_scene(made, Normalizer.of(env), shown)
        return seconds

    def draw(self, rng: np.random.Generator) -> Batch:
        chosen = rng.choice(len(self._clouds), size=self.scenes)
        turns = rng.integers(len(self._turns), size=self.scenes)
        clouds, samples = [], []
        for scene, number in zip(chosen, turns, strict=True):
            of_points, of_configurations = self._turns[number]
            points = self._clouds[scene]
            clouds.append(points[rng.integers(len(points), size=self.points)] @ of_points.T)
            drawn = self._paths[scene].draw(rng, self.samples, self.along)
            samples.append(drawn @ of_configurations.T)
        parts = np.array(samples)  # (scenes, 3, samples, d)
        return as_float32(np.array(clouds), parts[:, 0], parts[:, 1], parts[:, 2])

    def loss(self, net: Mpnet, batch: Batch, share: float) -> torch.Tensor:
        points, current, goal, answer = batch
        code = net.encoder(points)[:, None].expand(-1, current.shape[1], -1)
        # In units of half a side, the networks' own.
        error = 2 * (net.planner(code, current, goal) - answer)
        return functional.mse_loss(error, torch.zeros_like(error))


class _Paths:
    """The demonstrations in one scene, each forwards and backwards.

    Args:
        waypoints: (n, d) in the networks' space, path after path.
        ends: (n,) for each waypoint the index of its path's last one.
    """

    def __init__(self, waypoints: Array, ends: Array) -> None:
        self._waypoints = waypoints
        self._ends = ends
        self._begins = np.flatnonzero(np.arange(len(ends)) < ends)  # not the last of a path

    def draw(self, rng: np.random.Generator, n: int, along: float) -> Array:
        """Where (n, d), to where (n, d) and the next waypoint (n, d), as (3, n, d)."""
        here = rng.choice(self._begins, size=n)
        goal = rng.integers(here + 1, self._ends[here] + 1)
        goal = np.where(rng.random(n) < 0.5, goal, self._ends[here])
        way = rng.random((n, 1)) * (rng.random((n, 1)) < along)
        at, after = self._waypoints[here], self._waypoints[here + 1]
        return np.array([at + way * (after - at), self._waypoints[goal], after])


def _turns(env: Environment) -> list[tuple[Array, Array]]:
    """What turns surface points, (3, 3), and configurations, (d, d), of a scene into those of an
    equally likely one: the symmetries of scenes of point robots, whose configurations are points;
    else nothing but the identity."""
    if env.is_point_robot:
        return [(_in_space(turn), turn) for turn in env.symmetries()]
    return [(np.eye(3), np.eye(env.dimension))]


def _in_space(turn: Array) -> Array:
    """What turns positions (d,), those of a plane too, as what turns the workspace, (3, 3)."""
    found = np.eye(3)
    found[: len(turn), : len(turn)] = turn
    return found


def _by_scene(made: Demonstrations, scale: Normalizer, scenes: Sequence[int]) -> list[_Paths]:
    paths = np.split(made.waypoints, np.cumsum(made.lengths)[:-1])
    # Unwrapped, the way between two waypoints is straight.
    waypoints = [scale.normalize(scale.space.unwrapped(path)) for path in paths]
    found = []
    for scene in scenes:
        own = [waypoints[i] for i in np.flatnonzero(made.scenes == scene)]
        both = [*own, *(path[::-1] for path in own)]
        sizes = np.array([len(path) for path in both])
        found.append(_Paths(np.concatenate(both), np.repeat(np.cumsum(sizes) - 1, sizes)))
    return found
