"""Worlds of arms: the joints' box, the solids about the arm, the problems."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs import connection
from envs.collision.fcl_model import Allowed, CollisionModel, Prover
from envs.collision.mesh import Containment
from envs.collision.part_scenes import PartScenes, part_scenes
from envs.collision.separation import contacts_array, shapes_of
from envs.collision.shapes import PlacedShape, rounded
from envs.environment import Environment, LinkGeometry
from envs.errors import InputError
from envs.problem import Array, Problem
from envs.robots import arm_clearance, rrt_connect, swept_pairs
from envs.robots.allowed_collisions import FAR
from envs.robots.arm import SLACK, Arm, RobotArrays
from envs.robots.arm_crowding import causes
from envs.robots.motion_proof import prove
from envs.robots.tip_and_stand import stand
from envs.seeding import derived_seed, stream
from envs.spaces import Space
from envs.speed_model import SpeedModel

_D_MAX = 0.05 / 0.4
"""Metres: the paper's 0.05, in whose space a metre is 0.4."""

_CONTACT = 0.02
"""The speed at contact, see `SpeedModel`: obstacles are thin here, too."""

_MOST_FRUITLESS = 2000
"""Pairs of ends in a row that will not do, before the world is found to have too few problems."""

_MOST_UNJOINED = 100
"""Pairs of ends that no path joins, before a world is found to have no problem at all."""

_HOPELESS = 20
"""Times that 1024 random configurations hold no end, before a world is found to have none."""

_AT_A_TIME = 64
"""Random pairs of which it is asked whether they may be ends, before any is used."""

