"""Distances of a tree's parts from each other, compiled, as far as a question needs them: where
parts come farther apart than so far, and whether they keep apart what they should.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.gjk import compose, moved
from envs.collision.mesh_distance import _node_to_node, _take_triangle
from envs.collision.separation import _undo, separation
from envs.collision.shapes import ROW
from envs.collision.triangles import triangle_to_triangle
from envs.compiled import njit_cached
from envs.robots.kinematic_tree import body_poses

_ROUNDING = 1e-6
"""By how much a distance may be found too short, in metres, or of it where it is over a metre; see
`envs.collision.separation`."""

_TOUCHING = 1e-9
"""Up to which distance it is asked, in metres, where only contact counts."""

_DEEPEST = 128
"""Pairs of nodes that wait at most: halving leaves fewer than 2^32 triangles one each in 32 steps,
in each of two trees."""


@njit_cached
def next_farther(
    tree: Any,
    bodies: Any,
    shapes: Any,
    i: int,
    j: int,
    q: Any,
    begin: int,
    least: float,
    most: float,
) -> tuple[int, float]:
    """The first configuration, from number `begin` on, at which two shapes are farther apart than
    `least`: its number and their `separation`, asked up to `most`. If there is none, the number of
    configurations, and `least`.

    Most configurations are passed over as soon as something of the one shape is seen to be within
    `least` of the other, long before their distance is known.

    Args:
        tree: `KinematicTree.arrays`.
        bodies: (p,) in which the shapes are placed.
        shapes: see `envs.collision.separation`.
        i, j: the numbers of the two.
        q: configurations (n, d).
    """
    poses = np.empty((1 + len(tree.parents), 3, 4))
    row, other = np.empty(ROW), np.empty(ROW)
    for n in range(begin, len(q)):
        body_poses(tree, q[n], poses)
        pose, there = poses[bodies[i]], poses[bodies[j]]
        moved(shapes.rows[i], pose, row)
        moved(shapes.rows[j], there, other)
        if least > 0.0 and _is_within(shapes, i, row, pose, j, other, there, least):
            continue
        apart = separation(shapes, i, row, pose, shapes, j, other, there, most)
        if apart > least:
            return n, apart
    return len(q), least


@njit_cached
def keep_apart(tree: Any, bodies: Any, shapes: Any, pairs: Any, kept: Any, q: Any) -> Any:
    """Whether the shapes of each of some pairs, rows of which the first two numbers name them, are
    as far apart as they should keep, (p, p), at configurations (n, d), (n,) of bool."""
    poses, rows = np.empty((1 + len(tree.parents), 3, 4)), np.empty((len(bodies), ROW))
    found = np.ones(len(q), dtype=np.bool_)
    for n in range(len(q)):
        body_poses(tree, q[n], poses)
        for part in range(len(bodies)):
            moved(shapes.rows[part], poses[bodies[part]], rows[part])
        for pair in range(len(pairs)):
            i, j = pairs[pair, 0], pairs[pair, 1]
            pose, there, most = poses[bodies[i]], poses[bodies[j]], kept[i, j]
            apart = separation(shapes, i, rows[i], pose, shapes, j, rows[j], there, most)
            if not apart >= most:
                found[n] = False
                break
    return found


@njit_cached
def _is_within(
    shapes: Any, i: int, row: Any, pose: Any, j: int, other: Any, there: Any, reach: float
) -> bool:
    """Whether two shapes are proved to be no farther apart than `reach`, given their rows and the
    poses of the frames that they are placed in."""
    if shapes.roots[i] >= 0 and shapes.roots[j] >= 0:
        placed, inverse, between = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
        compose(pose, shapes.poses[i], placed)
        _undo(placed, inverse)
        compose(there, shapes.poses[j], placed)
        compose(inverse, placed, between)
        return _are_meshes_within(shapes.trees, shapes.roots[i], shapes.roots[j], between, reach)
    if shapes.roots[i] < 0 and shapes.roots[j] < 0:
        return False  # the distance itself takes no longer
    # A solid that is larger by the reach all around touches the mesh.
    more = reach - _ROUNDING * max(1.0, reach)
    if more <= 0.0:
        return False
    larger = row.copy() if shapes.roots[i] < 0 else other.copy()
    larger[15] += more
    larger[17] += more
    if shapes.roots[i] < 0:
        row = larger
    else:
        other = larger
    return bool(separation(shapes, i, row, pose, shapes, j, other, there, _TOUCHING) == 0.0)


@njit_cached
def _are_meshes_within(trees: Any, root: int, other_root: int, pose: Any, reach: float) -> bool:
    """Whether some triangles of two meshes are no farther apart than `reach`, the other mesh at a
    pose (3, 4) in the frame of the first. Ends at the first such."""
    triangle, other_triangle, there = np.zeros(ROW), np.zeros(ROW), np.zeros(ROW)
    nodes = np.empty((_DEEPEST, 2), dtype=np.int64)
    nodes[0, 0], nodes[0, 1], waiting = root, other_root, 1
    while waiting:
        waiting -= 1
        a, b = nodes[waiting, 0], nodes[waiting, 1]
        if trees.child[a] < 0 and trees.child[b] < 0:
            _take_triangle(trees, a, triangle)
            _take_triangle(trees, b, other_triangle)
            moved(other_triangle, pose, there)
            if triangle_to_triangle(triangle, there) <= reach:
                return True
            continue
        a1, b1, a2, b2 = a, b, a, b
        if trees.child[b] < 0 or (trees.child[a] >= 0 and trees.radii[a] > trees.radii[b]):
            a1, a2 = trees.child[a], trees.child[a] + 1
        else:
            b1, b2 = trees.child[b], trees.child[b] + 1
        one = _node_to_node(trees, a1, trees, b1, pose, reach)
        two = _node_to_node(trees, a2, trees, b2, pose, reach)
        if one < two:  # the nearer two last, which are the next that are looked at
            a1, b1, a2, b2, one, two = a2, b2, a1, b1, two, one
        for a, b, apart in ((a1, b1, one), (a2, b2, two)):
            if apart <= reach:
                nodes[waiting, 0], nodes[waiting, 1] = a, b
                waiting += 1
    return False
