"""An arm, or several on one base: a kinematic tree with solid links."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import compose
from envs.collision.separation import Shapes, shapes_of
from envs.collision.shapes import PlacedShape, Solid
from envs.compiled import njit_cached
from envs.problem import Array
from envs.robots.allowed_collisions import LinkPairs, link_pairs, no_pairs
from envs.robots.kinematic_tree import KinematicTree, TreeArrays, body_poses
from envs.robots.motion_bounds import part_bounds
from envs.robots.part_distances import keep_apart
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
        tree: its joints; for motions as `KinematicTree.motions` has them.
        bodies: (p,) of the parts.
        offsets: (p, 3, 4) from the parts' frames to their bodies'.
        middles, radii: (p, 3) in the bodies' frames and (p,), of spheres that hold the parts.
        reach: (m, p) greatest distance of any point of a part from a joint's axis, or from where a
            spherical one is; 1 where the joint slides, 0 where it does not move the part.
        balls: (m, 4) centres in the bodies' frames, and radii, of spheres that cover the parts.
        ball_parts: (m,) which part each covers, in ascending order.
        first_balls: (p + 1,) where each part's begin.
        extents: (p,) radii of spheres about `middles` that hold a part's balls.
        shapes: the parts in their bodies' frames.
        branches: (k, 3) pairs of parts that must not touch each other, each once, with the body on
            which the two branch: that of the other where the one is farther out on the same branch.
            The first has the greater body.
        moving: the number of parts that move; they come first.
    """

    tree: TreeArrays
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
    branches: NDArray[np.int64]
    moving: int


