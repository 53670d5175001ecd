"""A serial arm with solid links."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import at, compose
from envs.collision.separation import Shapes, separations, shapes_of
from envs.collision.shapes import PlacedShape, Pose, Solid
from envs.compiled import njit_cached
from envs.problem import Array
from envs.robots.allowed_collisions import LinkPairs, link_pairs, no_pairs, poses_of
from envs.robots.chain import Chain, ChainArrays, body_poses
from envs.robots.tip_and_stand import tip_of

SLACK = 0.008
"""About how far, in metres, the spheres that cover links reach out of their sides."""


@dataclass(frozen=True, eq=False)
class Part:
    """A solid of a link.

    Attributes:
        body: the number of the link's.
        placed: in the body's frame.
        link: its name; "" for the first link of the body.
    """

    body: int
    placed: PlacedShape
    link: str = ""


class RobotArrays(NamedTuple):
    """An arm as compiled code sees it.

    Attributes:
        chain: its joints.
        bodies: (p,) of the parts.
        offsets: (p, 3, 4) from the parts' frames to their bodies'.
        middles, radii: (p, 3) in the bodies' frames and (p,), of spheres that hold the parts.
        reach: (d, p) greatest distance of any point of a part from a joint's axis; 1 where the
            joint slides, 0 where it does not move the part.
        balls: (m, 4) centres in the bodies' frames, and radii, of spheres that cover the parts.
        ball_parts: (m,) which part each covers, in ascending order.
        first_balls: (p + 1,) where each part's begin.
        extents: (p,) radii of spheres about `middles` that hold a part's balls.
        shapes: the parts in their bodies' frames.
        pairs: (p, p) of bool, which parts must not touch each other.
        moving: the number of parts that move; they come first.
    """

    chain: ChainArrays
    bodies: NDArray[np.int64]
    offsets: Array
    middles: Array
    radii: Array
    reach: Array
    balls: Array
    ball_parts: NDArray[np.int64]
    first_balls: NDArray[np.int64]
    extents: Array
    shapes: Shapes
    pairs: NDArray[np.bool_]
    moving: int


class Arm:
    """A robot of links and joints on a fixed base. See `envs.collision.shapes.Robot`.

    The base, which cannot move, is not checked against the obstacles, only against other links.

    Args:
        chain: its kinematics.
        parts: the solids of its links.
        self_collision: whether links must not touch each other, but for those that may; see
            `allowed_collisions`.

    Raises:
        ValueError: no part moves.
    """

    def __init__(self, chain: Chain, parts: Sequence[Part], self_collision: bool) -> None:
        self.chain = chain
        moving = [part for part in parts if part.body > 0]
        if not moving:
            raise ValueError("no link that moves has a collision geometry")
        fixed = [part for part in parts if part.body == 0] if self_collision else []
        self.parts = (*moving, *fixed)
        self.self_collision = self_collision

    @property
    def shapes(self) -> tuple[Solid, ...]:
        return tuple(part.placed.solid for part in self.parts)

    @property
    def moving(self) -> int:
        return self.arrays.moving

    @cached_property
    def links(self) -> tuple[str, ...]:
        """The names of the links that the parts belong to."""
        first = {link.body: link.name for link in reversed(self.chain.links)}
        return tuple(part.link or first[part.body] for part in self.parts)

    @cached_property
    def _shapes(self) -> Shapes:
        return shapes_of([part.placed for part in self.parts])

    @cached_property
    def link_pairs(self) -> LinkPairs:
        """Which parts must not touch each other, and how far they come apart."""
        if not self.self_collision:
            return no_pairs(len(self.parts))
        bodies = np.array([part.body for part in self.parts])
        placed = [part.placed for part in self.parts]
        return link_pairs(self.chain, bodies, self.links, placed, self._shapes)

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        both = np.argwhere(self.link_pairs.checked)
        body = [part.body for part in self.parts]
        return tuple((int(i), int(j)) for i, j in both if body[i] > body[j])

    @cached_property
    def rate_bound(self) -> float:
        reach = self.arrays.reach[:, : self.moving]
        return float(np.sqrt((reach**2).sum(axis=0)).max())

    @cached_property
    def extent(self) -> float:
        """How far from the first joint, in metres, any point of the moving parts can be."""
        joints = self.chain.joints
        hops = [float(np.linalg.norm(joint.origin[:3, 3])) for joint in joints[1:]]
        slides = [_slide(joint.prismatic, joint.lower, joint.upper) for joint in joints]
        arrays = self.arrays
        outward = np.linalg.norm(arrays.middles, axis=1) + arrays.extents
        return sum(hops) + sum(slides) + float(outward.max())

    def poses(self, q: Array) -> tuple[Pose, ...]:
        found = np.empty((len(self.parts), 3, 4))
        _part_poses(self.arrays, q, found)
        return tuple((pose[:, :3], pose[:, 3]) for pose in found)

    def trace(self, q: Array) -> Array:
        """The tip of the tool; see `tip_and_stand`."""
        last = self.chain.forward(q)[:, -1]
        found: Array = last[:, :3, :3] @ self._tip + last[:, :3, 3]
        return found[:, None]

    @cached_property
    def _tip(self) -> Array:
        last = self.chain.links[-1]
        return tip_of(last, [part.placed for part in self.parts if part.body == last.body])

    def body_poses(self, q: Array) -> Array:
        """The poses (1 + d, 3, 4) of its bodies at a configuration (d,)."""
        found = np.empty((1 + self.chain.dimension, 3, 4))
        body_poses(self.chain.arrays, q, found)
        return found

    def links_keep(self, kept: Array, q: Array) -> NDArray[np.bool_]:
        """Whether parts that must not touch each other keep so far (p, p) apart, in metres, at
        configurations (n, d), (n,) of bool."""
        keep = np.ones(len(q), dtype=np.bool_)
        for pair in self.pairs:
            poses = poses_of(self.chain, self.arrays.bodies[list(pair)], q[keep])
            keep[keep] &= separations(self._shapes, *pair, poses, kept[pair]) >= kept[pair]
        return keep

    def motion_bound(self, a: Array, b: Array) -> float:
        """See `part_bounds`; the greatest of the parts'."""
        bounds = np.empty(self.moving)
        part_bounds(self.arrays, np.asarray(a), np.asarray(b), bounds)
        return float(bounds.max())

    @cached_property
    def arrays(self) -> RobotArrays:
        """What compiled code is given."""
        bodies = np.array([part.body for part in self.parts])
        offsets = np.array([part.placed.pose[:3] for part in self.parts])
        spheres = [part.placed.solid.bounding_sphere() for part in self.parts]
        middles = np.array(
            [pose[:, :3] @ m + pose[:, 3] for pose, (m, _) in zip(offsets, spheres, strict=True)]
        )
        radii = np.array([radius for _, radius in spheres])
        balls, ball_parts = self._covered(offsets)
        outward = np.linalg.norm(balls[:, :3] - middles[ball_parts], axis=1) + balls[:, 3]
        first_balls = np.searchsorted(ball_parts, np.arange(len(bodies) + 1))
        return RobotArrays(
            self.chain.arrays,
            bodies,
            offsets,
            middles,
            radii,
            self._reach(bodies, middles, radii),
            balls,
            ball_parts,
            first_balls,
            np.maximum.reduceat(outward, first_balls[:-1]),
            self._shapes,
            self.link_pairs.checked,
            int((bodies > 0).sum()),
        )

    def _covered(self, offsets: Array) -> tuple[Array, NDArray[np.int64]]:
        balls, owners = [], []
        for number, (part, pose) in enumerate(zip(self.parts, offsets, strict=True)):
            spheres = part.placed.solid.sphere_cover(SLACK)
            centers = spheres.centers @ pose[:, :3].T + pose[:, 3]
            balls.append(np.column_stack([centers, spheres.radii]))
            owners.append(np.full(len(centers), number))
        return np.concatenate(balls), np.concatenate(owners)

    def _reach(self, bodies: NDArray[np.int64], middles: Array, radii: Array) -> Array:
        """See `RobotArrays`. From a joint's axis along the chain to the part, joint by joint: only
        the first stretch turns about that axis alone; what of it lies along the axis does not
        count."""
        reach = np.zeros((self.chain.dimension, len(bodies)))
        for part, body in enumerate(bodies):
            beyond = float(np.linalg.norm(middles[part])) + radii[part]
            for i in range(body - 1, -1, -1):
                joint = self.chain.joints[i]
                if i == body - 1:
                    off_axis = _off_axis(joint.axis, middles[part]) + radii[part]
                else:
                    next_joint = self.chain.joints[i + 1]
                    hop = next_joint.origin[:3, 3]
                    slide = _slide(next_joint.prismatic, next_joint.lower, next_joint.upper)
                    off_axis = _off_axis(joint.axis, hop) + slide + beyond
                    beyond += float(np.linalg.norm(hop)) + slide
                reach[i, part] = 1.0 if joint.prismatic else off_axis
        return reach


