"""Rigid bodies that move, and turn, in the scenes of point robots."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

import envs
from envs.collision import continuous
from envs.collision.fcl_model import Allowed, CollisionModel, LowerBounds
from envs.collision.mesh import Containment
from envs.collision.shapes import PlacedShape
from envs.connection import is_connected
from envs.environment import Environment
from envs.errors import InputError, suggestion
from envs.problem import Array, Problem
from envs.registry.arguments import argument_text
from envs.robots.bodies import body as body_of
from envs.robots.point import PointRobot
from envs.robots.rigid_body import (
    SLACK,
    InSpace,
    InThePlane,
    Placement,
    RigidBody,
    Translation,
    radius_of,
)
from envs.seeding import derived_seed, stream
from envs.spaces import Space
from envs.speed_model import SpeedModel

SPACES = ("se3", "se2", "r3")

Clearances = Callable[[Array], Array]

_SEARCH, _DRAWS = 1000, 16_384
"""Free configurations that a search draws to join the ends of a problem, at most, of so many."""

_STEP = 2.0
"""Its longest motion, in workspace units."""

_MOST_FRUITLESS = 100
"""Times in a row that 1024 pairs of random configurations hold no ends of a problem."""

_MOST_UNJOINED = 20
"""Pairs of ends that no path joins, before a world is found to have no problem at all."""

_BLOCK = 4096
"""Configurations that are looked at at a time."""

_TOUCHING = -1e-9
"""The clearance where something touches, which says no more than that."""


@dataclass
class _Made:
    """Problems as they are made: pairs of ends, each (size,), and how many pairs were not joined by
    the search."""

    pairs: list[tuple[Array, Array]] = field(default_factory=list)
    dropped: int = 0


class RigidWorld(Environment):
    """A rigid body in the scene of a point robot, in its cube of side 20.

    Configurations are x, y, z and the unit quaternion x, y, z, w of SE(3); or x, y and the heading
    of SE(2), in the plane at `z`; or x, y, z of translations. A length is that of the positions and
    what the body's farthest point travels by turning, unless `weight` says otherwise.

    The ends of problems are uniform in free space, keep `min_clearance`, have positions at least
    `min_separation` apart, and are joined by a long search.

    Args:
        body: "box", "l", "cross", "piano" (boxes), or a mesh file with a closed surface.
        space: "se3", "se2" or "r3".
        world: any environment of a point robot in space; arguments that are not of this list are
            its, as `scene` of "c3d" or `file` of "mesh".
        size: the body's longest side, in world units; 0 for that of the file.
        z: of the plane of SE(2).
        weight: of a radian of turning in distances, in world units; 0 for the body's radius.

    Raises:
        InputError: an argument is out of range, or the world's are.
    """

    trace_label = "middle of the body"

    def __init__(
        self,
        body: str = "piano",
        space: str = "se3",
        world: str = "c3d",
        size: float = 2.0,
        z: float = 0.0,
        weight: float = 0.0,
        **of_world: str,
    ) -> None:
        if space not in SPACES:
            raise InputError(f"rigid: no space is called {space!r}; {suggestion(space, SPACES)}")
        if not 0 <= weight <= 1000:
            raise InputError(f"rigid: weight must be between 0 and 1000, not {weight}")
        self.world, self._of_point = _world(world, of_world)
        lower, upper = self.world.lower, self.world.upper
        longest = float((upper - lower).max())
        if not (size == 0 or 1e-3 * longest <= size <= longest):
            least = 1e-3 * longest
            raise InputError(f"rigid: size must be between {least:g} and {longest:g}, not {size}")
        if not lower[2] <= z <= upper[2]:
            raise InputError(f"rigid: z must be between {lower[2]:g} and {upper[2]:g}, not {z}")
        parts = body_of(body, size)
        radius = radius_of(parts)
        if not radius <= longest:
            raise InputError(f"rigid: {body} is larger than the world; say its size, as in size=2")
        self._z = z
        self.robot: RigidBody = RigidBody(parts, self._placement(space, weight or round(radius, 6)))
        self.lower, self.upper = self.robot.placement.space.lower, self.robot.placement.space.upper
        # Bodies are no balls, of which alone FCL has the distance from a box in closed form.
        self.obstacles: Sequence[PlacedShape] = [
            PlacedShape(obstacle.solid, obstacle.pose) for obstacle in self.world.obstacles
        ]
        self.speed_model: SpeedModel = self.world.speed_model
        self.units = self.world.units
        self.min_clearance = min(self.world.min_clearance, 0.2)
        self.min_separation = 4.0
        self._last_made: tuple[tuple[int, int] | None, _Made] = (None, _Made())

    def _placement(self, space: str, weight: float) -> Placement:
        lower, upper = self.world.lower, self.world.upper
        if space == "r3":
            return Translation(lower, upper)
        if space == "se2":
            return InThePlane(lower, upper, self._z, weight)
        return InSpace(lower, upper, weight)

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
    def shape_names(self) -> Sequence[str]:
        count = self.robot.moving
        return ["the body"] if count == 1 else [f"part {n + 1} of the body" for n in range(count)]

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
        """Distances (n,) by `CollisionModel`, one configuration (n, size) at a time; just below 0
        in contact."""
        found = [self._model.clearance(one) for one in self.configurations(q)]
        return np.array([_TOUCHING if c <= 0 else c for c in found])

    def approximate_clearance(self, q: Array) -> Array:
        """Never more than `clearance` in free space: of spheres that cover the body."""
        return self._least_of_spheres(self.world.clearance, q)

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
    def lower_bounds(self) -> LowerBounds:
        return self._part_clearances

    def _part_clearances(self, q: Array, most: float) -> Array:
        [clearances] = self._of_spheres(self.world.clearance, q[None])
        found: Array = np.minimum.reduceat(clearances, self.robot.cover.begins)
        return found

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        free = continuous.paths_are_free(
            self.approximate_clearance, self.robot.rate_bound, paths, tolerance, self.space
        )
        if self.allowed is not None and free.any():  # which cannot change where nothing is touched
            starts = [path[0] for path, proved in zip(paths, free, strict=True) if proved]
            free[free] = self.allowed(np.array(starts))
        return free

    @cached_property
    def allowed(self) -> Allowed | None:
        """Where each piece of the body is where the world's robot may be, and the body holds no
        obstacle wholly within."""
        containment = Containment(self.robot, self.obstacles)
        world = self.world.allowed
        if world is None:
            return containment if containment.possible else None
        points = np.concatenate([part.piece_points() for part in self.robot.parts])

        def is_allowed(q: Array) -> NDArray[np.bool_]:
            there = self.robot.placed(points, q)
            inside = world(there.reshape(-1, 3)).reshape(there.shape[:2]).all(axis=1)
            found: NDArray[np.bool_] = inside & ~containment.robot_encloses(q)
            return found

        return is_allowed

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        made = self._made(n, seed)
        return [
            Problem(start, goal, index, derived_seed("rigid planner", seed, index))
            for index, (start, goal) in enumerate(made.pairs)
        ]

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        return {"pairs_dropped_as_unsolved": self._made(n, seed).dropped}

    def _made(self, n: int, seed: int) -> _Made:
        if (n, seed) != self._last_made[0]:
            self._last_made = (n, seed), self._make(n, seed)
        return self._last_made[1]

    def _make(self, n: int, seed: int) -> _Made:
        made = _Made()
        rng = stream("rigid problems", seed, int(self.fingerprint, 16))
        for start, goal in self._ends(rng) if n > 0 else ():
            samples = self._free_samples(rng)
            if is_connected(self.space, self._is_free, start, goal, samples, _STEP):
                made.pairs.append((start, goal))
            else:
                made.dropped += 1
            if len(made.pairs) == n:
                return made
            if made.dropped == _MOST_UNJOINED and not made.pairs:
                break
        if n == 0:
            return made
        raise InputError(
            f"found only {len(made.pairs)} of {n} problems: both ends must keep "
            f"{self.min_clearance:g} clear and be joined by a path; no path joined {made.dropped} "
            "pairs of ends; make the body smaller, as in size=1, or take another scene"
        )

    def _free_samples(self, rng: np.random.Generator) -> Array:
        """What the search draws, (m, size): few configurations in rooms are free, and motions
        towards others are mostly tried in vain."""
        drawn = self.sampling_space.sample(rng, _DRAWS)
        rough = self._least_of_spheres(self.world.approximate_clearance, drawn)
        return drawn[rough > 0][:_SEARCH]

    def _is_free(self, a: Array, b: Array) -> bool:
        [free] = self.paths_are_free([np.array([a, b])], self.planning_tolerance)
        return bool(free)

    def _ends(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Starts and goals, until very many pairs in a row are refused."""
        fruitless = 0
        while fruitless < _MOST_FRUITLESS:
            start, goal = (self.sampling_space.sample(rng, 1024) for _ in range(2))
            at = (self.robot.placement.positions(q) for q in (start, goal))
            keep = np.linalg.norm(np.subtract(*at), axis=1) >= self.min_separation
            for end in (start, goal):
                keep[keep] &= self._may_be_end(end[keep])
            fruitless = 0 if keep.any() else fruitless + 1
            yield from zip(start[keep], goal[keep], strict=True)

    def _may_be_end(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, size) keep the clearance that problems' ends do."""
        keep = self.approximate_clearance(q) >= self.min_clearance
        if self.allowed is not None:
            keep[keep] = self.allowed(q[keep])
        return keep

    def definition(self) -> dict[str, Any]:
        return {
            "class": "RigidWorld",
            "version": 1,
            "parts": [part.definition() for part in self.robot.parts],
            "space": self.space.definition(),
            "z": self._z,
            "world": self.world.definition(),
            "problems": [self.min_clearance, self.min_separation, _SEARCH, _DRAWS, _STEP, SLACK],
        }


def _world(name: str, arguments: Mapping[str, str]) -> tuple[Environment, float]:
    """The environment of a point robot that a name, with or without arguments, names, and the
    radius of that robot."""
    head, _, rest = name.partition(":")
    text = ",".join(filter(None, (rest, argument_text(arguments))))
    try:
        made = envs.make(f"{head}:{text}" if text else head)
    except InputError as error:
        raise InputError(
            f"rigid: {error} (of its world; its own are {', '.join(_own())})"
        ) from None
    if not isinstance(made.robot, PointRobot):
        raise InputError(
            f"rigid: world={head} has a robot of its own, which moves otherwise; name one of a "
            "point robot, such as c3d, mesh or gibson-generated"
        )
    return made, made.robot.radius


def _own() -> list[str]:
    """The names of the arguments of `RigidWorld`."""
    parameters = inspect.signature(RigidWorld.__init__).parameters.values()
    return [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD][1:]
