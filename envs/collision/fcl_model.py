"""Collision and distance queries between a robot and a scene, through FCL.

FCL's search for the distance between two solids that are no spheres ends too early at times: of
random poses of a cylinder and a box one in some thousands is found too far apart, by up to
decimetres, and of a mesh and a cylinder by up to centimetres. So distances are our own
(`separation`), which are never above the truth, but for those of balls from boxes along the axes,
which FCL has in closed form. Whether anything touches FCL is asked as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise, starmap
from typing import Any

import fcl
import numpy as np
from numpy.typing import NDArray

from envs.collision import continuous
from envs.collision.continuous import DEFAULT_TOLERANCE
from envs.collision.first_contact import ENOUGH_STEPS, Place, first_contact
from envs.collision.gjk import least_distance, put
from envs.collision.separation import least_separation, separations, shapes_of
from envs.collision.shapes import Obstacle, Robot
from envs.problem import Array
from envs.spaces import Space

Allowed = Callable[[Array], NDArray[np.bool_]]

_NEAR = 5e-3
"""Distances of our own up to this, in workspace units, count only if FCL finds no contact."""

_TOUCH = 1e-6
"""Workspace units beyond which it does not matter, to contact, how far things are apart."""

LowerBounds = Callable[[Array, float], Array]


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
        lower_bounds: ((d,), most) -> (moving,), never more than the distances of the robot's
            moving shapes from the obstacles and from others that they must not touch; what is
            farther than `most` need not be known. What they prove is not asked of FCL. None for no
            such bounds.
        space: whose shortest ways motions are; by default straight lines of the numbers. The
            robot's `motion_bound` is of the same.

    Attributes:
        checks: the number of configurations that were queried so far.
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Sequence[Obstacle],
        tolerance: float = DEFAULT_TOLERANCE,
        allowed: Allowed | None = None,
        lower_bounds: LowerBounds | None = None,
        space: Space | None = None,
    ) -> None:
        if not (tolerance > 0 and np.isfinite(tolerance)):
            raise ValueError(f"tolerance must be positive, not {tolerance}")
        self.robot = robot
        self.tolerance = tolerance
        self._space = space
        self._between = continuous.straight if space is None else space.between
        self.checks = 0
        self._bodies = [fcl.CollisionObject(shape.fcl_geometry()) for shape in robot.shapes]
        self._offsets = [shape.offset for shape in robot.shapes]
        self._allowed = allowed
        self._obstacles = [_placed(obstacle) for obstacle in obstacles]
        self._manager = _manager(self._obstacles)
        boxes = [f for o, f in zip(obstacles, self._obstacles, strict=True) if o.exact_in_fcl]
        self._boxes = _manager(boxes) if boxes else None
        around = [o for o in obstacles if not o.exact_in_fcl]
        self._has_others = bool(around)
        self._around = shapes_of(around)
        self._shapes = shapes_of(robot.shapes)
        self._has_meshes = bool(len(self._around.trees.radii) or len(self._shapes.trees.radii))
        self._collision = fcl.CollisionRequest()
        self._others: list[list[int]] = [[] for _ in range(robot.moving)]
        for a, b in robot.pairs:  # each pair is asked of one of the two, which moves
            self._others[a].append(b)
        self._lower_bounds = lower_bounds
        self._no_bounds = np.full(robot.moving, -np.inf)

    def is_valid(self, q: Array) -> bool:
        """Whether the robot touches nothing at a configuration (d,). Ignores the bounds."""
        self.checks += 1
        bounds = self._bounds(q, _TOUCH)
        near = [number for number, bound in enumerate(bounds) if bound <= 0]
        if near:
            self._place(q)
        touches = any(
            self._touches(self._manager, body)
            or self._touches_itself(body)
            or self._own_distance(body, _TOUCH) <= 0
            for body in near
        )
        return not touches and self._on_the_right_side(q)

    def clearance(self, q: Array, most: float = np.inf) -> float:
        """The distance from robot to obstacles at a configuration (d,), in workspace units, or
        between shapes of the robot that must not touch each other, if that is less; or `most`, if
        that is less.

        Negative where they touch; its size then means nothing.
        """
        self.checks += 1
        self._place(q)
        bounds = self._bounds(q, most)
        least = most
        for body in np.argsort(bounds, kind="stable"):
            if bounds[body] >= least:
                break
            least = min(least, self._distance_of(body, least))
        return least if self._on_the_right_side(q) else -max(abs(least), _TOUCH)

    def segment_is_free(self, a: Array, b: Array) -> bool:
        """Whether the motion between configurations a and b (d,) is proved free.

        See `continuous.segment_is_free`, to `self.tolerance`.
        """
        bound = self.robot.motion_bound(a, b)
        # More than proves all of the motion at once, and than the tolerance.
        enough = bound + 2 * self.tolerance

        def clearance(q: Array) -> float:
            return self.clearance(q, enough)

        return continuous.segment_is_free(clearance, a, b, bound, self.tolerance, self._between)

    def min_clearance(self, waypoints: Array, most_queries: float = np.inf) -> float:
        """The least clearance along a path of waypoints (k, d), to within `self.tolerance`.

        The path is proved free exactly if the result is above `self.tolerance`.
        See `continuous.path_min_clearance`.

        Raises:
            UndecidedError: `most_queries` are not enough.
        """
        return continuous.path_min_clearance(
            self.clearance,
            waypoints,
            self._speeds(waypoints),
            self.tolerance,
            most_queries,
            self._between,
        )

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
        if len(waypoints) > continuous.FIRST_QUERIES:
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

    def _touches(self, manager: Any, body: int) -> bool:
        data = fcl.CollisionData()
        manager.collide(self._body(body), data, fcl.defaultCollisionCallback)
        return bool(data.result.is_collision)

    def _touches_itself(self, body: int) -> bool:
        one = self._body(body)
        return any(
            fcl.collide(one, self._body(other), self._collision, fcl.CollisionResult())
            for other in self._others[body]
        )

    def _distance_of(self, body: int, most: float) -> float:
        """The distance of a shape from all that it must not touch, or something above `most`."""
        least = most
        if self._boxes is not None:
            data = fcl.DistanceData()
            self._boxes.distance(self._body(body), data, fcl.defaultDistanceCallback)
            least = min(least, data.result.min_distance)
        least = min(least, self._own_distance(body, least))
        if 0 < least <= _NEAR and (
            self._touches(self._manager, body) or self._touches_itself(body)
        ):
            return 0.0
        return least

    def _own_distance(self, body: int, most: float) -> float:
        """The same, without boxes along the axes: see `separation`."""
        least = most
        if self._has_others:
            turn, shift = self._poses[body]
            turn = _UNTURNED if turn is None else turn
            if self._has_meshes:
                found = least_separation(self._shapes, body, turn, shift, self._around, least)
            else:  # the same, in less time: trees that are empty are handed over as well
                row = put(self._shapes.rows[body], turn, np.asarray(shift))
                found = least_distance(row, self._around.rows, least)
            least = min(least, found)
        for other in self._others[body]:
            poses = np.array([[self._pose(body), self._pose(other)]])
            least = min(least, separations(self._shapes, body, other, poses, least)[0])
        return least

    def _pose(self, number: int) -> Array:
        turn, shift = self._poses[number]
        return np.column_stack([_UNTURNED if turn is None else turn, shift])

    def _bounds(self, q: Array, most: float) -> Array:
        if self._lower_bounds is None:
            return self._no_bounds
        return self._lower_bounds(q, most)

    def _on_the_right_side(self, q: Array) -> bool:
        return self._allowed is None or bool(self._allowed(q[None])[0])

    def _place(self, q: Array) -> None:
        """Takes the robot to a configuration; its shapes follow when they are asked for."""
        self._poses = self.robot.poses(q)
        self._waiting = [True] * len(self._bodies)

    def _body(self, number: int) -> fcl.CollisionObject:
        body = self._bodies[number]
        if self._waiting[number]:
            self._waiting[number] = False
            rotation, translation = self._poses[number]
            offset = self._offsets[number]
            if rotation is None:
                body.setTranslation(translation if offset is None else translation + offset)
            else:
                body.setTransform(_transform(rotation, translation, offset))
        return body


_UNTURNED = np.eye(3)


def _manager(objects: Sequence[Any]) -> Any:
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    return manager


def _placed(obstacle: Obstacle) -> fcl.CollisionObject:
    solid, pose = obstacle.solid, obstacle.pose
    transform = _transform(pose[:3, :3], pose[:3, 3], solid.offset)
    return fcl.CollisionObject(solid.fcl_geometry(), transform)


def _transform(rotation: Array, translation: Array, offset: Array | None) -> fcl.Transform:
    """Of what FCL is given of a solid at a pose, see `Solid.offset`."""
    if offset is not None:
        translation = translation + rotation @ offset
    return fcl.Transform(rotation, translation)
