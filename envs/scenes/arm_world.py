"""Worlds of serial arms: the joints' box, the solids about the arm, the problems."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.base import Environment
from envs.collision.containment import Containment
from envs.collision.fcl_model import DEFAULT_TOLERANCE, Allowed, CollisionModel
from envs.collision.primitives import SceneView, view_of
from envs.collision.shapes import Placed, rounded
from envs.errors import InputError
from envs.problem import Array, Problem
from envs.robots import arm_clearance, connection
from envs.robots.arm import SLACK, Arm
from envs.seeding import derived_seed, stream
from envs.speed import SpeedModel

_D_MAX = 0.05 / 0.4
"""Metres: the paper's 0.05, in whose space a metre is 0.4."""

_CONTACT = 0.02
"""The speed at contact, see `SpeedModel`: obstacles are thin here, too."""

_TOUCHING = -1e-9
"""The clearance where the arm touches something, which says no more than that."""

_MOST_FRUITLESS = 2000
"""Pairs of ends in a row that will not do, before the world is found to have too few problems."""


@dataclass
class _Made:
    """Problems as they are made.

    Attributes:
        pairs: of ends, each (d,).
        straight: whether the straight lines between them are free.
        dropped: how many pairs were not joined by the search.
    """

    pairs: list[tuple[Array, Array]] = field(default_factory=list)
    straight: list[bool] = field(default_factory=list)
    dropped: int = 0


