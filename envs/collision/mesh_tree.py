"""Trees of balls and boxes about ever fewer triangles of a mesh, by which those are found that may
be nearest to something (see `mesh_distance`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Mesh
from envs.compiled import njit_cached, parallel_for
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
    """Trees of meshes, and the first node of each (n,). Equal ones share a tree."""
    numbers = {mesh: number for number, mesh in enumerate(dict.fromkeys(meshes))}
    _grow([mesh for mesh in numbers if mesh not in _known])
    each, places = [_known[mesh] for mesh in numbers], [numbers[mesh] for mesh in meshes]
    if len(each) == 1:  # as it is: a large one need not be there twice
        return each[0], np.zeros(len(meshes), dtype=np.int64)
    nodes = np.cumsum([0, *(len(tree.radii) for tree in each)])
    faces = np.cumsum([0, *(len(tree.triangles) for tree in each)])
    children = [
        np.where(tree.child < 0, tree.child - face, tree.child + node)
        for tree, node, face in zip(each, nodes, faces, strict=False)
    ]
    whole = [tree._replace(child=child) for tree, child in zip(each, children, strict=True)]
    joined = Trees(*map(np.concatenate, zip(_NONE, *whole, strict=True)))
    return joined, nodes[np.array(places, dtype=np.int64)]


_NONE = Trees(
    *(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)),
    *(np.zeros(0, dtype=np.int64), np.zeros((0, 9))),
)

_FEW = 32
"""Triangles of a node that are sorted by insertion, which takes no longer."""

_known: WeakKeyDictionary[Mesh, Trees] = WeakKeyDictionary()


def _grow(meshes: Sequence[Mesh]) -> None:
    """Makes the trees of meshes, each once for as long as there is the mesh, on as many threads as
    Numba may use."""

    def some(part: slice) -> None:
        for mesh in meshes[part]:
            _known[mesh] = _grown(mesh.vertices[mesh.faces])

    parallel_for(some, len(meshes), 1)


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
        order, sizes, longest = order[np.repeat(inner, sizes)], sizes[inner], axes[inner, 2]
        along = np.einsum("nki,ni->n", corners[order], np.repeat(longest, sizes, axis=0))
        _sort_each(order, along, sizes)
        first = sizes // 2
        sizes = np.stack([first, sizes - first], axis=1).ravel()
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


@njit_cached
def _sort_each(order: Any, along: Any, sizes: Any) -> None:
    """Sorts an order (m,) by numbers (m,) within each node; those that are alike stay as they
    are."""
    begin = 0
    for size in sizes:
        end = begin + size
        if size > _FEW:
            places = np.argsort(along[begin:end], kind="mergesort")
            order[begin:end] = order[begin:end][places]
        else:
            for n in range(begin + 1, end):
                number, key, at = order[n], along[n], n
                while at > begin and along[at - 1] > key:
                    order[at], along[at] = order[at - 1], along[at - 1]
                    at -= 1
                order[at], along[at] = number, key
        begin = end


@njit_cached
def _moments(corners: Any, order: Any, sizes: Any) -> tuple[Array, Array]:
    """The mean (k, 3) of each node's corners, and the sums (k, 3, 3) of products of what they are
    off it."""
    # The means first: products of numbers far from 0 would lose the digits in which corners differ.
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


@njit_cached
def _boxes(
    corners: Any, order: Any, sizes: Any, means: Any, axes: Any
) -> tuple[Array, Array, Array]:
    """The middle (k, 3) and the halves (k, 3) of the box along each node's axes about its corners,
    and the radius (k,) of the ball about that middle. `_bounds` makes up for rounding."""
    middles, halves, radii = np.empty_like(means), np.empty_like(means), np.zeros(len(sizes))
    off, low, high = np.empty(3), np.empty(3), np.empty(3)
    begin = 0
    for node in range(len(sizes)):
        end = begin + sizes[node]
        # How far the corners reach along each axis: the box ends there, wherever the mean is.
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
        # About the box's middle, so that one point serves both; corners are farthest of a triangle.
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
