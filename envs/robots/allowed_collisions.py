"""Which links of an arm may touch each other: its allowed collision matrix.

Links may touch that are neighbours by a joint, or by several with nothing solid between; those that
are in contact in every one of some thousands of configurations; and those that are told to, as by
an SRDF file. All others are checked, whether or not they were ever seen to touch.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.mesh import queries
from envs.collision.separation import Shapes
from envs.collision.shapes import Mesh, PlacedShape
from envs.problem import Array
from envs.robots.kinematic_tree import KinematicTree, body_poses
from envs.robots.part_distances import next_farther
from envs.seeding import stream

_SAMPLES = 2048
"""Configurations in which links are in contact if they may be."""

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
    q = _random_configurations(tree)
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


def _random_configurations(tree: KinematicTree) -> Array:
    return tree.space.sample(stream("self collision"), _SAMPLES)


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
    farthest, n = 0.0, -1
    while farthest < FAR:
        n, apart = next_farther(tree.arrays, bodies, shapes, *pair, q, n + 1, farthest, FAR)
        if n == len(q):
            return farthest
        if not _is_one_within(tree, bodies, placed, pair, q[n]):
            farthest = apart
    return FAR


def _is_one_within(
    tree: KinematicTree,
    bodies: NDArray[np.int64],
    placed: Sequence[PlacedShape],
    pair: tuple[int, int],
    q: Array,
) -> bool:
    """Whether one of two parts is within the other, which is a mesh, at a configuration (d,) where
    they do not touch."""
    if not any(isinstance(placed[part].solid, Mesh) for part in pair):
        return False
    poses = np.empty((1 + len(tree.joints), 3, 4))
    body_poses(tree.arrays, q, poses)
    for outer, inner in (pair, pair[::-1]):
        pose = poses[bodies[inner]]
        points = placed[inner].piece_points() @ pose[:, :3].T + pose[:, 3]
        if _encloses(placed[outer], poses[bodies[outer]], points):
            return True
    return False


def _encloses(placed: PlacedShape, pose: Array, points: Array) -> bool:
    """Whether a part is a mesh that has one of some points (k, 3) within, its body at a pose
    (3, 4)."""
    mesh = placed.solid
    if not isinstance(mesh, Mesh):
        return False
    local = (points - pose[:, 3]) @ pose[:, :3]
    local = (local - placed.pose[:3, 3]) @ placed.pose[:3, :3]
    # What is beside its vertices is outside; so is nearly all that is asked.
    low, high = mesh.bounds
    local = local[((local >= low) & (local <= high)).all(axis=1)]
    return len(local) > 0 and bool(queries(mesh).is_inside(local).any())


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
