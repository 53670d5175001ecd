"""Distances from triangle meshes in compiled code, never above the truth.

A tree of balls and boxes leads to the triangles that may be nearest. How far these are is found in
closed form (`triangles`), or is the distance between convex solids (`gjk`); both err to the safe
side.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.collision.gjk import distance, moved
from envs.collision.point_to_mesh import DEEPEST, ball_to_mesh, take_triangle
from envs.collision.primitive_sdf import to_solid
from envs.collision.shapes import CYLINDER, POINT, ROW
from envs.collision.triangles import point_to_triangle, triangle_to_triangle
from envs.compiled import njit_cached, njit_hot

AXIS = 8
"""Numbers of an axis that moves a mesh, see `first_within`."""


@njit_cached
def solid_to_mesh(trees: Any, root: int, row: Any, most: float) -> float:
    """A lower bound of the distance between a solid, a row (ROW,) of `SceneArrays.solids` in the
    mesh's frame, and the surface of the mesh at a root; or `most`, if it is no less.

    As near to the distance as `gjk.distance`.
    """
    if row[16] == POINT:
        return float(ball_to_mesh(trees, root, row[9], row[10], row[11], row[17], most, -1)[0])
    solid = row.reshape((1, ROW))
    triangle = np.zeros(ROW)
    nodes, bounds = np.empty(DEEPEST, dtype=np.int64), np.empty(DEEPEST)
    nodes[0], bounds[0] = root, solid_to_node(trees, root, solid, most)
    waiting, least = 1, most
    while waiting and least > 0.0:
        waiting -= 1
        if bounds[waiting] >= least:
            continue
        node = nodes[waiting]
        first = trees.child[node]
        if first < 0:
            take_triangle(trees, node, triangle)
            least = min(least, _solid_to_triangle(triangle, row, least))
            continue
        second = first + 1
        to_first = solid_to_node(trees, first, solid, least)
        to_second = solid_to_node(trees, second, solid, least)
        if to_first < to_second:  # the nearer one last, which is the next that is looked at
            first, second, to_first, to_second = second, first, to_second, to_first
        nodes[waiting], bounds[waiting] = first, to_first
        nodes[waiting + 1], bounds[waiting + 1] = second, to_second
        waiting += 2
    return float(max(least, 0.0))


@njit_cached
def _solid_to_triangle(triangle: Any, row: Any, most: float) -> float:
    if row[16] == POINT:
        return float(point_to_triangle(triangle, row[9], row[10], row[11]) - row[17])
    return float(distance(triangle, row, most))


@njit_hot
def solid_to_node(trees: Any, node: int, solid: Any, most: float) -> float:
    """The greater of what a node's ball and its box keep from a solid (1, ROW) at least: its box
    along its own axes, and where that is less than `most`, along the solid's."""
    middle, axes = trees.middles[node], trees.axes[node]
    by_ball: float = to_solid(solid, 0, middle[0], middle[1], middle[2]) - trees.radii[node]
    x, y, z = solid[0, 9] - middle[0], solid[0, 10] - middle[1], solid[0, 11] - middle[2]
    squared = 0.0
    for i in range(3):
        along = axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z
        gap = abs(along) - trees.halves[node, i] - _reach(solid, axes[i])
        if gap > 0.0:
            squared += gap * gap
    found = float(max(by_ball, math.sqrt(squared)))
    if found >= most or solid[0, 16] == POINT:
        return found
    squared, halves = 0.0, trees.halves[node]
    for i in range(3):
        axis = solid[0, 3 * i : 3 * i + 3]
        reach = 0.0
        for j in range(3):
            along = axes[j, 0] * axis[0] + axes[j, 1] * axis[1] + axes[j, 2] * axis[2]
            reach += abs(along) * halves[j]
        along = axis[0] * x + axis[1] * y + axis[2] * z
        gap = abs(along) - reach - _reach(solid, axis)
        if gap > 0.0:
            squared += gap * gap
    return float(max(found, math.sqrt(squared)))


@njit_hot
def _reach(solid: Any, axis: Any) -> float:
    """How far a solid (1, ROW) reaches from its centre along an axis (3,)."""
    radius = solid[0, 17]
    if solid[0, 16] == POINT:
        return float(radius)
    along = axis[0] * solid[0, 6] + axis[1] * solid[0, 7] + axis[2] * solid[0, 8]
    if solid[0, 16] == CYLINDER:
        aside = math.sqrt(max(1.0 - along * along, 0.0))
        return float(solid[0, 12] * aside + solid[0, 13] * abs(along) + radius)
    p = axis[0] * solid[0, 0] + axis[1] * solid[0, 1] + axis[2] * solid[0, 2]
    q = axis[0] * solid[0, 3] + axis[1] * solid[0, 4] + axis[2] * solid[0, 5]
    reach = abs(p) * solid[0, 12] + abs(q) * solid[0, 13] + abs(along) * solid[0, 14]
    return float(reach + radius)