class ArmWorld(Environment):
    """A serial arm on a fixed base among solids. Joints in radians (metres where they slide),
    lengths in metres, in the frame of the base.

    Args:
        arm: the robot.
        obstacles: solids; the base may touch them.
        kind: names the random streams of the problems, with `seeds`.

    Attributes:
        min_clearance: least clearance of a problem's start and goal, in metres.
        min_separation: least distance between them, in radians.
        most_free_of_five: straight lines that may be free among five problems in a row.
    """

    min_clearance = 0.02
    min_separation = 1.0
    most_free_of_five = 5

    def __init__(
        self, arm: Arm, obstacles: Sequence[Placed], kind: str, seeds: tuple[int, ...] = ()
    ) -> None:
        self.robot: Arm = arm
        self.obstacles: Sequence[Placed] = list(obstacles)
        self.lower = np.array([joint.lower for joint in arm.chain.joints])
        self.upper = np.array([joint.upper for joint in arm.chain.joints])
        self.speed_model = SpeedModel(d_min=_D_MAX / 15, d_max=_D_MAX, contact=_CONTACT)
        self._kind = kind
        self._seeds = seeds
        self._last_made: tuple[tuple[int, int] | None, _Made] = (None, _Made())

    @cached_property
    def scene(self) -> SceneView:
        """The obstacles as compiled code sees them."""
        reach = self.robot.extent + 2 * _D_MAX
        at = self.robot.chain.joints[0].origin[:3, 3]
        return view_of(self.obstacles, at - reach, at + reach)

    def clearance(self, q: Array) -> Array:
        """Distances (n,), in metres, by `CollisionModel`, one configuration (n, d) at a time; just
        below 0 in contact."""
        found = [self._model.clearance(one) for one in self.configurations(q)]
        return np.array([_TOUCHING if c <= 0 else c for c in found])

    def rough_clearance(self, q: Array) -> Array:
        """Never more than `clearance` in free space; see `envs.robots.arm_clearance`."""
        return arm_clearance.clearances(self.robot.view, self.scene, self.configurations(q))

    def speed_on_grid(self, q: Array) -> Array:
        return self.speed_model(self.rough_clearance(q))

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        free = arm_clearance.paths_are_free(self.robot.view, self.scene, paths, tolerance)
        if self.allowed is not None:  # which cannot change along a path that touches nothing
            free &= self.allowed(np.array([path[0] for path in paths]))
        return free

    @cached_property
    def _model(self) -> CollisionModel:
        return self.collision_model()

    @cached_property
    def allowed(self) -> Allowed | None:
        containment = Containment(self.robot, self.obstacles)
        return containment if containment.possible else None

    def collision_model(self, tolerance: float = DEFAULT_TOLERANCE) -> CollisionModel:
        return CollisionModel(
            self.robot, self.obstacles, tolerance, self.allowed, self._part_clearances
        )

    def _part_clearances(self, q: Array) -> Array:
        found = np.empty(self.robot.moving)
        arm_clearance.part_clearances(self.robot.view, self.scene, q, found)
        return found

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform, as `min_clearance` and `min_separation` demand, and joined by a long
        search (see `connection.joined`); no more straight lines free than `most_free_of_five`."""
        made = self._made(n, seed)
        return [
            Problem(start, goal, index, derived_seed(f"{self._kind} planner", seed, index))
            for index, (start, goal) in enumerate(made.pairs)
        ]

    def census(self, n: int, seed: int) -> dict[str, float]:
        made = self._made(n, seed)
        return {
            "share_of_straight_lines_blocked": round(1 - sum(made.straight) / max(n, 1), 4),
            "pairs_dropped_as_unsolved": made.dropped,
        }

    def _made(self, n: int, seed: int) -> _Made:
        if (n, seed) != self._last_made[0]:
            self._last_made = (n, seed), self._make(n, seed)
        return self._last_made[1]

    def _make(self, n: int, seed: int) -> _Made:
        made = _Made()
        rng = stream(f"{self._kind} problems", seed, *self._seeds)
        fruitless = 0
        for start, goal in self._ends(rng) if n > 0 else ():
            fruitless = 0 if self._take(made, rng, start, goal) else fruitless + 1
            if len(made.pairs) == n:
                return made
            if fruitless == _MOST_FRUITLESS:
                break
        if n == 0:
            return made
        raise InputError(
            f"found only {len(made.pairs)} of {n} problems: both ends must keep "
            f"{self.min_clearance} m clear and be joined by a path, and of five straight lines at "
            f"most {self.most_free_of_five} be free; change what is about the arm"
        )

    def _take(self, made: _Made, rng: np.random.Generator, start: Array, goal: Array) -> bool:
        """Adds a problem if it will do."""
        arm, scene = self.robot.view, self.scene
        straight = self._model.segment_is_free(start, goal)
        recent = made.straight[len(made.straight) - len(made.straight) % 5 :]
        if straight and sum(recent) == self.most_free_of_five:
            return False
        draws = rng.uniform(self.lower, self.upper, (connection.ITERATIONS, self.dimension))
        if not connection.joined(arm, scene, start, goal, draws):
            made.dropped += 1
            return False
        made.straight.append(straight)
        made.pairs.append((start, goal))
        return True

    def _ends(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Starts and goals, until a hundred thousand pairs in a row are refused."""
        fruitless = 0
        while fruitless < 100:
            start, goal = rng.uniform(self.lower, self.upper, (2, 1024, self.dimension))
            keep = np.linalg.norm(goal - start, axis=1) >= self.min_separation
            for end in (start, goal):
                keep[keep] &= self.rough_clearance(end[keep]) >= self.min_clearance
                if self.allowed is not None:
                    keep[keep] &= self.allowed(end[keep])
            fruitless = 0 if keep.any() else fruitless + 1
            yield from zip(start[keep], goal[keep], strict=True)

    def definition(self) -> dict[str, Any]:
        model = self.speed_model
        return {
            "class": "ArmWorld",
            "version": 1,
            "joints": [
                [
                    *(rounded(joint.origin[:3]), rounded(joint.axis)),
                    *(joint.prismatic, joint.lower, joint.upper),
                ]
                for joint in self.robot.chain.joints
            ],
            "parts": [[part.body, part.placed.definition()] for part in self.robot.parts],
            "self_collision": self.robot.self_collision,
            "obstacles": [placed.definition() for placed in self.obstacles],
            "speed": [model.d_min, model.d_max, model.s_const, model.contact],
            "problems": [
                *(self.min_clearance, self.min_separation, self.most_free_of_five),
                *(connection.ITERATIONS, SLACK),
                *(self._kind, *self._seeds),
            ],
        }