def _off_axis(axis: Array, point: Array) -> float:
    return float(np.linalg.norm(point - (point @ axis) * axis))


def _slide(prismatic: bool, lower: float, upper: float) -> float:
    return max(abs(lower), abs(upper)) if prismatic else 0.0


@njit_cached
def _part_poses(arm: Any, q: Any, poses: Any) -> None:
    bodies = np.empty((1 + len(q), 3, 4))
    body_poses(arm.chain, q, bodies)
    for part in range(len(poses)):
        compose(bodies[arm.bodies[part]], arm.offsets[part], poses[part])


@njit_cached
def part_bounds(arm: Any, a: Any, b: Any, bounds: Any) -> None:
    """Writes bounds (moving,) on the speed of any point of each part, in metres per unit of t,
    while the configuration moves as a + t (b - a), t in [0, 1].

    Joint i moves a point by its change times the point's distance from its axis. That distance is
    at most what it is in the middle of the motion, and what the joints between add by then.
    """
    d = len(a)
    middle, half = np.empty(d), np.empty(d)
    for i in range(d):
        middle[i] = (a[i] + b[i]) / 2
        half[i] = abs(b[i] - a[i]) / 2
    bodies = np.empty((1 + d, 3, 4))
    body_poses(arm.chain, middle, bodies)
    for part in range(arm.moving):
        body = arm.bodies[part]
        pose = bodies[body]
        x, y, z = at(pose, arm.middles[part])
        bounds[part] = 0.0
        later = 0.0  # by how much the joints after i may move the part within half the motion
        for i in range(body - 1, -1, -1):
            reach = arm.reach[i, part]
            if not arm.chain.prismatic[i]:
                reach = min(reach, _from_axis(arm, bodies, i, x, y, z) + arm.radii[part] + later)
            bounds[part] += 2 * half[i] * reach
            later += half[i] * arm.reach[i, part]


@njit_cached
def _from_axis(arm: Any, bodies: Any, joint: int, x: float, y: float, z: float) -> float:
    """The distance of a point from the axis of a joint, whose body's pose is in `bodies`."""
    pose = bodies[joint + 1]
    axis = arm.chain.axes[joint]
    ux = pose[0, 0] * axis[0] + pose[0, 1] * axis[1] + pose[0, 2] * axis[2]
    uy = pose[1, 0] * axis[0] + pose[1, 1] * axis[1] + pose[1, 2] * axis[2]
    uz = pose[2, 0] * axis[0] + pose[2, 1] * axis[1] + pose[2, 2] * axis[2]
    dx, dy, dz = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    cx, cy, cz = dy * uz - dz * uy, dz * ux - dx * uz, dx * uy - dy * ux
    return math.sqrt(cx * cx + cy * cy + cz * cz)
