"""Rigid bodies among what is in the way of point robots: what worlds of such bodies share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from envs.collision import continuous
from envs.collision.fcl_model import Allowed, CollisionModel
from envs.collision.mesh import Containment
from envs.collision.motion_check import MotionCheck
from envs.collision.separation import shapes_of
from envs.collision.shapes import PlacedShape
from envs.compiled_space import space_arrays
from envs.connection import is_connected
from envs.environment import Environment
from envs.problem import Array
from envs.robots.body_motion_check import BodyMotionCheck
from envs.robots.rigid_body import RigidBody
from envs.scenes.sampled_problems import SampledEnds, SampledProblems
from envs.seeding import stream
from envs.spaces import Space
from envs.speed_model import SpeedModel

Clearances = Callable[[Array], Array]

SEARCH, DRAWS = 1000, 16_384
"""Free configurations that a search draws to join the ends of a problem, at most, of so many."""

_MOST_EMPTY = 100
"""Times in a row that 1024 pairs of random configurations hold no ends of a problem."""

_BLOCK = 4096
"""Configurations that are looked at at a time."""

_LOOK = 128
"""Of what is drawn for a search, which may end soon."""

_TOUCHING = -1e-9
"""The clearance where something touches, which says no more than that."""


class RigidBodyWorld(SampledProblems):
    """A rigid body in the world of a point robot.

    A subclass says what problems there are. Those that are sampled (`sampled_ends`) have ends that
    are uniform in free space, keep `end_clearance`, have positions at least `min_separation` apart,
    and are joined by a long search.

    Args:
        robot: the body.
        world: the environment of a point robot in space, whose obstacles are the body's.
        radius: of that robot.
        encloses: whether the body has an inside, in which obstacles cannot be.

    Attributes:
        end_clearance: of ends that are sampled, at least.
        min_separation: between their positions, at least.
        search_step: the longest motion of the search.
        advice: what to do where there are too few.
    """

    robot: RigidBody
    end_clearance: float
    min_separation: float
    search_step: float
    advice: str
    most_unjoined = 20
    trace_label = "middle of the body"

    def __init__(self, robot: RigidBody, world: Environment, radius: float, encloses: bool) -> None:
        self.robot = robot
        self.world = world
        self._of_point = radius
        self._encloses = encloses
        self.lower, self.upper = robot.placement.space.lower, robot.placement.space.upper
        # Bodies are no balls, of which alone FCL has the distance from a box in closed form.
        self.obstacles: Sequence[PlacedShape] = [
            PlacedShape(obstacle.solid, obstacle.pose) for obstacle in world.obstacles
        ]
        self.speed_model: SpeedModel = world.speed_model
        self.units = dict(world.units)  # which can be pickled

    @property
    def space(self) -> Space:
        return self.robot.placement.space

    @property
    def extent(self) -> float:
        return self.world.extent

    @property
    def is_interior(self) -> bool:
        return self.world.is_interior

    @property
    def rooms(self) -> Allowed | None:
        return self.world.rooms

    @property
    def free_bounds(self) -> tuple[Array, Array]:
        """Those of the world, wider by the body's radius: the origin of its frame need not be
        within it."""
        positions = self.space.parts[0].size
        low, high = self.world.free_bounds
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[:positions] = np.maximum(low - self.robot.radius, self.world.lower)[:positions]
        upper[:positions] = np.minimum(high + self.robot.radius, self.world.upper)[:positions]
        return lower, upper

    @cached_property
    def _model(self) -> CollisionModel:
        return self.collision_model()

    def clearance(self, q: Array) -> Array:
        """Distances (n,) by `CollisionModel`; just below 0 in contact. Of configurations (n, size)
        along a path they take less time."""
        q = self.configurations(q)
        poses = np.array([self.robot.poses(one) for one in q]).reshape(len(q), -1, 3, 4)
        found = self._model.clearances(q, poses)
        return np.where(found <= 0, _TOUCHING, found)

    def approximate_clearance(self, q: Array) -> Array:
        """Never more than `clearance` in free space: of spheres that cover the body."""
        return self._least_of_spheres(self.world.clearance, q)

    def _surface_clearance(self, q: Array) -> Array:
        return self._least_of_spheres(self.world.surface_clearance, q)

    def _least_of_spheres(self, of_world: Clearances, q: Array) -> Array:
        q = self.configurations(q)
        blocks = np.array_split(q, -(-len(q) // _BLOCK)) if len(q) else [q]
        found = [self._of_spheres(of_world, block).min(axis=1) for block in blocks]
        return np.concatenate(found)

    def _of_spheres(self, of_world: Clearances, q: Array) -> Array:
        """The clearances (n, m) of the spheres that cover the body, by those of the world."""
        centers = self.robot.placed(self.robot.cover.centers, q)
        distance = of_world(centers.reshape(-1, 3)) + self._of_point
        clearances: Array = distance.reshape(centers.shape[:2]) - self.robot.cover.radii
        return clearances

    def speed_on_grid(self, q: Array) -> Array:
        return self.speed_model(self.approximate_clearance(q))

    @property
    def shape_names(self) -> Sequence[str]:
        count = self.robot.moving
        return ["the body"] if count == 1 else [f"part {n + 1} of the body" for n in range(count)]

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        free = continuous.paths_are_free(
            self._surface_clearance, self.robot.rate_bound, paths, tolerance, self.space
        )
        if self.allowed is not None and free.any():  # which cannot change where nothing is touched
            starts = [path[0] for path, proved in zip(paths, free, strict=True) if proved]
            free[free] = self.allowed(np.array(starts))
        return free

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        if self.world.sides is None:
            return None
        check = BodyMotionCheck(
            space_arrays(self.space),
            shapes_of(self.robot.parts),
            shapes_of(self.obstacles),
            self.world.sides,
            self._piece_points,
            float(self.robot.radius),
            self.robot.placement.positions(self.lower[None])[0],
            float(tolerance),
        )
        return MotionCheck(check)

    @cached_property
    def _piece_points(self) -> Array:
        """One of each piece of the body (n, 3), in its frame."""
        return np.concatenate([part.piece_points() for part in self.robot.parts])

    @cached_property
    def allowed(self) -> Allowed | None:
        """Where each piece of the body is where the world's robot may be, and the body holds no
        obstacle wholly within."""
        world = self.world.allowed
        containment = Containment(self.robot, self.obstacles)
        encloses = containment.robot_encloses if self._encloses else None
        points = self._piece_points

        def is_allowed(q: Array) -> NDArray[np.bool_]:
            found = np.ones(len(q), dtype=np.bool_)
            if world is not None:
                there = self.robot.placed(points, q)
                found &= world(there.reshape(-1, 3)).reshape(there.shape[:2]).all(axis=1)
            if encloses is not None:
                found &= ~encloses(q)
            return found

        return None if world is None and encloses is None else is_allowed

    def _random_numbers(self, seed: int) -> np.random.Generator:
        return stream("rigid problems", seed, int(self.fingerprint, 16))

    def _take(
        self, found: SampledEnds, rng: np.random.Generator, start: Array, goal: Array
    ) -> bool:
        samples = self._free_samples(rng)
        is_free, step = self._is_free_for_planners, self.search_step
        if not is_connected(self.space, is_free, start, goal, samples, step):
            found.dropped += 1
            return False
        found.pairs.append((start, goal))
        return True

    def _cause(self, found: SampledEnds) -> str:
        return (
            f"both ends must keep {self.end_clearance:g} clear and be joined by a path; no path "
            f"joined {found.dropped} pairs of ends; {self.advice}"
        )

    def _free_samples(self, rng: np.random.Generator) -> Iterator[Array]:
        """What the search draws, each (size,): few configurations in rooms are free, and motions
        towards others are mostly tried in vain."""
        drawn = self.sampling_space.sample(rng, DRAWS)  # at once, whatever the search takes of them
        return islice(self._roughly_free(drawn), SEARCH)

    def _roughly_free(self, q: Array) -> Iterator[Array]:
        for block in np.array_split(q, len(q) // _LOOK):
            rough = self._least_of_spheres(self.world.approximate_clearance, block)
            yield from block[rough > 0]

    def _candidates(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Pairs that may be ends, until very many pairs in a row are refused."""
        fruitless = 0
        while fruitless < _MOST_EMPTY:
            start, goal = (self.sampling_space.sample(rng, 1024) for _ in range(2))
            at = (self.robot.placement.positions(q) for q in (start, goal))
            keep = np.linalg.norm(np.subtract(*at), axis=1) >= self.min_separation
            for end in (start, goal):
                keep[keep] &= self._may_be_end(end[keep])
            fruitless = 0 if keep.any() else fruitless + 1
            yield from zip(start[keep], goal[keep], strict=True)

    def _may_be_end(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, size) keep the clearance that problems' ends do."""
        keep = self.approximate_clearance(q) >= self.end_clearance
        if self.allowed is not None:
            keep[keep] = self.allowed(q[keep])
        return keep
