"""Distances of the same two meshes in one pose after another, compiled.

A search for the distance (`mesh_distance`) ends at pairs of nodes that cannot be nearer than what
it found. A moment later, when the meshes have hardly moved, it would end at nearly the same ones.
So they are kept, with what they keep apart at least; where that, less what they have been moved
since, is still enough they are passed over, and the others are asked again, and parted where need
be (Ehmann and Lin, "Accurate and Fast Proximity Queries Between Polyhedra Using Convex Surface
Decomposition", Eurographics 2001, call them a front). Two triangles that were apart along some way
are mostly apart along the same way still, which takes a tenth of the time of their distance.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import at, moved
from envs.collision.mesh_distance import node_to_node
from envs.collision.point_to_mesh import take_triangle
from envs.collision.shapes import ROW
from envs.collision.triangles import gap_along, lowered, nearest_of_triangles
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array

_MOST = 1 << 14
"""Pairs of nodes of a front."""

_LARGER = 2
"""How many times as many pairs as at first a front may have before it begins anew: pairs that were
parted are never joined again."""

_OF_POSES = 1e-12
"""By how much something may be moved farther than computed, in workspace units."""

_ANEW = -1.0

NO_FRONT = -(1 << 40)
"""In place of a number, where none is left."""


class Fronts(NamedTuple):
    """Of pairs of meshes, f of them, each of n pairs of nodes at most.

    Attributes:
        roots: (f, 2) of the two meshes' trees.
        nodes: (f, n, 2) pairs of nodes of these.
        levels: (f, n) what each pair keeps apart at least, and all that the second node had been
            moved by then.
        reaches: (f, n) how far the second node reaches from the middle of its mesh.
        ways: (f, n, 3) along which two triangles were apart, in the frame of the first; 0 if none.
        sizes: (f, 3) numbers of pairs; which has the nearest triangles, -1 if none; and how many
            there were at first.
        moves: (f, 2) how far the middle of the second mesh has been shifted as seen from the first,
            and by what it has been turned, all in all.
        poses: (f, 3, 4) of the second mesh in the frame of the first, as it was last.
        rows: (3, ROW), room for triangles.
        taken: (1,) how many are in use.
    """

    roots: NDArray[np.int64]
    nodes: NDArray[np.int64]
    levels: Array
    reaches: Array
    ways: Array
    sizes: NDArray[np.int64]
    moves: Array
    poses: Array
    rows: Array
    taken: NDArray[np.int64]


@njit_cached
def fronts_for(count: int) -> Any:
    """Room for some."""
    return Fronts(
        np.empty((count, 2), dtype=np.int64),
        np.empty((count, _MOST, 2), dtype=np.int64),
        np.empty((count, _MOST)),
        np.empty((count, _MOST)),
        np.empty((count, _MOST, 3)),
        np.zeros((count, 3), dtype=np.int64),
        np.zeros((count, 2)),
        np.zeros((count, 3, 4)),
        np.zeros((3, ROW)),
        np.zeros(1, dtype=np.int64),
    )


@njit_hot
def take_front(fronts: Any, root: int, other_root: int) -> int:
    """The number of a front for two meshes, by the roots of their trees: best the smaller one
    second, as what counts is how far it is moved. If none is left, `NO_FRONT`."""
    f = fronts.taken[0]
    if f == len(fronts.roots):
        return NO_FRONT
    fronts.taken[0] += 1
    fronts.roots[f, 0], fronts.roots[f, 1] = root, other_root
    return int(f)


@njit_hot
def _restart(fronts: Any, f: int) -> None:
    fronts.nodes[f, 0, 0], fronts.nodes[f, 0, 1] = fronts.roots[f, 0], fronts.roots[f, 1]
    fronts.levels[f, 0], fronts.reaches[f, 0] = -math.inf, 0.0
    fronts.sizes[f, 0], fronts.sizes[f, 1], fronts.sizes[f, 2] = 1, -1, 0


@njit_hot
def distance_by_front(trees: Any, fronts: Any, f: int, pose: Any, most: float) -> float:
    """As `mesh_to_mesh` of the two meshes of a front, the second one at a pose (3, 4) in the frame
    of the first; negative where the front has no room for what it would take."""
    sizes = fronts.sizes[f]
    if sizes[0] == 0 or (sizes[2] > 0 and sizes[0] > _LARGER * sizes[2]):
        _restart(fronts, f)
    _move(trees, fronts, f, pose)
    nodes, levels, reaches, rows = fronts.nodes[f], fronts.levels[f], fronts.reaches[f], fronts.rows
    shift, turn = fronts.moves[f, 0], fronts.moves[f, 1]
    least, n = most, 0
    best = sizes[1]
    if best >= 0:  # a good guess, which spares most others
        _place(trees, nodes[best, 0], nodes[best, 1], pose, rows)
        found = _exact(fronts, f, best)
        levels[best] = found + shift + turn * reaches[best]
        least = min(least, found)
    while n < sizes[0] and least > 0.0:
        moved_by = shift + turn * reaches[n]
        if levels[n] - moved_by >= least or n == best:
            n += 1
            continue
        a, b = nodes[n, 0], nodes[n, 1]
        is_leaf, is_other_leaf = trees.child[a] < 0, trees.child[b] < 0
        if is_leaf and is_other_leaf:
            found = _leaves_apart(trees, fronts, f, n, pose, least)
            if found < least:
                least, sizes[1] = found, n
        else:
            found = node_to_node(trees, a, trees, b, pose, least)
        if found >= least or (is_leaf and is_other_leaf):
            levels[n] = found + moved_by
            n += 1
            continue
        if sizes[0] == _MOST:
            sizes[0] = 0
            return _ANEW
        _part(
            trees, fronts, f, n, is_other_leaf or (not is_leaf and trees.radii[a] > trees.radii[b])
        )
    if sizes[2] == 0:
        sizes[2] = sizes[0]
    return least


@njit_hot
def _move(trees: Any, fronts: Any, f: int, pose: Any) -> None:
    """Takes note of where the second mesh is now, and of how far it has been moved."""
    before, middle = fronts.poses[f], trees.middles[fronts.roots[f, 1]]
    x, y, z = at(pose, middle)
    u, v, w = at(before, middle)
    turned = 0.0
    for i in range(3):
        for j in range(3):
            turned += (pose[i, j] - before[i, j]) ** 2
        for j in range(4):
            before[i, j] = pose[i, j]
    shift = math.sqrt((x - u) ** 2 + (y - v) ** 2 + (z - w) ** 2)
    fronts.moves[f, 0] += shift + _OF_POSES
    # Two rotations differ by a matrix whose two singular values that are not 0 are equal.
    fronts.moves[f, 1] += math.sqrt(turned / 2)


@njit_hot
def _part(trees: Any, fronts: Any, f: int, n: int, parts_first: bool) -> None:
    """Puts two pairs in the place of one, of which either node is parted."""
    nodes, levels, sizes = fronts.nodes[f], fronts.levels[f], fronts.sizes[f]
    a, b, last = nodes[n, 0], nodes[n, 1], sizes[0]
    a1, b1, a2, b2 = a, b, a, b
    if parts_first:
        a1, a2 = trees.child[a], trees.child[a] + 1
    else:
        b1, b2 = trees.child[b], trees.child[b] + 1
    nodes[n, 0], nodes[n, 1], nodes[last, 0], nodes[last, 1] = a1, b1, a2, b2
    for k, node in ((n, b1), (last, b2)):
        levels[k] = -math.inf
        fronts.reaches[f, k] = _reach(trees, fronts.roots[f, 1], node)
        for i in range(3):
            fronts.ways[f, k, i] = 0.0
    sizes[0] += 1


@njit_hot
def _reach(trees: Any, root: int, node: int) -> float:
    """How far a node reaches from the middle of its mesh."""
    squared = 0.0
    for i in range(3):
        squared += (trees.middles[node, i] - trees.middles[root, i]) ** 2
    return math.sqrt(squared) + float(trees.radii[node])


@njit_hot
def _place(trees: Any, leaf: int, other_leaf: int, pose: Any, rows: Any) -> None:
    """Writes the rows of two leaves' triangles, in the frame of the first mesh."""
    take_triangle(trees, leaf, rows[0])
    take_triangle(trees, other_leaf, rows[2])
    moved(rows[2], pose, rows[1])


@njit_hot
def _exact(fronts: Any, f: int, n: int) -> float:
    """The distance of two triangles that are in their places; along which way is noted."""
    squared, x, y, z = nearest_of_triangles(fronts.rows[0], fronts.rows[1])
    way = fronts.ways[f, n]
    way[0], way[1], way[2] = x, y, z
    return float(lowered(squared))


@njit_hot
def _leaves_apart(trees: Any, fronts: Any, f: int, n: int, pose: Any, most: float) -> float:
    """The distance of the triangles of a pair of leaves, or something that is at least `most`."""
    leaf, other_leaf = fronts.nodes[f, n, 0], fronts.nodes[f, n, 1]
    way = fronts.ways[f, n]
    x, y, z = way[0], way[1], way[2]
    is_new = x == 0.0 and y == 0.0 and z == 0.0
    if is_new:
        found = node_to_node(trees, leaf, trees, other_leaf, pose, most)
        if found >= most:
            return float(found)
    _place(trees, leaf, other_leaf, pose, fronts.rows)
    if not is_new:
        gap = max(gap_along(fronts.rows[0], fronts.rows[1], x, y, z), 0.0)
        found = lowered(gap * gap)
        if found >= most:
            return float(found)
    return _exact(fronts, f, n)
