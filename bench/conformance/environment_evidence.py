"""What an environment answers when it is asked at random configurations, and what its collision
model says there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.registry import Entry

CONFIGURATIONS = 500
"""At which an environment is asked, over all of its scenes."""

PROBLEMS = 25
"""That are asked for, or all of a list that has fewer."""

_SCENES = 3  # where problems have scenes of their own
_LONG_MOTIONS = 40  # of which proofs are asked, in each scene
_PLACES = 60  # along each
_FARTHEST = 0.05  # of the way from one configuration to another, for short motions


@dataclass(frozen=True)
class SceneEvidence:
    """What one scene of an environment answers.

    Attributes:
        where: the scene, for messages: "" if there is only one.
        count: the number of configurations.
        seed: of the configurations.
    """

    where: str
    env: Environment
    count: int
    seed: int

    @cached_property
    def q(self) -> Array:
        """Random configurations (n, d)."""
        return self._drawn(0)

    @cached_property
    def clearances(self) -> Array:
        """The environment's own (n,), at `q`."""
        return self.clearances_at(self.q)

    @cached_property
    def model(self) -> CollisionModel:
        """The judge's, whose distances are exact."""
        return self.env.collision_model()

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """Whether the collision model finds no contact (n,), at `q`."""
        return np.array([self.model.is_valid(one) for one in self.q], dtype=np.bool_)

    @cached_property
    def distances(self) -> Array:
        """The collision model's distances (n,), at `q`; 0 where it finds contact."""
        both = zip(self.q, self.valid, strict=True)
        return np.array(
            [max(self.model.clearance(one), 0.0) if valid else 0.0 for one, valid in both]
        )

    @cached_property
    def motions(self) -> tuple[Array, Array]:
        """Both ends (n, d) of short motions."""
        begin, other = self._drawn(1), self._drawn(2)
        share = np.random.default_rng([self.seed, 3]).uniform(0, _FARTHEST, self.count)
        return begin, self.env.space.interpolate(begin, other, share)

    @cached_property
    def motion_clearances(self) -> tuple[Array, Array]:
        """The environment's own (n,), at both ends of `motions`."""
        begin, end = self.motions
        return self.clearances_at(begin), self.clearances_at(end)

    @cached_property
    def motion_bounds(self) -> Array:
        """The robot's (n,), of `motions`."""
        bound = self.env.robot.motion_bound
        return np.array([bound(a, b) for a, b in zip(*self.motions, strict=True)])

    @cached_property
    def long_motions(self) -> tuple[Array, Array]:
        """Both ends (n, d) of motions that begin where the collision model finds no contact."""
        begin = self.q[self.valid][:_LONG_MOTIONS]
        share = np.random.default_rng([self.seed, 4]).uniform(0, 1, len(begin))
        end = self._drawn(5)[: len(begin)]
        return begin, self.env.space.interpolate(begin, end, share)

    def touched_between(self, a: Array, b: Array) -> Array | None:
        """A place (d,) on the motion from a to b (d,) at which the collision model finds contact;
        None if there is none among many."""
        share = np.linspace(0, 1, _PLACES)
        begin, end = (np.repeat(q[None], _PLACES, axis=0) for q in (a, b))
        places = self.env.space.interpolate(begin, end, share)
        return next((place for place in places if not self.model.is_valid(place)), None)

    def clearances_at(self, q: Array) -> Array:
        """The environment's own (n,), at configurations (n, d).

        Raises:
            ValueError: it gives something else than n numbers.
        """
        found = self.env.clearance(q.copy())
        if not isinstance(found, np.ndarray):
            raise ValueError(f"`clearance` gave a {type(found).__name__}, not an array")
        if found.shape != (len(q),) or found.dtype != np.float64:
            given = f"{found.dtype} {found.shape}, not float64 {(len(q),)}"
            raise ValueError(f"`clearance` of {q.shape} gave {given}")
        return found

    def _drawn(self, stream: int) -> Array:
        return self.env.space.sample(np.random.default_rng([self.seed, stream]), self.count)


@dataclass(frozen=True)
class EnvironmentEvidence:
    """What an environment answers. Each thing is asked when it is first looked at, so that a fault
    of the environment is found by the check that looks.

    Attributes:
        entry: by which the environment is made again.
        seed: of configurations and problems, from 0 to 2^32 - 1.
    """

    entry: Entry[Environment]
    env: Environment
    seed: int

    @cached_property
    def problems(self) -> list[Problem]:
        """Some of the seed, all of a list that has few."""
        return self.env.sample_problems(self.problem_count, self.seed)

    @cached_property
    def other_problems(self) -> list[Problem]:
        """As many of another seed."""
        return self.env.sample_problems(self.problem_count, self.other_seed)

    @property
    def other_seed(self) -> int:
        return self.seed ^ 1

    @property
    def problem_count(self) -> int:
        """How many `problems` there should be."""
        listed = self.env.problem_count
        return PROBLEMS if listed is None else min(PROBLEMS, listed)

    @cached_property
    def scenes(self) -> list[SceneEvidence]:
        """The environment as it is made, and where problems have scenes of their own some of
        these."""
        found = [("", self.env)]
        if self.env.scenes_differ:
            found += [
                (f"in the scene of problem {problem.index}: ", self.env.scene_of(problem))
                for problem in self.problems[1:_SCENES]
            ]
        count = CONFIGURATIONS // len(found)
        return [SceneEvidence(where, env, count, self.seed) for where, env in found]

    def model_of(self, problem: Problem) -> CollisionModel:
        """The judge's, of the scene in which a problem lives."""
        scene = self.env.scene_of(problem)
        return self.scenes[0].model if scene is self.env else scene.collision_model()
