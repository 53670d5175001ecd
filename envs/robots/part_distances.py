"""Distances of a tree's parts from each other, compiled, as far as a question needs them: where
parts come farther apart than so far, and whether they keep apart what they should.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.gjk import moved
from envs.collision.mesh_distance import nearest_triangles, triangles_apart
from envs.collision.separation import pose_between, separation
from envs.collision.shapes import ROW
from envs.compiled import njit_cached
from envs.robots.kinematic_tree import body_poses

_ROUNDING = 1e-6
"""By how much a distance may be found too short, in metres, or of it where it is over a metre; see
`envs.collision.separation`."""

_TOUCHING = 1e-9
"""Up to which distance it is asked, in metres, where only contact counts."""


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
    `least` of the other, long before their distance is known: of two meshes it is often the same
    two triangles as at the one before.

    Args:
        tree: `KinematicTree.arrays`.
        bodies: (p,) in which the shapes are placed.
        shapes: see `envs.collision.separation`.
        i, j: the numbers of the two.
        q: configurations (n, d).
    """
    poses = np.empty((1 + len(tree.parents), 3, 4))
    row, other, near = np.empty(ROW), np.empty(ROW), np.full(2, -1)
    are_meshes = shapes.roots[i] >= 0 and shapes.roots[j] >= 0
    for n in range(begin, len(q)):
        body_poses(tree, q[n], poses)
        pose, there = poses[bodies[i]], poses[bodies[j]]
        if are_meshes and _meshes_are_within(shapes, i, pose, j, there, least, near):
            continue
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
    found, order = np.ones(len(q), dtype=np.bool_), np.arange(len(pairs))
    for n in range(len(q)):
        body_poses(tree, q[n], poses)
        for part in range(len(bodies)):
            moved(shapes.rows[part], poses[bodies[part]], rows[part])
        for place in range(len(pairs)):
            i, j = pairs[order[place], 0], pairs[order[place], 1]
            pose, there, most = poses[bodies[i]], poses[bodies[j]], kept[i, j]
            apart = separation(shapes, i, rows[i], pose, shapes, j, rows[j], there, most)
            if not apart >= most:
                found[n] = False
                # The next configuration is asked of this pair first: few are often too near.
                order[0], order[place] = order[place], order[0]
                break
    return found


@njit_cached
def _meshes_are_within(
    shapes: Any, i: int, pose: Any, j: int, there: Any, reach: float, near: Any
) -> bool:
    """Whether two meshes are no farther apart than `reach`, given the poses of the frames that they
    are placed in. If so, `near` (2,) has the leaves of two triangles that are so near, which are
    asked first when it has some."""
    trees, between = shapes.trees, np.empty((3, 4))
    pose_between(shapes, i, pose, shapes, j, there, between)
    if near[0] >= 0 and triangles_apart(trees, near[0], trees, near[1], between) <= reach:
        return True
    # Ends at the first triangles that are no farther; asked a little beyond to see the others.
    found, leaf, other_leaf = nearest_triangles(
        trees, shapes.roots[i], trees, shapes.roots[j], between, reach + _ROUNDING, reach
    )
    if found > reach:
        return False
    near[0], near[1] = leaf, other_leaf
    return True


@njit_cached
def _is_within(
    shapes: Any, i: int, row: Any, pose: Any, j: int, other: Any, there: Any, reach: float
) -> bool:
    """Whether two shapes, one of which is a mesh, are proved to be no farther apart than `reach`,
    given their rows and the poses of the frames that they are placed in."""
    if (shapes.roots[i] < 0) == (shapes.roots[j] < 0):
        return False  # of solids the distance itself takes no longer, of meshes it is known
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
