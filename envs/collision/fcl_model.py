"""Collision and distance queries between a robot and a scene, through FCL.

FCL's search for the distance between two solids that are no spheres ends too early at times: of
random poses of a cylinder and a box one in some thousands is found too far apart, by up to
decimetres, and of a mesh and a cylinder by up to centimetres. So distances are our own
(`separation`), which are never above the truth, but for those of balls from boxes along the axes,
which FCL has in closed form. Whether anything touches FCL is asked as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import compress, pairwise, starmap
from typing import Protocol
from weakref import WeakKeyDictionary

import fcl
import numpy as np
from numpy.typing import NDArray

from envs.collision import continuous
from envs.collision.coherence import least_along
from envs.collision.continuous import DEFAULT_TOLERANCE
from envs.collision.fcl_obstacles import broad_phases, fcl_transform, placed_in_fcl
from envs.collision.first_contact import ENOUGH_STEPS, Place, first_contact
from envs.collision.margin_search import FIRST_QUERIES
from envs.collision.motion_check import MOTION_FREE, MOTION_TOUCHES, MotionCheck
from envs.collision.separation import Shapes, clearances_of_each, contacts_array, shapes_of
from envs.collision.shapes import POINT, Mesh, Obstacle, Robot, Solid
from envs.problem import Array
from envs.spaces import Space

Allowed = Callable[[Array], NDArray[np.bool_]]


class Prover(Protocol):
    """Quick proofs about a robot among obstacles."""

    def prove(self, a: Array, b: Array, asked: float, kept: float) -> tuple[float, bool]:
        """What is proved of the motion between configurations a and b (d,).

        Args:
            asked, kept: clearances in workspace units, the former the more.

        Returns:
            A place t in [0, 1] of the motion at which the clearance is not more than `asked`, as
            far as lower bounds of it tell, or -1 if it is proved to be more than `kept` all along.
            And whether something surely touches there.
        """
        ...

    def told(self, a: Array, b: Array, tolerance: float) -> int:
        """What is told of the motion, not always where: `MOTION_FREE` if it is proved to keep more
        than half of a tolerance, in workspace units, `MOTION_TOUCHES` if something surely touches,
        else `MOTION_NEARS`. See `motion_check`."""
        ...

    def nothing_within(self, q: Array) -> bool:
        """Whether it is known that nothing is within another at a configuration (d,) where nothing
        is touched."""
        ...


_NEAR = 5e-3
"""Distances of our own up to this, in workspace units, count only if FCL finds no contact."""

_TOUCH = 1e-6
"""The size of a clearance where nothing is touched, but the robot is where it must not be."""


_MOST_NEAR = 1000
"""Configurations of which a searcher may tell, for one path, or four times as many as waypoints."""


Searcher = Callable[[Array, Array, float, float, float, Array], tuple[float, bool, int, int]]
"""(waypoints, bounds, tolerance, most_queries, near, asked) -> `margin_search.least_clearance` of a
path by distances of its own, which are this model's; and how often it has asked, and has found
something above 0 and no more than `near`. The first of these configurations are written to `asked`
(m, d + 1), each with what was found."""


class CollisionModel:
    """A robot among solid obstacles, with a broad phase over the obstacles.

    The distances between a robot's own shapes that must not touch each other change no faster than
    its `motion_bound` either.

    FCL's primitive shapes are solid, so a robot wholly inside one is in collision. Its meshes are
    surfaces: whether the robot is on the right side of one is what `allowed` says.

    Args:
        robot: its shapes, poses and motion bound.
        obstacles: shapes fixed in the workspace.
        tolerance: to which segments and paths are decided, in workspace units: whatever keeps
            more than this clearance is accepted, whatever touches an obstacle is not, and what
            lies between may be refused.
        allowed: (n, d) -> (n,) of bool, where configurations may be that touch nothing; constant
            between obstacles' surfaces. None for everywhere.
        allowed_apart: whether nothing but insides are not `allowed`: what is known not to be within
            anything is where it may be, and is not asked of `allowed`.
        prover: quick proofs, which decide about motions; None for none, so that they are searched.
        space: whose shortest ways motions are; by default straight lines of the numbers. The
            robot's `motion_bound` is of the same.
        may_touch: (moving, obstacles) of bool, which of the robot's shapes may touch which
            obstacles, or be within them; None for none.
        searcher: a quick search for the least clearance of paths; where it has been is `allowed`,
            and whether FCL finds contact, is asked afterwards. None for none.
        motion_check: makes the compiled proofs that decide about motions where there is no prover,
            once one is asked about; it may make None. None for none.

    Attributes:
        checks: the number of configurations that were queried so far.
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Sequence[Obstacle],
        tolerance: float = DEFAULT_TOLERANCE,
        allowed: Allowed | None = None,
        space: Space | None = None,
        *,
        allowed_apart: bool = False,
        prover: Prover | None = None,
        may_touch: NDArray[np.bool_] | None = None,
        searcher: Searcher | None = None,
        motion_check: Callable[[], MotionCheck | None] | None = None,
    ) -> None:
        if not (tolerance > 0 and np.isfinite(tolerance)):
            raise ValueError(f"tolerance must be positive, not {tolerance}")
        self.robot = robot
        self.tolerance = tolerance
        self._space = space
        self._between = continuous.straight if space is None else space.between
        self.checks = 0
        solids, self._shapes = _looked_up(robot)
        self._bodies = [fcl.CollisionObject(solid) for solid in solids]
        self._offsets = [shape.offset for shape in robot.shapes]
        self._allowed = allowed
        self._allowed_apart = allowed_apart
        checked = np.ones((robot.moving, len(obstacles)), dtype=np.bool_)
        if may_touch is not None:
            if may_touch.shape != checked.shape:
                raise ValueError(f"may_touch must be {checked.shape}, not {may_touch.shape}")
            checked = ~may_touch
        self._obstacles = [placed_in_fcl(obstacle) for obstacle in obstacles]
        self._managers = broad_phases(self._obstacles, checked)
        self._is_ball = self._shapes.rows[:, 16] == POINT  # whose rotation does not matter
        exact = [o.exact_in_fcl and bool(self._is_ball.all()) for o in obstacles]
        by_fcl = np.array(exact, dtype=np.bool_)
        boxes = list(compress(self._obstacles, by_fcl))
        of_each = enumerate(broad_phases(boxes, checked[:, by_fcl]))
        self._boxes = [(n, some) for n, some in of_each if checked[n, by_fcl].any()]
        self._around = shapes_of(list(compress(obstacles, ~by_fcl)))
        self._may_touch = contacts_array(None if may_touch is None else may_touch[:, ~by_fcl])
        self._collision = fcl.CollisionRequest()
        self._others: list[list[int]] = [[] for _ in range(robot.moving)]
        for a, b in robot.pairs:  # each pair is asked of one of the two, which moves
            self._others[a].append(b)
        self._pairs = np.array(robot.pairs, dtype=np.int64).reshape(-1, 2)
        self._asks_boxes_alone = not (len(self._around.rows) or len(self._pairs))
        self._prover = prover
        self._searcher = searcher
        self._motion_check = motion_check

    @cached_property
    def _is_free(self) -> Callable[[Array, Array], bool] | None:
        """Compiled proofs of motions; None for none."""
        check = None if self._motion_check is None else self._motion_check()
        return None if check is None else check.is_free

    def is_valid(self, q: Array) -> bool:
        """Whether the robot touches nothing at a configuration (d,). Ignores the bounds."""
        self.checks += 1
        self._place(q)
        apart, known = self._own_clearances(_NEAR)
        if apart.min() <= 0:
            return False
        asked = apart > 0 if self._boxes else apart < _NEAR
        return not self._touch(asked) and self._on_the_right_side(q, known)

    def clearance(self, q: Array, most: float = np.inf) -> float:
        """The distance from robot to obstacles at a configuration (d,), in workspace units, or
        between shapes of the robot that must not touch each other, if that is less; or `most`, if
        that is less.

        Negative where they touch; its size then means nothing.
        """
        self.checks += 1
        self._place(q)
        if self._boxes:
            boxes = self._from_boxes(most)
            apart, known = self._own_clearances(float(boxes.min()))
            apart = np.minimum(apart, boxes)
        else:
            apart, known = self._own_clearances(most)
        least = float(apart.min())
        if 0 < least <= _NEAR:
            least = 0.0 if self._touch((apart <= _NEAR) & (apart < most)) else least
        return least if self._on_the_right_side(q, known) else -max(abs(least), _TOUCH)

    def clearances(self, q: Array, poses: Array) -> Array:
        """The `clearance` (n,) at configurations (n, d) at which the robot's shapes are at poses
        (n, shapes, 3, 4): in less time, where each configuration is near the one before."""
        if self._boxes:
            return np.array([self.clearance(one) for one in q])
        self.checks += len(q)
        least, known = np.empty(len(q)), np.empty(len(q), dtype=np.bool_)
        follows = np.empty(len(q), dtype=np.bool_)
        near = np.zeros((len(q), self.robot.moving), dtype=np.bool_)
        least_along(
            self._shapes,
            poses,
            self._around,
            self._pairs,
            self.robot.moving,
            self._may_touch,
            _NEAR,
            least,
            near,
            known,
            follows,
        )
        for n in np.flatnonzero((least > 0) & (least <= _NEAR)):
            self._place_at(poses[n])
            least[n] = 0.0 if self._touch(near[n]) else least[n]
        if self._allowed is not None:
            if not self._allowed_apart:
                known[:] = follows[:] = False
            wrong = ~_where_allowed(self._allowed, q, known, follows)
            least[wrong] = -np.maximum(np.abs(least[wrong]), _TOUCH)
        return least

    def segment_is_free(self, a: Array, b: Array) -> bool:
        """Whether the motion between configurations a and b (d,) is proved free.

        See `continuous.segment_is_free`, to `self.tolerance`.
        """
        if self._proves:
            return self.stays_free(a, b) and self._is_where_it_may_be(a)
        bound = self.robot.motion_bound(a, b)
        # More than proves all of the motion at once, and than the tolerance.
        enough = bound + 2 * self.tolerance

        def clearance(q: Array) -> float:
            return self.clearance(q, enough)

        return continuous.segment_is_free(clearance, a, b, bound, self.tolerance, self._between)

    def stays_free(self, a: Array, b: Array) -> bool:
        """As `segment_is_free`, of a motion one end of which is known to be valid: where nothing is
        touched, all of it is where it may be if that is."""
        if not self._proves:
            return self.segment_is_free(a, b)
        self.checks += 1
        if self._prover is not None:
            return self._prover.told(a, b, self.tolerance) == MOTION_FREE
        assert self._is_free is not None
        return self._is_free(a, b)

    def may_plan_at(self, q: Array) -> bool:
        """As `is_valid`, for planners: by proofs alone where these tell."""
        if self._prover is not None:
            told = self._prover.told(q, q, self.tolerance)
            if told == MOTION_TOUCHES:
                return False
            is_proved = told == MOTION_FREE
        else:
            is_proved = self._is_free is not None and self._is_free(q, q)
        if not is_proved:
            return self.is_valid(q)
        self.checks += 1
        return self._is_where_it_may_be(q)

    @property
    def _proves(self) -> bool:
        """Whether motions are proved by compiled code."""
        return self._prover is not None or self._is_free is not None

    def keeps(self, q: Array, margin: float) -> bool:
        """Whether the robot is valid at a configuration (d,) and is proved to keep more than a
        margin there, in workspace units: False may mean that it keeps a little more."""
        if self._prover is None:
            return self.clearance(q) > margin
        self.checks += 1
        place, _ = self._prover.prove(q, q, margin + self.tolerance / 4, margin)
        return place < 0 and self._is_where_it_may_be(q)

    def min_clearance(self, waypoints: Array, most_queries: float = np.inf) -> float:
        """The least clearance along a path of waypoints (k, d), to within `self.tolerance`.

        The path is proved free exactly if the result is above `self.tolerance`.
        See `continuous.path_min_clearance`.

        Raises:
            UndecidedError: `most_queries` are not enough.
        """
        speeds = self._speeds(waypoints)
        if self._searcher is not None:
            found = self._searched(self._searcher, waypoints, speeds, most_queries)
            if found is not None:
                return found
        return continuous.path_min_clearance(
            self.clearance,
            waypoints,
            speeds,
            self.tolerance,
            most_queries,
            self._between,
            None if self._prover is None else self._place_below,
        )

    def _searched(
        self, search: Searcher, waypoints: Array, speeds: Sequence[float], most_queries: float
    ) -> float | None:
        """See `min_clearance`; None where too many configurations would be asked about again."""
        asked = np.empty((max(_MOST_NEAR, 4 * len(waypoints)), waypoints.shape[1] + 1))
        near = _NEAR if self._allowed is None else np.inf
        least, decided, checks, count = search(
            waypoints, np.array(speeds), self.tolerance, float(most_queries), near, asked
        )
        self.checks += checks
        if count > len(asked):
            return None
        asked, found = asked[:count, :-1], asked[:count, -1]
        every = np.ones(self.robot.moving, dtype=np.bool_)
        for q in asked[found <= _NEAR]:
            self._place(q)
            if self._touch(every):
                return 0.0
        if self._allowed is not None and not self._allowed(asked).all():
            return -_TOUCH
        if not decided:
            raise continuous.UndecidedError
        return least

    def _place_below(self, a: Array, b: Array, level: float) -> float:
        """A place t on a motion where the clearance may be about a level, -1 if it is proved to be
        more all along."""
        assert self._prover is not None
        return self._prover.prove(a, b, level + self.tolerance / 4, level)[0]

    def first_contact(self, waypoints: Array, most_steps: int = ENOUGH_STEPS) -> Place:
        """The first place of a path of waypoints (k, d) that is not proved free, to
        `self.tolerance`. See `first_contact.first_contact`."""
        bounds = starmap(self.robot.motion_bound, pairwise(waypoints))
        return first_contact(
            self.clearance,
            waypoints,
            self._lengths(waypoints),
            bounds,
            self.tolerance,
            most_steps,
            self._between,
        )

    def _speeds(self, waypoints: Array) -> Sequence[float]:
        """Bounds on the speed of any point, by segment; of very many segments coarser ones."""
        if len(waypoints) > FIRST_QUERIES:
            lengths = self._lengths(waypoints)
            coarse: list[float] = (self.robot.rate_bound * lengths).tolist()
            return coarse
        return [self.robot.motion_bound(a, b) for a, b in pairwise(waypoints)]

    def _lengths(self, waypoints: Array) -> Array:
        """Of the motions between waypoints (k, d), (k - 1,)."""
        if self._space is not None:
            return self._space.distance(waypoints[:-1], waypoints[1:])
        lengths: Array = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
        return lengths

    def _touch(self, bodies: NDArray[np.bool_]) -> bool:
        """Whether FCL finds any of some shapes (moving,) in contact."""
        return any(self._touches(body) for body in bodies.nonzero()[0].tolist())

    def _touches(self, body: int) -> bool:
        """Whether FCL finds a shape in contact with anything that it must not touch."""
        data, one = fcl.CollisionData(), self._body(body)
        self._managers[body].collide(one, data, fcl.defaultCollisionCallback)
        return data.result.is_collision or any(
            fcl.collide(one, self._body(other), self._collision, fcl.CollisionResult())
            for other in self._others[body]
        )

    def _from_boxes(self, most: float) -> Array:
        """The distances (moving,) of the robot's shapes, balls, from boxes along the axes that
        each must not touch, or `most` where that is less."""
        found = np.full(self.robot.moving, most)
        for body, boxes in self._boxes:
            data = fcl.DistanceData()
            boxes.distance(self._body(body), data, fcl.defaultDistanceCallback)
            found[body] = min(data.result.min_distance, most)
        return found

    def _own_clearances(self, most: float) -> tuple[Array, bool]:
        """What the robot's shapes keep (moving,) from all else that they must not touch, and
        whether it is known that nothing is within another: see `clearances_of_each`."""
        if self._asks_boxes_alone:
            return np.full(self.robot.moving, most), True
        found = np.empty(self.robot.moving)
        known = clearances_of_each(
            *(self._shapes, self._poses, self._around, self._pairs),
            *(self._may_touch, most, _NEAR, found),
        )
        return found, known

    def _on_the_right_side(self, q: Array, known: bool) -> bool:
        """Whether a configuration (d,) that touches nothing is where it may be; `known` says that
        nothing is within another."""
        if self._allowed is None or (known and self._allowed_apart):
            return True
        return bool(self._allowed(q[None])[0])

    def _is_where_it_may_be(self, q: Array) -> bool:
        """As `_on_the_right_side`, where only proofs were asked."""
        if self._allowed is None:
            return True
        known = self._allowed_apart and self._prover is not None and self._prover.nothing_within(q)
        return self._on_the_right_side(q, known)

    def _place(self, q: Array) -> None:
        """Takes the robot to a configuration (d,)."""
        self._place_at(self.robot.poses(q))

    def _place_at(self, poses: Array) -> None:
        """Takes its shapes to poses (shapes, 3, 4); FCL's follow when they are asked for."""
        self._poses = poses
        self._waiting = [True] * len(self._bodies)

    def _body(self, number: int) -> fcl.CollisionObject:
        body = self._bodies[number]
        if self._waiting[number]:
            self._waiting[number] = False
            pose, offset = self._poses[number], self._offsets[number]
            if self._is_ball[number]:
                body.setTranslation(pose[:, 3] if offset is None else pose[:, 3] + offset)
            else:
                body.setTransform(fcl_transform(pose[:, :3], pose[:, 3], offset))
        return body


