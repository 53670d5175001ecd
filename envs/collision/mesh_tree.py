"""Distances from triangle meshes in compiled code, never above the truth.

A tree of balls and boxes about ever fewer triangles leads to those that may be nearest. How far
these are is found in closed form (`triangles`), or is the distance between convex solids
(`convex`); both err to the safe side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numba
import numpy as np
from numpy.typing import NDArray

from envs.collision.convex import distance, moved
from envs.collision.primitives import CYLINDER, SPHERE, TRIANGLE, to_solid
from envs.collision.shapes import Mesh
from envs.collision.triangles import point_to_triangle, triangle_to_triangle
from envs.kernels import kernel
from envs.problem import Array


class Trees(NamedTuple):
    """Meshes as compiled code sees them, one after another; each in a frame of its own.

    Attributes:
        middles, halves: (k, 3) of a box that holds a node's triangles, its sides along
        axes: (k, 3, 3), in rows: the triangles' principal ones.
        radii: (k,) of a ball about the middle that holds them.
        child: (k,) the first of two children, after which comes the other; of a leaf, -1 less the
            number of its only triangle.
        triangles: (m, 9) corners from the middle of their leaf, one after another.
    """

    middles: Array
    halves: Array
    axes: Array
    radii: Array
    child: NDArray[np.int64]
    triangles: Array


def trees_of(meshes: Sequence[Mesh]) -> tuple[Trees, NDArray[np.int64]]:
    """Trees of meshes, and the first node of each (n,)."""
    each = [_tree_of(mesh) for mesh in meshes]
    if len(each) == 1:  # as it is: a large one need not be there twice
        return each[0], np.zeros(1, dtype=np.int64)
    nodes = np.cumsum([0, *(len(tree.radii) for tree in each)])
    faces = np.cumsum([0, *(len(tree.triangles) for tree in each)])
    children = [
        np.where(tree.child < 0, tree.child - face, tree.child + node)
        for tree, node, face in zip(each, nodes, faces, strict=False)
    ]
    whole = [tree._replace(child=child) for tree, child in zip(each, children, strict=True)]
    return Trees(*map(np.concatenate, zip(_NONE, *whole, strict=True))), nodes[:-1]


_NONE = Trees(
    *(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)),
    *(np.zeros(0, dtype=np.int64), np.zeros((0, 9))),
)

_known: WeakKeyDictionary[Mesh, Trees] = WeakKeyDictionary()


_jit = numba.njit(cache=True, nogil=True)


def _tree_of(mesh: Mesh) -> Trees:
    """Made once for as long as there is the mesh."""
    if mesh not in _known:
        _known[mesh] = _grown(mesh.vertices[mesh.faces])
    return _known[mesh]


def _grown(corners: Array) -> Trees:
    """The tree of triangles (m, 3, 3), level by level: each node's are halved along the axis along
    which they are farthest apart."""
    triangles = np.empty((len(corners), 9))
    levels = []
    order, sizes, nodes = np.arange(len(corners)), np.array([len(corners)]), 0
    while len(sizes):
        middles, halves, axes, radii = _bounds(corners, order, sizes)
        nodes += len(sizes)
        ends = np.cumsum(sizes)
        inner = sizes > 1
        child = nodes + 2 * (np.cumsum(inner) - 1)
        leaves = order[ends[~inner] - 1]
        child[~inner] = -1 - leaves
        triangles[leaves] = (corners[leaves] - middles[~inner][:, None]).reshape(-1, 9)
        levels.append((middles, halves, axes, radii, child))
        owner = np.repeat(np.arange(len(sizes)), sizes)
        along = np.einsum("nki,ni->n", corners[order], axes[owner, 2])
        order = order[np.lexsort((along, owner))][inner[owner]]
        first = sizes[inner] // 2
        sizes = np.stack([first, sizes[inner] - first], axis=1).ravel()
    middles, halves, axes, radii, child = map(np.concatenate, zip(*levels, strict=True))
    return Trees(middles, halves, axes, radii, child, triangles)


def _bounds(
    corners: Array, order: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[Array, Array, Array, Array]:
    """Middles, halves, axes and radii, see `Trees`, of nodes that hold so many (k,) of some
    triangles (n, 3, 3), one node after another in an order (m,)."""
    means, spreads = _moments(corners, order, sizes)
    axes = np.ascontiguousarray(np.swapaxes(np.linalg.eigh(spreads)[1], 1, 2))
    middles, halves, radii = _boxes(corners, order, sizes, means, axes)
    more = _ROUNDING * np.abs(corners).max()
    return middles, halves + more, axes, radii + more


@_jit
def _moments(corners: Any, order: Any, sizes: Any) -> tuple[Array, Array]:
    """The mean (k, 3) of each node's corners, and the sums (k, 3, 3) of products of what they are
    off it."""
    means, spreads = np.zeros((len(sizes), 3)), np.zeros((len(sizes), 3, 3))
    off = np.empty(3)
    begin = 0
    for node in range(len(sizes)):
        end = begin + sizes[node]
        for at in range(begin, end):
            for corner in range(3):
                for i in range(3):
                    means[node, i] += corners[order[at], corner, i]
        means[node] /= 3 * sizes[node]
        for at in range(begin, end):
            for corner in range(3):
                for i in range(3):
                    off[i] = corners[order[at], corner, i] - means[node, i]
                for i in range(3):
                    for j in range(3):
                        spreads[node, i, j] += off[i] * off[j]
        begin = end
    return means, spreads


@_jit
def _boxes(
    corners: Any, order: Any, sizes: Any, means: Any, axes: Any
) -> tuple[Array, Array, Array]:
    """The middle (k, 3) and the halves (k, 3) of the box along each node's axes about its corners,
    and the radius (k,) of the ball about that middle."""
    middles, halves, radii = np.empty_like(means), np.empty_like(means), np.zeros(len(sizes))
    off, low, high = np.empty(3), np.empty(3), np.empty(3)
    begin = 0
    for node in range(len(sizes)):
        end = begin + sizes[node]
        low[:], high[:] = np.inf, -np.inf
        for at in range(begin, end):
            for corner in range(3):
                for i in range(3):
                    off[i] = corners[order[at], corner, i] - means[node, i]
                for j in range(3):
                    along = axes[node, j, 0] * off[0] + axes[node, j, 1] * off[1]
                    along += axes[node, j, 2] * off[2]
                    low[j], high[j] = min(low[j], along), max(high[j], along)
        halves[node] = (high - low) / 2
        for i in range(3):
            middles[node, i] = means[node, i]
            for j in range(3):
                middles[node, i] += (low[j] + high[j]) / 2 * axes[node, j, i]
        for at in range(begin, end):
            for corner in range(3):
                squared = 0.0
                for i in range(3):
                    squared += (corners[order[at], corner, i] - middles[node, i]) ** 2
                radii[node] = max(radii[node], squared)
        radii[node] = np.sqrt(radii[node])
        begin = end
    return middles, halves, radii


_ROUNDING = 1e-12
"""By how much boxes and balls are greater than computed, by the size of the mesh's numbers."""

