"""What the networks are trained on: to step to the next waypoint of a demonstration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional

from envs import Environment, InputError
from envs.problem import Array
from planners.mpnet.demonstrations import DemonstrationPlan, Demonstrations, make_demonstrations
from planners.mpnet.networks import Mpnet
from planners.scale import Scale, cloud
from planners.training import Batch, as_float32


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
        self._turns = env.symmetries()
        shown = sorted(set(made.scenes.tolist()))
        if not shown:
            raise InputError(f"{self.plan.planner} demonstrated nothing in {self.plan.seconds} s")
        self._clouds = [cloud(family[scene]) for scene in shown]
        self._paths = _by_scene(made, Scale.of(env), shown)
        return seconds

    def draw(self, rng: np.random.Generator) -> Batch:
        chosen = rng.choice(len(self._clouds), size=self.scenes)
        turns = self._turns[rng.integers(len(self._turns), size=self.scenes)]
        clouds, samples = [], []
        for scene, turn in zip(chosen, turns, strict=True):
            points = self._clouds[scene]
            clouds.append(points[rng.integers(len(points), size=self.points)] @ turn.T)
            samples.append(self._paths[scene].draw(rng, self.samples, self.along) @ turn.T)
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


def _by_scene(made: Demonstrations, scale: Scale, scenes: Sequence[int]) -> list[_Paths]:
    waypoints = np.split(scale.shrink(made.waypoints), np.cumsum(made.lengths)[:-1])
    found = []
    for scene in scenes:
        own = [waypoints[i] for i in np.flatnonzero(made.scenes == scene)]
        both = [*own, *(path[::-1] for path in own)]
        sizes = np.array([len(path) for path in both])
        found.append(_Paths(np.concatenate(both), np.repeat(np.cumsum(sizes) - 1, sizes)))
    return found
