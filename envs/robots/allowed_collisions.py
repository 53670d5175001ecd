"""Which links of an arm may touch each other: its allowed collision matrix.

Links may touch that are neighbours by a joint, or by several with nothing solid between; those that
are in contact in every one of some thousands of configurations; and those that are told to, as by
an SRDF file. All others are checked, whether or not they were ever seen to touch.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.mesh import queries
from envs.collision.separation import Shapes, separations
from envs.collision.shapes import Mesh, PlacedShape
from envs.compiled import njit_cached
from envs.problem import Array
from envs.robots.kinematic_tree import KinematicTree, body_poses
from envs.seeding import stream

_SAMPLES = 2048
"""Configurations in which links are in contact if they may be."""

_FIRST = 16
"""Configurations that are looked at before the rest, of which most pairs need no more."""

FAR = 0.05
"""Metres: how much farther parts come apart is not asked."""


class LinkPairs(NamedTuple):
    """Pairs of an arm's parts.

    Attributes:
        checked: (p, p) of bool, which must not touch each other.
        farthest: (p, p) how far they come apart in some thousands of configurations, in metres, as
            far as that is no more than `FAR`; of those that are not checked, 0.
    """

    checked: NDArray[np.bool_]
    farthest: Array


def no_pairs(parts: int) -> LinkPairs:
    """Of an arm whose links may touch each other."""
    return LinkPairs(np.zeros((parts, parts), dtype=np.bool_), np.zeros((parts, parts)))


def link_pairs(
    tree: KinematicTree,
    bodies: NDArray[np.int64],
    links: Sequence[str],
    placed: Sequence[PlacedShape],
    shapes: Shapes,
    allowed: Collection[frozenset[str]],
) -> LinkPairs:
    """Which parts must not touch each other.

    Args:
        tree: the arm's kinematics.
        bodies, links: (p,) that the parts belong to.
        placed: (p,) the parts in the bodies' frames.
        shapes: the same for compiled code.
        allowed: pairs of names of links that are told to be allowed to.
    """
    pairs = no_pairs(len(bodies))
    joined = neighbours(tree, set(links))
    q = tree.space.sample(stream("self collision"), _SAMPLES)
    for i, j in combinations(range(len(bodies)), 2):
        if bodies[i] == bodies[j] or frozenset((links[i], links[j])) in allowed:
            continue
        # Two arms on a frame without solids are not joined to each other.
        on_one_way = tree.branch(bodies[i], bodies[j]) in (bodies[i], bodies[j])
        if on_one_way and (links[i], links[j]) in joined:
            continue
        apart = _farthest(tree, bodies, placed, shapes, (i, j), q)
        for a, b in ((i, j), (j, i)):
            pairs.checked[a, b], pairs.farthest[a, b] = apart > 0, apart
    return pairs


def _farthest(
    tree: KinematicTree,
    bodies: NDArray[np.int64],
    placed: Sequence[PlacedShape],
    shapes: Shapes,
    pair: tuple[int, int],
    q: Array,
) -> float:
    """See `LinkPairs.farthest`; 0 if the two are in contact, or one is within the other, in all of
    the configurations (n, d)."""
    farthest = 0.0
    for some in (q[:_FIRST], q[_FIRST:]):
        poses = poses_of(tree, bodies[list(pair)], some)
        apart = separations(shapes, *pair, poses, FAR)
        found = apart > 0
        for this, other in ((0, 1), (1, 0)):
            solid = placed[pair[this]]
            if isinstance(solid.solid, Mesh) and found.any():
                points = _points(placed[pair[other]], poses[found, other])
                found[found] = ~_encloses(solid.solid, poses[found, this], solid.pose, points)
        farthest = max(farthest, apart[found].max(initial=0.0))
        if farthest >= FAR:
            return FAR
    return farthest


def poses_of(tree: KinematicTree, bodies: NDArray[np.int64], q: Array) -> Array:
    """The poses (n, 2, 3, 4) of two of a tree's bodies at configurations (n, d)."""
    poses = np.empty((len(q), 2, 3, 4))
    _poses_of(tree.arrays, np.ascontiguousarray(q, dtype=np.float64), bodies, poses)
    return poses


def _points(placed: PlacedShape, poses: Array) -> Array:
    """A point of each piece of a shape, (n, k, 3), whose body is at poses (n, 3, 4)."""
    there: Array = placed.piece_points() @ np.swapaxes(poses[:, :, :3], 1, 2) + poses[:, None, :, 3]
    return there


def _encloses(mesh: Mesh, poses: Array, offset: Array, points: Array) -> NDArray[np.bool_]:
    """Whether a mesh has one of some points (n, k, 3) within, (n,) of bool. It is at an offset
    (4, 4) from its body, which is at poses (n, 3, 4)."""
    local = (points - poses[:, None, :, 3]) @ poses[:, :, :3]
    local = (local - offset[:3, 3]) @ offset[:3, :3]
    inside = queries(mesh).is_inside(local.reshape(-1, 3))
    found: Any = inside.reshape(points.shape[:2]).any(axis=1)
    return np.asarray(found)


def neighbours(tree: KinematicTree, solid: Collection[str]) -> set[tuple[str, str]]:
    """Pairs of links with solids, either way round, that are joined with no other link with a
    solid between them.

    Args:
        solid: names of the links that have solids.
    """
    beside: dict[str, set[str]] = {link.name: set() for link in tree.links}
    for link in tree.links:
        if link.parent:
            beside[link.name].add(link.parent)
            beside[link.parent].add(link.name)
    found = set()
    for begin in solid:
        seen, todo = {begin}, [begin]
        while todo:
            for name in beside[todo.pop()] - seen:
                seen.add(name)
                if name in solid:
                    found.add((begin, name))
                else:
                    todo.append(name)
    return found


@njit_cached
def _poses_of(tree: Any, q: Any, bodies: Any, poses: Any) -> None:
    """Writes the poses (n, 2, 3, 4) of two bodies."""
    found = np.empty((1 + len(tree.parents), 3, 4))
    for n in range(len(q)):
        body_poses(tree, q[n], found)
        poses[n, 0], poses[n, 1] = found[bodies[0]], found[bodies[1]]