class Arm:
    """A robot of links and joints. See `envs.collision.shapes.Robot`.

    A base that stands still is not checked against the obstacles, only against other links.

    Args:
        tree: its kinematics.
        parts: the solids of its links.
        self_collision: whether links must not touch each other, but for those that may; see
            `allowed_collisions`.
        allowed: pairs of names of links that are told to be such.

    Raises:
        ValueError: no part moves.
    """

    def __init__(
        self,
        tree: KinematicTree,
        parts: Sequence[Part],
        self_collision: bool,
        allowed: Collection[frozenset[str]] = (),
    ) -> None:
        self.tree = tree
        moving = [part for part in parts if part.body > 0]
        if not moving:
            raise ValueError("no link that moves has a collision geometry")
        fixed = [part for part in parts if part.body == 0] if self_collision else []
        self.parts = (*moving, *fixed)
        self.self_collision = self_collision
        self.allowed = frozenset(allowed)

    @property
    def shapes(self) -> tuple[Solid, ...]:
        return tuple(part.placed.solid for part in self.parts)

    @cached_property
    def moving(self) -> int:
        return sum(part.body > 0 for part in self.parts)

    @cached_property
    def links(self) -> tuple[str, ...]:
        """The names of the links that the parts belong to."""
        first = {link.body: link.name for link in reversed(self.tree.links)}
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
        return link_pairs(self.tree, bodies, self.links, placed, self._shapes, self.allowed)

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        both = np.argwhere(self.link_pairs.checked)
        body = [part.body for part in self.parts]
        return tuple((int(i), int(j)) for i, j in both if body[i] > body[j])

    @cached_property
    def rate_bound(self) -> float:
        arrays = self.arrays
        speeds = np.abs(arrays.tree.ratios)[:, None] * arrays.reach  # per unit of a coordinate
        found = float(self._rates(speeds[:, : self.moving]).max())
        for part, other, branch in arrays.branches:
            # Only what moves them as seen from where they branch; see `motion_bounds`.
            shared = list(self.tree.joints_to(branch))
            both = speeds[:, [part, other]].sum(axis=1)
            both[shared] = 0.0
            found = max(found, float(self._rates(both[:, None])[0]))
        return found

    def _rates(self, speeds: Array) -> Array:
        """Per unit of distance in configuration space, (n,), of what joints move by speeds (m, n)
        each: the parts' distances add up, within one they are Euclidean."""
        space = self.tree.space
        rates = np.zeros((space.size, speeds.shape[1]))
        np.add.at(rates, self.arrays.tree.coordinates, speeds)
        parts = zip(space.parts, space.places, strict=True)
        greatest: Array = np.max([_norms(rates[at]) / part.weight for part, at in parts], axis=0)
        return greatest

    @cached_property
    def extent(self) -> float:
        """How far from the first joint, in metres, any point of the moving parts can be."""
        first = self.tree.joints[0].origin[:3, 3]
        hops, slides = [0.0], [0.0]  # by body, from the base on
        for joint, parent in zip(self.tree.joints, self.tree.parents, strict=True):
            begin = joint.origin[:3, 3]
            hops.append(hops[parent] + float(np.linalg.norm(begin if parent else begin - first)))
            slides.append(slides[parent] + joint.slide)
        arrays = self.arrays
        outward = np.linalg.norm(arrays.middles, axis=1) + arrays.extents
        return max(hops) + max(slides) + float(outward.max())

    def poses(self, q: Array) -> Array:
        found: Array = self.poses_along(q[None])[0]
        return found

    def poses_along(self, q: Array) -> Array:
        """The `poses` (n, shapes, 3, 4) at configurations (n, d)."""
        tree, arrays = self.tree.arrays, self.arrays
        q = np.ascontiguousarray(q, dtype=np.float64)
        found: Array = _part_poses(tree, arrays.bodies, arrays.offsets, q)
        return found

    def trace(self, q: Array) -> Array:
        """The tips of its tools, one for each branch; see `tip_and_stand`."""
        poses = self.tree.forward(q)[:, [number for number, _ in self._tips]]
        tips = np.array([tip for _, tip in self._tips])
        found: Array = np.einsum("nkij,kj->nki", poses[..., :3, :3], tips) + poses[..., :3, 3]
        return found

    @cached_property
    def _tips(self) -> list[tuple[int, Array]]:
        """The number of the last link of each branch, and the tip (3,) in its frame."""
        last = {link.body: number for number, link in enumerate(self.tree.links)}
        ends = sorted(set(last) - set(self.tree.parents) - {0})
        found = []
        for body in ends:
            carried = [part.placed for part in self.parts if part.body == body]
            found.append((last[body], tip_of(self.tree.links[last[body]], carried)))
        return found

    def body_poses(self, q: Array) -> Array:
        """The poses (1 + m, 3, 4) of its bodies at a configuration (d,)."""
        found = np.empty((1 + len(self.tree.joints), 3, 4))
        body_poses(self.tree.arrays, q, found)
        return found

    def links_keep(self, kept: Array, q: Array) -> NDArray[np.bool_]:
        """Whether parts that must not touch each other keep so far (p, p) apart, in metres, at
        configurations (n, d), (n,) of bool."""
        arm = self.arrays
        q = np.ascontiguousarray(q, dtype=np.float64)
        found = keep_apart(arm.tree, arm.bodies, arm.shapes, arm.branches, kept, q)
        return np.asarray(found)

    def motion_bound(self, a: Array, b: Array) -> float:
        """See `part_bounds`; the greatest of the parts'."""
        bounds = np.empty(self.moving)
        [(arrays, (begin, end))] = self.motions(np.array([a, b]))
        part_bounds(arrays, begin, end, bounds)
        return float(bounds.max())

    def motions(self, path: Array) -> Iterator[tuple[RobotArrays, Array]]:
        """A path of waypoints (k, d) for compiled code; see `KinematicTree.motions`."""
        for tree, straight in self.tree.motions(path):
            yield self.arrays._replace(tree=tree), straight

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
            self.tree.arrays,
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
            self._branches(bodies),
            self.moving,
        )

    def _branches(self, bodies: NDArray[np.int64]) -> NDArray[np.int64]:
        """See `RobotArrays`."""
        found = [(i, j, self.tree.branch(bodies[i], bodies[j])) for i, j in self.pairs]
        return np.array(found, dtype=np.int64).reshape(-1, 3)

    def _covered(self, offsets: Array) -> tuple[Array, NDArray[np.int64]]:
        balls, owners = [], []
        for number, (part, pose) in enumerate(zip(self.parts, offsets, strict=True)):
            spheres = part.placed.solid.sphere_cover(SLACK)
            centers = spheres.centers @ pose[:, :3].T + pose[:, 3]
            balls.append(np.column_stack([centers, spheres.radii]))
            owners.append(np.full(len(centers), number))
        return np.concatenate(balls), np.concatenate(owners)

    def _reach(self, bodies: NDArray[np.int64], middles: Array, radii: Array) -> Array:
        """See `RobotArrays`. From a joint's axis out to the part, joint by joint: only the first
        stretch turns about that axis alone; what of it lies along the axis does not count."""
        joints = self.tree.joints
        reach = np.zeros((len(joints), len(bodies)))
        for part, body in enumerate(bodies):
            beyond = float(np.linalg.norm(middles[part])) + radii[part]
            last = None
            for i in self.tree.joints_to(body):
                if last is None:
                    off_axis = _off_axis(joints[i].axis, middles[part]) + radii[part]
                else:
                    hop, slide = last.origin[:3, 3], last.slide
                    off_axis = _off_axis(joints[i].axis, hop) + slide + beyond
                    beyond += float(np.linalg.norm(hop)) + slide
                reach[i, part] = 1.0 if joints[i].prismatic else off_axis
                last = joints[i]
        return reach


def _norms(columns: Array) -> Array:
    found: Array = np.sqrt((columns**2).sum(axis=0))
    return found


def _off_axis(axis: Array, point: Array) -> float:
    """How far a point (3,) is from an axis, or from the origin if there is none."""
    return float(np.linalg.norm(point - (point @ axis) * axis))


@njit_cached
def _part_poses(tree: Any, bodies: Any, offsets: Any, q: Any) -> Any:
    """The poses (n, p, 3, 4) of parts of bodies (p,), at offsets (p, 3, 4) from them, at
    configurations (n, d)."""
    there, poses = np.empty((1 + len(tree.parents), 3, 4)), np.empty((len(q), len(bodies), 3, 4))
    for n in range(len(q)):
        body_poses(tree, q[n], there)
        for part in range(len(bodies)):
            compose(there[bodies[part]], offsets[part], poses[n, part])
    return poses