_DEEPEST = 64
"""Nodes that wait at most: halving leaves fewer than 2^32 triangles one each in 32 steps."""


@_jit
def solid_to_mesh(trees: Any, root: int, row: Any, most: float) -> float:
    """A lower bound of the distance between a solid, a row (17,) of `SceneView.solids` in the
    mesh's frame, and the surface of the mesh at a root; or `most`, if it is no less.

    As near to the distance as `convex.distance`.
    """
    solid = row.reshape((1, 17))
    triangle = np.zeros(17)
    nodes, bounds = np.empty(_DEEPEST, dtype=np.int64), np.empty(_DEEPEST)
    nodes[0], bounds[0] = root, _solid_to_node(trees, root, solid)
    waiting, least = 1, most
    while waiting and least > 0.0:
        waiting -= 1
        if bounds[waiting] >= least:
            continue
        node = nodes[waiting]
        first = trees.child[node]
        if first < 0:
            _take_triangle(trees, node, triangle)
            least = min(least, _solid_to_triangle(triangle, row, least))
            continue
        second = first + 1
        to_first = _solid_to_node(trees, first, solid)
        to_second = _solid_to_node(trees, second, solid)
        if to_first < to_second:  # the nearer one last, which is the next that is looked at
            first, second, to_first, to_second = second, first, to_second, to_first
        nodes[waiting], bounds[waiting] = first, to_first
        nodes[waiting + 1], bounds[waiting + 1] = second, to_second
        waiting += 2
    return float(max(least, 0.0))


