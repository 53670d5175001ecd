"""An environment in which each problem has a scene of its own, one of three, and planners that tell
which one they plan in."""

from __future__ import annotations

from typing import Any

from envs import Environment, Problem
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld
from envs.scenes.cluttered import Cluttered3D
from planners import Budget, Planner, PlannerResult, Status

SCENES = 3


class ManyScenes(BoxWorld):
    """A point robot among the boxes of `c3d:scene=0`, 1 or 2, by the problem's index."""

    kind_of_problems = "many scenes"
    advice = "there is room for any number"
    scenes_differ = True

    def __init__(self) -> None:
        super().__init__([], 0.01)
        self._scenes = [Cluttered3D(scene) for scene in range(SCENES)]

    def scene_of(self, problem: Problem) -> Environment:
        return self._scenes[problem.index % SCENES]

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        each = [scene.sample_problems(n // SCENES + 1, seed) for scene in self._scenes]
        of = [each[index % SCENES][index // SCENES] for index in range(n)]
        return [Problem(p.start, p.goal, index, p.seed) for index, p in enumerate(of)]

    def definition(self) -> dict[str, Any]:
        return {"class": "ManyScenes", "version": 1, **self.point_definition()}


class Straight(Planner):
    """Tells straight lines that are free in its scene, and which boxes that has."""

    improves = False

    def setup(self, env: Environment, *, seed: int) -> None:
        self.env, self.model = env, env.collision_model(env.planning_tolerance)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        ends = [problem.start, problem.goal]
        is_free = self.model.segment_is_free(*ends)
        status = Status.EXACT_SOLUTION if is_free else Status.APPROXIMATE_SOLUTION
        boxes = [one.center.tolist() for one in self.env.obstacles if isinstance(one, Box)]
        return PlannerResult(status, ends, {"boxes": boxes})


class Refuses(Straight):
    """Cannot get ready for the second scene, and dies of the third."""

    def set_scene(self, env: Environment) -> None:
        super().set_scene(env)
        if env.fingerprint == Cluttered3D(1).fingerprint:
            raise ValueError("no such scene")
        if env.fingerprint == Cluttered3D(2).fingerprint:
            raise SystemError(0)