_LOOKED_AT = 256
"""Configurations at which the cause is sought."""


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
    """An arm, or several on one base, among solids. Joints in radians (metres where they slide),
    lengths in metres, in the frame of the world. Joints without limits wrap.

    Args:
        arm: the robot.
        obstacles: solids; the base may touch them.
        kind: names the random streams of the problems, with `seeds`.
        names: of the obstacles, "" of those that have none; by default none has.
        allows: whether a link may touch an obstacle, by their names; by default none may. What has
            no name is not asked about.

    Attributes:
        min_clearance: least clearance of a problem's start and goal, in metres; of links from each
            other less, where they cannot come that far apart (see `kept`).
        min_separation: least distance between them, in radians.
        most_free_of_five: straight lines that may be free among five problems in a row.
    """

    min_clearance = 0.02
    min_separation = 1.0
    most_free_of_five = 5
    units = MappingProxyType({"configuration": "rad", "workspace": "m"})
    trace_label = "tip of the tool"
    allowed_apart = True

    def __init__(
        self,
        arm: Arm,
        obstacles: Sequence[PlacedShape],
        kind: str,
        seeds: tuple[int, ...] = (),
        names: Sequence[str] = (),
        allows: Callable[[str, str], bool] | None = None,
    ) -> None:
        self.robot: Arm = arm
        self.obstacles: Sequence[PlacedShape] = list(obstacles)
        self.lower, self.upper = arm.tree.lower, arm.tree.upper
        self.speed_model = SpeedModel(d_min=_D_MAX / 15, d_max=_D_MAX, contact=_CONTACT)
        self._kind = kind
        self._seeds = seeds
        self._names = names or [""] * len(obstacles)
        self._allows = allows
        self._last_made: tuple[tuple[int, int] | None, _Made] = (None, _Made())

    @property
    def space(self) -> Space:
        return self.robot.tree.space

    @property
    def extent(self) -> float:
        return 2 * self.robot.extent

    @property
    def velocity_limits(self) -> Array | None:
        """As stated by the robot's file, if it states all."""
        stated = [joint.velocity for joint in self.robot.tree.coordinates]
        return None if None in stated else np.array(stated, dtype=float)

    @property
    def coordinate_names(self) -> Sequence[str]:
        joints = self.robot.tree.coordinates
        return [f"joint {j.name!r}" for j in joints for _ in range(4 if j.spherical else 1)]

    @property
    def shape_names(self) -> Sequence[str]:
        return [f"link {name!r}" for name in self.robot.links]

    @property
    def obstacle_names(self) -> Sequence[str]:
        """Those that they have, else their kinds and numbers."""
        others = super().obstacle_names
        both = zip(self._names, others, strict=True)
        return [f"obstacle {name!r}" if name else other for name, other in both]

    @cached_property
    def may_touch(self) -> NDArray[np.bool_] | None:
        if self._allows is None:
            return None
        links, names = self.robot.links[: self.robot.moving], self._names
        found = np.array(
            [[bool(name) and self._allows(link, name) for name in names] for link in links]
        )
        return found if found.any() else None

    @cached_property
    def scenes(self) -> PartScenes:
        """The obstacles as compiled code sees them, for each part."""
        reach = self.robot.extent + 2 * _D_MAX
        at = self.robot.tree.joints[0].origin[:3, 3]
        ends = at - reach, at + reach
        return part_scenes(self.obstacles, *ends, self.robot.moving, self.may_touch)

    @property
    def link_geometry(self) -> LinkGeometry:
        return LinkGeometry(self.robot.arrays, self.scenes)

    @cached_property
    def scenery(self) -> Sequence[PlacedShape]:
        """A stand, unless the solids of the base are there."""
        has_base = len(self.robot.shapes) > self.robot.moving
        return [] if has_base else stand(self.robot.tree)

    def clearance(self, q: Array) -> Array:
        """Distances (n,), in metres, by `CollisionModel`; just below 0 in contact. Of
        configurations (n, d) along a path they take less time."""
        q = self.configurations(q)
        found = self._model.clearances(q, self.robot.poses_along(q))
        return np.where(found <= 0, arm_clearance.TOUCHING, found)

    def approximate_clearance(self, q: Array) -> Array:
        """Never more than `clearance` in free space; see `envs.robots.arm_clearance`."""
        return arm_clearance.clearances(self.robot.arrays, self.scenes, self.configurations(q))

    def speed_on_grid(self, q: Array) -> Array:
        return self.speed_model(self.approximate_clearance(q))

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        free = np.array([self._is_free(path, tolerance) for path in paths], dtype=np.bool_)
        if self.allowed is not None:  # which cannot change along a path that touches nothing
            free &= self.allowed(np.array([path[0] for path in paths]))
        return free

    def _is_free(self, path: Array, tolerance: float) -> bool:
        """Whether a path (k, d) touches nothing, for all that spheres prove."""
        others, swept = self._pairs
        for robot, straight in self.robot.motions(path):
            rest = robot._replace(branches=others)
            if not arm_clearance.paths_are_free(rest, self.scenes, [straight], tolerance)[0]:
                return False
            if len(swept) and not swept_pairs.path_keeps_apart(rest, swept, straight, tolerance):
                return False
        return True

    @cached_property
    def _pairs(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Of links that must not touch each other; see `swept_pairs.split`."""
        return swept_pairs.split(self.robot)

    @cached_property
    def _model(self) -> CollisionModel:
        return self.collision_model()

    @cached_property
    def allowed(self) -> Allowed | None:
        containment = Containment(self.robot, self.obstacles, self.may_touch)
        return containment if containment.possible else None

    @property
    def prover(self) -> Prover:
        around, may_touch = shapes_of(self.obstacles), contacts_array(self.may_touch)

        def proved(a: Array, b: Array, asked: float, kept: float) -> tuple[float, bool]:
            [(robot, (begin, end))] = self.robot.motions(np.array([a, b]))
            return prove(robot, around, may_touch, begin, end, asked, kept)

        return proved

    @cached_property
    def kept(self) -> Array:
        """What parts keep from each other at a problem's ends, (p, p), in metres: `min_clearance`,
        or half of what they come apart beyond what planners must keep."""
        farthest, least = self.robot.link_pairs.farthest, self.planning_tolerance
        half = np.clip((farthest + least) / 2, least, self.min_clearance)
        return np.where(farthest < FAR, half, self.min_clearance)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform, as `min_clearance` and `min_separation` demand, and joined by a long
        search (see `is_connected`); no more straight lines free than `most_free_of_five`."""
        made = self._made(n, seed)
        return [
            Problem(start, goal, index, derived_seed(f"{self._kind} planner", seed, index))
            for index, (start, goal) in enumerate(made.pairs)
        ]

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
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
            if made.dropped == _MOST_UNJOINED and not made.pairs:
                break
        if n == 0:
            return made
        raise InputError(f"found only {len(made.pairs)} of {n} problems: {self._cause(made)}")

    def _cause(self, made: _Made) -> str:
        """Why there are no more problems."""
        if self.space.extent <= self.min_separation:
            return (
                f"start and goal must be {self.min_separation:g} apart (in radians, metres where a "
                "joint slides), and the joints' limits are narrower; widen them"
            )
        return (
            f"both ends must keep {self.min_clearance} m clear and be joined by a path, and of "
            f"five straight lines at most {self.most_free_of_five} be free; {self._tightness()}; "
            f"no path joined {made.dropped} pairs of ends; change what is about the arm, or links"
        )

    def _tightness(self) -> str:
        """How many configurations are no ends, and what is too near there."""
        q = self.space.sample(stream("crowding"), _LOOKED_AT)
        tight = 1 - self._may_be_end(q).mean()
        pairs, names = self.checked_pairs(), self.obstacle_names
        near = causes(self.robot, pairs, names, q, self.min_clearance, self.kept)
        if self.allowed is not None and not self.allowed(q).all():
            near.append(
                f"within a mesh or about what lies within in {1 - self.allowed(q).mean():.0%}"
            )
        often = f", most often {', '.join(near)}" if near else ""
        return f"of random configurations {tight:.0%} are too near to something{often}"

    def _take(self, made: _Made, rng: np.random.Generator, start: Array, goal: Array) -> bool:
        """Adds a problem if it will do."""
        # What is free for planners is free for the judge, and asked in a hundredth of the time.
        line = [np.array([start, goal])]
        for_planners = bool(self.paths_are_free(line, self.planning_tolerance)[0])
        straight = for_planners or self._model.segment_is_free(start, goal)
        recent = made.straight[len(made.straight) - len(made.straight) % 5 :]
        if straight and sum(recent) == self.most_free_of_five:
            return False
        draws = self.space.sample(rng, rrt_connect.ITERATIONS)
        if not (for_planners or self._are_connected(start, goal, draws)):
            made.dropped += 1
            return False
        made.straight.append(straight)
        made.pairs.append((start, goal))
        return True

    def _are_connected(self, start: Array, goal: Array, draws: Array) -> bool:
        """Whether a long search joins two configurations."""
        arm, tolerance = self.robot.arrays, self.planning_tolerance
        if not arm.tree.spherical.any():
            others, swept = self._pairs
            arm = arm._replace(branches=others)
            return rrt_connect.is_connected(arm, self.scenes, start, goal, draws, tolerance, swept)

        def is_free(a: Array, b: Array) -> bool:
            return self._is_free(np.array([a, b]), tolerance)

        return connection.is_connected(self.space, is_free, start, goal, draws, rrt_connect.STEP)

    def _ends(self, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Starts and goals, until a hundred thousand pairs in a row are refused, or thousands of
        configurations hold no end at all."""
        fruitless, none = 0, 0
        while fruitless < 100 and none < _HOPELESS:
            start, goal = np.split(self.space.sample(rng, 2 * 1024), 2)
            none, fruitless = none + 1, fruitless + 1
            for some in range(0, 1024, _AT_A_TIME):
                a, b = start[some : some + _AT_A_TIME], goal[some : some + _AT_A_TIME]
                keep = self.space.distance(a, b) >= self.min_separation
                keep[keep] &= self._are_clear(a[keep])
                none = 0 if any(map(self._is_outside, a[keep])) else none
                keep[keep] &= self._are_clear(b[keep])
                for ends in zip(a[keep], b[keep], strict=True):
                    if all(map(self._is_outside, ends)):
                        fruitless = 0
                        yield ends

    def _may_be_end(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, d) may be ends of problems."""
        keep = self._are_clear(q)
        keep[keep] = [self._is_outside(one) for one in q[keep]]
        return keep

    def _are_clear(self, q: Array) -> NDArray[np.bool_]:
        """Whether configurations (n, d) keep the clearance that problems' ends do."""
        keep = arm_clearance.clearances(self._unpaired, self.scenes, q) >= self.min_clearance
        keep[keep] &= self.robot.links_keep(self.kept, q[keep])
        return keep

    def _is_outside(self, q: Array) -> bool:
        """Whether nothing is wholly within a mesh, at a configuration (d,). Asked one by one, as
        far as it is needed: it may take a millisecond."""
        return self.allowed is None or bool(self.allowed(q[None])[0])

    @cached_property
    def _unpaired(self) -> RobotArrays:
        """The arm whose links may touch each other."""
        arrays = self.robot.arrays
        return arrays._replace(branches=arrays.branches[:0])

    def definition(self) -> dict[str, Any]:
        model, tree = self.speed_model, self.robot.tree
        wraps, spherical = map(_listed, (tree.arrays.wraps, tree.arrays.spherical))
        pairs = [[i, j, round(self.kept[i, j], 6)] for i, j in self.robot.pairs]
        return {
            **({"pairs": pairs} if self.robot.self_collision else {}),
            **({"wraps": wraps} if wraps else {}),
            **({"spherical": spherical} if spherical else {}),
            **({} if tree.is_serial else {"tree": tree.definition()}),
            **(
                {}
                if self.may_touch is None
                else {"may_touch": np.argwhere(self.may_touch).tolist()}
            ),
            "class": "ArmWorld",
            "version": 1,
            "joints": [
                [
                    *(rounded(joint.origin[:3]), rounded(joint.axis)),
                    *(joint.prismatic, joint.lower, joint.upper),
                ]
                for joint in tree.joints
            ],
            "parts": [[part.body, part.placed.definition()] for part in self.robot.parts],
            "self_collision": self.robot.self_collision,
            "obstacles": [placed.definition() for placed in self.obstacles],
            "speed": [model.d_min, model.d_max, model.s_const, model.contact],
            "problems": [
                *(self.min_clearance, self.min_separation, self.most_free_of_five),
                *(rrt_connect.ITERATIONS, SLACK),
                *(self._kind, *self._seeds),
            ],
        }


def _listed(chosen: NDArray[np.bool_]) -> list[int]:
    found: list[int] = np.flatnonzero(chosen).tolist()
    return found