@_jit
def _solid_to_triangle(triangle: Any, row: Any, most: float) -> float:
    if row[16] == SPHERE:
        return float(point_to_triangle(triangle, row[9], row[10], row[11]) - row[12])
    return float(distance(triangle, row, most))


@kernel
def _solid_to_node(trees: Any, node: int, solid: Any) -> float:
    """The greater of what a node's ball and its box keep from a solid (1, 17) at least."""
    middle, axes = trees.middles[node], trees.axes[node]
    by_ball: float = to_solid(solid, 0, middle[0], middle[1], middle[2]) - trees.radii[node]
    x, y, z = solid[0, 9] - middle[0], solid[0, 10] - middle[1], solid[0, 11] - middle[2]
    squared = 0.0
    for i in range(3):
        along = axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z
        gap = abs(along) - trees.halves[node, i] - _reach(solid, axes[i])
        if gap > 0.0:
            squared += gap * gap
    return float(max(by_ball, math.sqrt(squared)))


@kernel
def _reach(solid: Any, axis: Any) -> float:
    """How far a solid (1, 17) reaches from its centre along an axis (3,)."""
    if solid[0, 16] == SPHERE:
        return float(solid[0, 12])
    along = axis[0] * solid[0, 6] + axis[1] * solid[0, 7] + axis[2] * solid[0, 8]
    if solid[0, 16] == CYLINDER:
        aside = math.sqrt(max(1.0 - along * along, 0.0))
        return float(solid[0, 12] * aside + solid[0, 13] * abs(along))
    p = axis[0] * solid[0, 0] + axis[1] * solid[0, 1] + axis[2] * solid[0, 2]
    q = axis[0] * solid[0, 3] + axis[1] * solid[0, 4] + axis[2] * solid[0, 5]
    return float(abs(p) * solid[0, 12] + abs(q) * solid[0, 13] + abs(along) * solid[0, 14])


@kernel
def _take_triangle(trees: Any, leaf: int, row: Any) -> None:
    """Writes the row (17,) of a leaf's triangle, in the mesh's frame."""
    for k in range(9):
        row[k] = trees.triangles[-1 - trees.child[leaf], k]
    for i in range(3):
        row[9 + i] = trees.middles[leaf, i]
    row[15], row[16] = trees.radii[leaf], TRIANGLE


@_jit
def mesh_to_mesh(
    trees: Any, root: int, others: Any, other_root: int, pose: Any, most: float
) -> float:
    """A lower bound of the distance between the surfaces of two meshes, the other one at a pose
    (3, 4) in the frame of the first; or `most`, if it is no less. See `solid_to_mesh`."""
    triangle, other_triangle, there = np.zeros(17), np.zeros(17), np.zeros(17)
    nodes = np.empty((2 * _DEEPEST, 2), dtype=np.int64)
    bounds = np.empty(2 * _DEEPEST)
    nodes[0, 0], nodes[0, 1] = root, other_root
    bounds[0] = _node_to_node(trees, root, others, other_root, pose, most)
    waiting, least = 1, most
    while waiting and least > 0.0:
        waiting -= 1
        if bounds[waiting] >= least:
            continue
        a, b = nodes[waiting, 0], nodes[waiting, 1]
        if trees.child[a] < 0 and others.child[b] < 0:
            _take_triangle(trees, a, triangle)
            _take_triangle(others, b, other_triangle)
            moved(other_triangle, pose, there)
            least = min(least, triangle_to_triangle(triangle, there))
            continue
        splits_a = others.child[b] < 0 or (trees.child[a] >= 0 and trees.radii[a] > others.radii[b])
        a1, b1, a2, b2 = a, b, a, b
        if splits_a:
            a1, a2 = trees.child[a], trees.child[a] + 1
        else:
            b1, b2 = others.child[b], others.child[b] + 1
        one = _node_to_node(trees, a1, others, b1, pose, least)
        two = _node_to_node(trees, a2, others, b2, pose, least)
        if one < two:
            a1, b1, a2, b2, one, two = a2, b2, a1, b1, two, one
        if one < least:
            nodes[waiting, 0], nodes[waiting, 1], bounds[waiting] = a1, b1, one
            waiting += 1
        if two < least:
            nodes[waiting, 0], nodes[waiting, 1], bounds[waiting] = a2, b2, two
            waiting += 1
    return least


