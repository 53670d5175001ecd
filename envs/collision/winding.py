"""On which side of surfaces points are, compiled: by generalised winding numbers, each as near as
it takes.

The winding number of a surface at a point is the solid angle that it takes up there, by that of the
whole sphere (Jacobson et al. 2013): the sum over faces of the field of dipoles that lie on them. As
Barill et al. (2018) have it, those of a node of a tree that is far off are taken together, by their
first two moments about its middle. Here each such sum comes with a bound of its error, and what
that does not decide is looked at more closely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.mesh_tree import Trees, trees_of
from envs.collision.open_edges import NO_CELLS, CellsBesideEdges, cells_beside, is_beside
from envs.collision.point_to_mesh import DEEPEST
from envs.collision.shapes import Mesh
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array

_ERRORS = 1e-2, 1e-3, 1e-4
"""What the solid angle of a node may be off by, tried in turn until the number is near enough."""


class Sides(NamedTuple):
    """Where points must be about surfaces.

    Attributes:
        trees: of the surfaces.
        roots: (s,), the first node of each; none where the right side is everywhere.
        dipoles: (k, 10) of each node: the sum of its faces' area vectors; the symmetric part of the
            moment of these about its middle, as xx, yy, zz, xy, xz, yz; and the moment of its area,
            by squared distances.
        ranges: (s, 2, 2), two ranges of winding numbers by each surface; a point is on the right
            side if each number lies in one of its two, ends not included.
        beside: where motions may come to another side without touching anything.
    """

    trees: Trees
    roots: NDArray[np.int64]
    dipoles: Array
    ranges: Array
    beside: CellsBesideEdges


def sides_of(
    surfaces: Sequence[Mesh], ranges: Sequence[Array], gap: float, lids: Sequence[Mesh]
) -> Sides:
    """What compiled code is given of surfaces, see `Sides`.

    Args:
        surfaces: as they are wound.
        ranges: of each, (2, 2).
        gap: how far from an open edge motions may come to another side.
        lids: other surfaces, which close some of their holes.
    """
    trees, roots = trees_of(surfaces)
    dipoles = np.zeros((len(trees.radii), 10))
    _sum_up(trees, dipoles)
    beside = cells_beside([*surfaces, *lids], gap)
    return Sides(trees, roots, dipoles, np.array(ranges).reshape(-1, 2, 2), beside)


EVERYWHERE = Sides(
    *(trees_of([])[0], np.zeros(0, dtype=np.int64), np.zeros((0, 10)), np.zeros((0, 2, 2))),
    NO_CELLS,
)
"""The right side of no surface."""


@njit_cached
def _sum_up(trees: Any, dipoles: Any) -> None:
    """Writes what `Sides` has of dipoles, from the leaves up."""
    count = len(dipoles)
    whole = np.zeros((count, 9))  # moments before they are made symmetric
    firsts, areas = np.zeros((count, 3)), np.zeros(count)
    for node in range(count - 1, -1, -1):
        first = trees.child[node]
        if first < 0:
            areas[node] = _take_face(
                trees.triangles[-1 - first], dipoles[node], whole[node], firsts[node]
            )
            continue
        for child in (first, first + 1):
            squared = 0.0
            for i in range(3):
                away = trees.middles[child, i] - trees.middles[node, i]
                squared += away * away
                dipoles[node, i] += dipoles[child, i]
                dipoles[node, 9] += 2 * away * firsts[child, i]
                firsts[node, i] += firsts[child, i] + away * areas[child]
                for j in range(3):
                    whole[node, 3 * j + i] += whole[child, 3 * j + i] + dipoles[child, j] * away
            dipoles[node, 9] += dipoles[child, 9] + squared * areas[child]
            areas[node] += areas[child]
    for node in range(count):
        for i in range(3):
            dipoles[node, 3 + i] = whole[node, 4 * i]
        dipoles[node, 6] = (whole[node, 1] + whole[node, 3]) / 2
        dipoles[node, 7] = (whole[node, 2] + whole[node, 6]) / 2
        dipoles[node, 8] = (whole[node, 5] + whole[node, 7]) / 2


@njit_cached
def _take_face(face: Any, dipole: Any, whole: Any, first: Any) -> float:
    """Writes the moments of a face (9,), corners from the middle of its leaf, and returns its area:
    of squared distances the mean over a triangle is that over all products of two corners, each
    corner with itself counted twice."""
    a, b, c = face[:3], face[3:6], face[6:]
    u, v = b - a, c - a
    dipole[0] = (u[1] * v[2] - u[2] * v[1]) / 2
    dipole[1] = (u[2] * v[0] - u[0] * v[2]) / 2
    dipole[2] = (u[0] * v[1] - u[1] * v[0]) / 2
    area = math.sqrt(dipole[0] ** 2 + dipole[1] ** 2 + dipole[2] ** 2)
    squares = 0.0
    for i in range(3):
        middle = (a[i] + b[i] + c[i]) / 3
        first[i] = area * middle
        squares += (9 * middle * middle + a[i] ** 2 + b[i] ** 2 + c[i] ** 2) / 12
        for j in range(3):
            whole[3 * j + i] = dipole[j] * middle
    dipole[9] = area * squares
    return area


@njit_cached
def is_on_the_right_side(sides: Any, x: float, y: float, z: float) -> bool:
    """Whether a point is proved to be where `Sides` want it: one whose winding number is at the end
    of a range, to the last of `_ERRORS`, is not."""
    is_right = True
    for surface in range(len(sides.roots)):
        is_right = is_right and _is_right(sides, surface, x, y, z)
    return is_right


@njit_cached
def stays_on_the_right_side(sides: Any, a: Any, b: Any) -> bool:
    """Whether a straight motion from a to b, (3,), which touches nothing and begins on the right
    side, is on it where it may come near to open edges, and at its end."""
    squared = 0.0
    for i in range(3):
        squared += (b[i] - a[i]) ** 2
    parts = int(math.sqrt(squared) / sides.beside.side) + 1
    passes = False
    for n in range(1, parts + 1):
        t = n / parts
        x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
        is_near = is_beside(sides.beside, x, y, z)
        passes |= is_near
        if (is_near or (passes and n == parts)) and not is_on_the_right_side(sides, x, y, z):
            return False
    return True


@njit_cached
def _is_right(sides: Any, surface: int, x: float, y: float, z: float) -> bool:
    ranges = sides.ranges[surface]
    for error in _ERRORS:
        number, off = winding_number(sides, sides.roots[surface], x, y, z, error)
        least, most, may_be = number - off, number + off, False
        for n in range(2):
            if ranges[n, 0] < least and most < ranges[n, 1]:
                return True
            may_be |= ranges[n, 0] < most and least < ranges[n, 1]
        if not may_be:
            return False
    return False


@njit_cached
def winding_number(
    sides: Any, root: int, x: float, y: float, z: float, error: float
) -> tuple[float, float]:
    """The winding number of the surface at a root at a point, and what it may be off by.

    Args:
        error: what the solid angle of a node may be off by; 0 to look at each face.
    """
    nodes = np.empty(DEEPEST, dtype=np.int64)
    nodes[0], waiting = root, 1
    number, off = 0.0, 0.0
    trees, dipoles = sides.trees, sides.dipoles
    while waiting:
        waiting -= 1
        node = nodes[waiting]
        p, q, r = (
            trees.middles[node, 0] - x,
            trees.middles[node, 1] - y,
            trees.middles[node, 2] - z,
        )
        first = trees.child[node]
        squared = p * p + q * q + r * r
        distance = math.sqrt(squared)
        apart = distance - trees.radii[node]
        if apart > 0.0:
            # Taylor's rest: half of the third derivative of 1 / distance, which is 6 / distance^4.
            near = apart * apart
            bound = 3.0 * dipoles[node, 9] / (near * near)
            if bound <= error:
                number += _far_field(dipoles[node], p, q, r, squared, distance)
                off += bound
                continue
        if first < 0:
            number += _solid_angle(trees.triangles[-1 - first], p, q, r)
        else:
            nodes[waiting], nodes[waiting + 1] = first, first + 1
            waiting += 2
    return number / (4 * math.pi), off / (4 * math.pi)


@njit_hot
def _far_field(dipole: Any, p: float, q: float, r: float, squared: float, distance: float) -> float:
    """The solid angle of a node whose middle is at (p, q, r), to the first order."""
    by_cube = 1.0 / (squared * distance)
    along = dipole[0] * p + dipole[1] * q + dipole[2] * r
    trace = dipole[3] + dipole[4] + dipole[5]
    twice = dipole[3] * p * p + dipole[4] * q * q + dipole[5] * r * r
    twice += 2.0 * (dipole[6] * p * q + dipole[7] * p * r + dipole[8] * q * r)
    return float((along + trace - 3.0 * twice / squared) * by_cube)


@njit_hot
def _solid_angle(face: Any, p: float, q: float, r: float) -> float:
    """Of a face (9,), whose corners are about (p, q, r), by Van Oosterom and Strackee (1983)."""
    ax, ay, az = face[0] + p, face[1] + q, face[2] + r
    bx, by, bz = face[3] + p, face[4] + q, face[5] + r
    cx, cy, cz = face[6] + p, face[7] + q, face[8] + r
    a = math.sqrt(ax * ax + ay * ay + az * az)
    b = math.sqrt(bx * bx + by * by + bz * bz)
    c = math.sqrt(cx * cx + cy * cy + cz * cz)
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = a * b * c + (ax * bx + ay * by + az * bz) * c
    below += (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
    return 2.0 * math.atan2(volume, below)