def _where_allowed(
    allowed: Allowed, q: Array, known: NDArray[np.bool_], follows: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which configurations (n, d) are allowed, (n,) of bool: those that are known to be, those of
    which it follows from the one before, and of the others those that are said to be."""
    found: NDArray[np.bool_] = known.copy()
    asked = np.flatnonzero(~(known | follows))
    found[asked] = allowed(q[asked])
    for n in np.flatnonzero(follows & ~known).tolist():
        found[n] = (n > 0 and found[n - 1]) or allowed(q[n : n + 1])[0]
    return found


_KNOWN: WeakKeyDictionary[Robot, tuple[list[fcl.CollisionGeometry], Shapes]] = WeakKeyDictionary()


def _looked_up(robot: Robot) -> tuple[list[fcl.CollisionGeometry], Shapes]:
    """A robot's shapes as FCL has them and as compiled code does, made once for as long as there is
    the robot: scenes of problem sets share one, and its meshes take long."""
    if robot not in _KNOWN:
        _KNOWN[robot] = _geometries(robot.shapes), shapes_of(robot.shapes)
    return _KNOWN[robot]


def _geometries(solids: Sequence[Solid]) -> list[fcl.CollisionGeometry]:
    """Solids as FCL has them. Of meshes, equal ones share what takes long to make."""
    meshes = dict.fromkeys(solid for solid in solids if isinstance(solid, Mesh))
    made = {mesh: mesh.fcl_geometry() for mesh in meshes}
    return [made[s] if isinstance(s, Mesh) else s.fcl_geometry() for s in solids]