@njit_cached
def mesh_to_mesh(
    trees: Any, root: int, others: Any, other_root: int, pose: Any, most: float, enough: float
) -> float:
    """A lower bound of the distance between the surfaces of two meshes, the other one at a pose
    (3, 4) in the frame of the first; or `most`, if it is no less; or that of some triangles, as
    soon as it is no more than `enough`. See `solid_to_mesh`."""
    return float(nearest_triangles(trees, root, others, other_root, pose, most, enough)[0])


@njit_cached
def nearest_triangles(
    trees: Any, root: int, others: Any, other_root: int, pose: Any, most: float, enough: float
) -> tuple[float, int, int]:
    """As `mesh_to_mesh`, and the leaves of the two triangles that are so far apart, -1 if none
    are."""
    triangle, other_triangle, there = np.zeros(ROW), np.zeros(ROW), np.zeros(ROW)
    nodes = np.empty((2 * DEEPEST, 2), dtype=np.int64)
    bounds = np.empty(2 * DEEPEST)
    nodes[0, 0], nodes[0, 1] = root, other_root
    bounds[0] = node_to_node(trees, root, others, other_root, pose, most)
    waiting, least, leaf, other_leaf = 1, most, -1, -1
    # Depth first, the nearer half first. No triangles of two nodes are nearer than the nodes are,
    # so that pairs which are no nearer than what was found can be left out.
    while waiting and least > enough:
        waiting -= 1
        if bounds[waiting] >= least:
            continue
        a, b = nodes[waiting, 0], nodes[waiting, 1]
        if trees.child[a] < 0 and others.child[b] < 0:
            take_triangle(trees, a, triangle)
            take_triangle(others, b, other_triangle)
            moved(other_triangle, pose, there)
            apart = triangle_to_triangle(triangle, there)
            if apart < least:
                least, leaf, other_leaf = apart, a, b
            continue
        # The larger of the two: halving the smaller one would bring them hardly any farther apart.
        splits_a = others.child[b] < 0 or (trees.child[a] >= 0 and trees.radii[a] > others.radii[b])
        a1, b1, a2, b2 = a, b, a, b
        if splits_a:
            a1, a2 = trees.child[a], trees.child[a] + 1
        else:
            b1, b2 = others.child[b], others.child[b] + 1
        one = node_to_node(trees, a1, others, b1, pose, least)
        two = node_to_node(trees, a2, others, b2, pose, least)
        if one < two:
            a1, b1, a2, b2, one, two = a2, b2, a1, b1, two, one
        if one < least:
            nodes[waiting, 0], nodes[waiting, 1], bounds[waiting] = a1, b1, one
            waiting += 1
        if two < least:
            nodes[waiting, 0], nodes[waiting, 1], bounds[waiting] = a2, b2, two
            waiting += 1
    return least, leaf, other_leaf


@njit_cached
def triangles_apart(trees: Any, leaf: int, others: Any, other: int, pose: Any) -> float:
    """The distance of the triangles of two leaves, see `mesh_to_mesh`."""
    triangle, other_triangle, there = np.zeros(ROW), np.zeros(ROW), np.zeros(ROW)
    take_triangle(trees, leaf, triangle)
    take_triangle(others, other, other_triangle)
    moved(other_triangle, pose, there)
    return float(triangle_to_triangle(triangle, there))


@njit_cached
def solid_to_leaf(trees: Any, leaf: int, row: Any) -> float:
    """The distance of a solid from the triangle of a leaf, see `solid_to_mesh`."""
    triangle = np.zeros(ROW)
    take_triangle(trees, leaf, triangle)
    return float(_solid_to_triangle(triangle, row, np.inf))