@kernel
def _node_to_node(trees: Any, a: int, others: Any, b: int, pose: Any, most: float) -> float:
    """What two nodes keep from each other at least: what their boxes keep along the line through
    their middles, and where that is less than `most`, along the axes of either."""
    middle, other = trees.middles[a], others.middles[b]
    x = pose[0, 0] * other[0] + pose[0, 1] * other[1] + pose[0, 2] * other[2] + pose[0, 3]
    y = pose[1, 0] * other[0] + pose[1, 1] * other[1] + pose[1, 2] * other[2] + pose[1, 3]
    z = pose[2, 0] * other[0] + pose[2, 1] * other[1] + pose[2, 2] * other[2] + pose[2, 3]
    x, y, z = x - middle[0], y - middle[1], z - middle[2]
    length = math.sqrt(x * x + y * y + z * z)
    apart: float = length - trees.radii[a] - others.radii[b]
    if apart >= most:
        return apart
    # The way between the middles along the axes of either, and half the sides of their boxes.
    axes, half = trees.axes[a], trees.halves[a]
    a0 = abs(axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z)
    a1 = abs(axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z)
    a2 = abs(axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z)
    u = pose[0, 0] * x + pose[1, 0] * y + pose[2, 0] * z
    v = pose[0, 1] * x + pose[1, 1] * y + pose[2, 1] * z
    w = pose[0, 2] * x + pose[1, 2] * y + pose[2, 2] * z
    other_axes, other_half = others.axes[b], others.halves[b]
    b0 = abs(other_axes[0, 0] * u + other_axes[0, 1] * v + other_axes[0, 2] * w)
    b1 = abs(other_axes[1, 0] * u + other_axes[1, 1] * v + other_axes[1, 2] * w)
    b2 = abs(other_axes[2, 0] * u + other_axes[2, 1] * v + other_axes[2, 2] * w)
    if length > 0.0:
        reach = half[0] * a0 + half[1] * a1 + half[2] * a2
        reach += other_half[0] * b0 + other_half[1] * b1 + other_half[2] * b2
        apart = max(apart, length - reach / length)
        if apart >= most:
            return apart
    a0, a1, a2 = a0 - half[0], a1 - half[1], a2 - half[2]
    there = 0.0
    for j in range(3):
        u, v, w = other_axes[j, 0], other_axes[j, 1], other_axes[j, 2]
        x = pose[0, 0] * u + pose[0, 1] * v + pose[0, 2] * w
        y = pose[1, 0] * u + pose[1, 1] * v + pose[1, 2] * w
        z = pose[2, 0] * u + pose[2, 1] * v + pose[2, 2] * w
        c0 = abs(axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z)
        c1 = abs(axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z)
        c2 = abs(axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z)
        size = other_half[j]
        a0, a1, a2 = a0 - c0 * size, a1 - c1 * size, a2 - c2 * size
        gap = (b0 if j == 0 else b1 if j == 1 else b2) - size
        gap -= c0 * half[0] + c1 * half[1] + c2 * half[2]
        there += max(gap, 0.0) ** 2
    here = max(a0, 0.0) ** 2 + max(a1, 0.0) ** 2 + max(a2, 0.0) ** 2
    return max(apart, math.sqrt(max(here, there)))