@njit_cached
def leaf_at(trees: Any, root: int, x: float, y: float, z: float) -> int:
    """The leaf whose triangle is nearest to a point in the mesh's frame, or one that the point is
    on, but for rounding."""
    point, triangle = np.zeros((1, ROW)), np.zeros(ROW)
    point[0, 9], point[0, 10], point[0, 11], point[0, 16] = x, y, z, POINT
    nodes, bounds = np.empty(DEEPEST, dtype=np.int64), np.empty(DEEPEST)
    nodes[0], bounds[0] = root, 0.0
    waiting, least, found = 1, np.inf, root
    while waiting and least > 0.0:
        waiting -= 1
        if bounds[waiting] >= least:
            continue
        node = nodes[waiting]
        first = trees.child[node]
        if first < 0:
            take_triangle(trees, node, triangle)
            apart = point_to_triangle(triangle, x, y, z)
            if apart < least:
                least, found = apart, node
            continue
        second = first + 1
        to_first = solid_to_node(trees, first, point, least)
        to_second = solid_to_node(trees, second, point, least)
        if to_first < to_second:
            first, second, to_first, to_second = second, first, to_second, to_first
        nodes[waiting], bounds[waiting] = first, to_first
        nodes[waiting + 1], bounds[waiting + 1] = second, to_second
        waiting += 2
    return found


@njit_cached
def first_within(
    trees: Any, root: int, axes: Any, other_root: int, other_axes: Any, pose: Any, reach: float
) -> tuple[float, float]:
    """The first two triangles found of two meshes, the other one at a pose (3, 4) in the frame of
    the first, that are no farther apart than `reach` and what axes move them by: their distance as
    they are, and how far both are moved at most. Infinite and 0 if there are none.

    Args:
        axes, other_axes: that move each mesh from where it is, rows (k, AXIS), those nearest to the
            mesh first: a point of the axis and its direction, in the frame of the mesh; by how much
            at most it turns, in radians, or slides; and 1 if it slides, else 0.
    """
    triangle, other_triangle, there = np.zeros(ROW), np.zeros(ROW), np.zeros(ROW)
    nodes, moves = np.empty((2 * DEEPEST, 2), dtype=np.int64), np.empty((2 * DEEPEST, 2))
    beyond = np.empty(2)
    nodes[0, 0], nodes[0, 1], waiting = root, other_root, 1
    moves[0, 0], moves[0, 1] = _moves(trees, root, axes), _moves(trees, other_root, other_axes)
    while waiting:
        waiting -= 1
        a, b = nodes[waiting, 0], nodes[waiting, 1]
        by_a, by_b = moves[waiting, 0], moves[waiting, 1]
        if trees.child[a] < 0 and trees.child[b] < 0:
            take_triangle(trees, a, triangle)
            take_triangle(trees, b, other_triangle)
            moved(other_triangle, pose, there)
            apart = triangle_to_triangle(triangle, there)
            if apart <= reach + by_a + by_b:
                return apart, by_a + by_b
            continue
        splits_a = trees.child[b] < 0 or (trees.child[a] >= 0 and trees.radii[a] > trees.radii[b])
        first, begin = trees.child[a] if splits_a else trees.child[b], waiting
        for n in range(2):
            if splits_a:
                a = first + n
                by_a = _moves(trees, a, axes)
            else:
                b = first + n
                by_b = _moves(trees, b, other_axes)
            most = reach + by_a + by_b
            beyond[n] = node_to_node(trees, a, trees, b, pose, most) - most
            if beyond[n] <= 0.0:
                nodes[waiting, 0], nodes[waiting, 1] = a, b
                moves[waiting, 0], moves[waiting, 1] = by_a, by_b
                waiting += 1
        if waiting == begin + 2 and beyond[0] < beyond[1]:
            for k in range(2):  # the nearer two last, which are the next that are looked at
                nodes[begin, k], nodes[begin + 1, k] = nodes[begin + 1, k], nodes[begin, k]
                moves[begin, k], moves[begin + 1, k] = moves[begin + 1, k], moves[begin, k]
    return math.inf, 0.0


@njit_hot
def _moves(trees: Any, node: int, axes: Any) -> float:
    """How far axes move anything that a node holds from where it is, at most.

    A turn moves a point by its angle times the point's distance from the axis, which is at most
    what it is as things are, and what the axes nearer to the mesh have moved it by.
    """
    moves = 0.0
    for n in range(len(axes)):
        row = axes[n]
        if row[7] > 0.0:
            moves += row[6]
            continue
        x, y, z = trees.middles[node, 0], trees.middles[node, 1], trees.middles[node, 2]
        x, y, z = x - row[0], y - row[1], z - row[2]
        u, v, w = y * row[5] - z * row[4], z * row[3] - x * row[5], x * row[4] - y * row[3]
        off_axis = math.sqrt(u * u + v * v + w * w)
        moves += row[6] * (off_axis + trees.radii[node] + moves)
    return moves


@njit_hot
def node_to_node(trees: Any, a: int, others: Any, b: int, pose: Any, most: float) -> float:
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
