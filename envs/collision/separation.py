"""How far shapes of any kind are apart, compiled: never more than they are.

Solids in closed form or by `gjk`, surfaces of meshes by `mesh_distance`: below the distance by
no more than 1e-6 of it, or 1e-6 metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import at as carried
from envs.collision.gjk import compose, distance, hull_distance_between, moved
from envs.collision.hull import hull_of
from envs.collision.hull_support import CELLS
from envs.collision.mesh_distance import (
    leaf_at,
    mesh_to_mesh,
    node_to_node,
    solid_to_leaf,
    solid_to_mesh,
    solid_to_node,
    triangles_apart,
)
from envs.collision.mesh_tree import Trees, trees_of
from envs.collision.shapes import POINT, ROW, Mesh, Obstacle
from envs.compiled import njit_cached, njit_hot, njit_inline
from envs.problem import Array

_PRECISION = 1e-7
"""In metres, or by the distance where that is over a metre: distances may be found that much
below the truth, in closed form as by `gjk`."""


class Shapes(NamedTuple):
    """Placed shapes as compiled code sees them, each in the frame that it is placed in.

    Attributes:
        rows: (p, ROW), see `envs.collision.shapes.solid`; those of meshes stand for their hulls,
            see `envs.collision.hull`.
        corners: (k, 3) of the hulls of meshes, from the centres of their rows along their axes; see
            `corners_by_cell`.
        first_corners: (p, `CELLS` + 1) where those of each shape, and cell, begin.
        are_hulls: (p,) of bool, meshes that are the surfaces of their hulls.
        poses: (p, 3, 4) of the shapes.
        roots: (p,) of the trees of those that are meshes, -1 of others.
        trees: of all meshes.
    """

    rows: Array
    corners: Array
    first_corners: NDArray[np.int64]
    are_hulls: NDArray[np.bool_]
    poses: Array
    roots: NDArray[np.int64]
    trees: Trees


def shapes_of(placed: Sequence[Obstacle]) -> Shapes:
    """What compiled code is given of shapes."""
    rows = np.array([one.solid.distance_row(one.pose) for one in placed]).reshape(-1, ROW)
    roots, are_hulls = np.full(len(placed), -1), np.zeros(len(placed), dtype=np.bool_)
    meshes = {n: one.solid for n, one in enumerate(placed) if isinstance(one.solid, Mesh)}
    trees, roots[list(meshes)] = trees_of(list(meshes.values()))
    corners, count = [np.empty((0, 3))], 0
    first_corners = np.zeros((len(placed), CELLS + 1), dtype=np.int64)
    for n, mesh in meshes.items():
        hull = hull_of(mesh)
        places, firsts = hull.by_cell
        corners.append(places - mesh.bounding_sphere()[0])
        first_corners[n] = count + firsts
        count += len(places)
        rows[n, 17], are_hulls[n] = hull.radius, hull.is_surface
    return Shapes(
        rows,
        np.concatenate(corners),
        first_corners,
        are_hulls,
        np.array([one.pose[:3] for one in placed]).reshape(-1, 3, 4),
        roots,
        trees,
    )


@njit_cached
def separation(
    a: Any, i: int, row: Any, pose: Any, b: Any, j: int, other: Any, at: Any, most: float
) -> float:
    """A lower bound of the distance of shape i of `a` from shape j of `b`, or something that is at
    least `most`; 0 where they touch, or one of them is within another that is no mesh.

    Their rows (ROW,) and the poses (3, 4) of the frames that they are placed in are those of now.
    """
    return separated(a, i, row, pose, b, j, other, at, most)[0]


@njit_inline
def separated(
    a: Any, i: int, row: Any, pose: Any, b: Any, j: int, other: Any, at: Any, most: float
) -> tuple[float, bool]:
    """The `separation` of two shapes, and whether it is known as well, if they are apart, that
    neither is within the other: False only of meshes."""
    found, known = separated_within(a, i, row, pose, b, j, other, at, most, most)
    return found, known


@njit_cached
def separated_within(
    a: Any,
    i: int,
    row: Any,
    pose: Any,
    b: Any,
    j: int,
    other: Any,
    at: Any,
    most: float,
    reach: float,
) -> tuple[float, bool]:
    """As `separated`; where the surfaces of meshes are farther apart than `reach`, and their hulls
    are not, this may be what is said."""
    if a.roots[i] < 0 and b.roots[j] < 0:
        return float(distance(row, other, most)), True
    hulls, most, is_enough = told_by_hulls(a, i, row, pose, b, j, other, at, most, reach)
    if is_enough:
        return hulls, hulls > 0.0
    surfaces = _surface_separation(a, i, pose, b, j, other, at, row, most)
    return max(hulls, surfaces), hulls > 0.0


@njit_cached
def told_by_hulls(
    a: Any,
    i: int,
    row: Any,
    pose: Any,
    b: Any,
    j: int,
    other: Any,
    at: Any,
    most: float,
    reach: float,
) -> tuple[float, float, bool]:
    """How far the hulls of two shapes are apart, one of which is a mesh; up to which distance their
    surfaces are asked; and whether they need not be, see `separated_within`."""
    x, y, z = row[9] - other[9], row[10] - other[10], row[11] - other[11]
    apart = math.sqrt(x * x + y * y + z * z) - row[15] - other[15]
    if apart >= most:
        return apart, most, True
    # A ball is asked of the surface at once, which takes no longer.
    if row[16] == POINT or other[16] == POINT:
        return 0.0, most, False
    ends = np.empty((2, 3))
    some, others = corners(a, i), corners(b, j)
    hulls, known = hull_distance_between(row, some, other, others, most, ends)
    exact = (a.roots[i] < 0 or a.are_hulls[i]) and (b.roots[j] < 0 or b.are_hulls[j])
    most = min(most, reach)
    if hulls > 0.0 and (exact or hulls >= most):
        return hulls, most, True
    if hulls > 0.0 and known:
        # Where the hulls are nearest there are mostly the meshes: many are hulls but for dents.
        most = min(most, _separation_at(a, i, pose, b, j, other, at, row, ends))
        if most <= hulls + _PRECISION * max(1.0, hulls):
            return hulls, most, True
    return hulls, most, False


@njit_cached
def _separation_at(
    a: Any, i: int, pose: Any, b: Any, j: int, other: Any, at: Any, row: Any, ends: Any
) -> float:
    """How far two shapes of which one is a mesh, or both are, are apart at points (2, 3) of each:
    of a mesh it is the triangle nearest to the point that counts."""
    if a.roots[i] < 0:
        a, i, row, pose, b, j, other, at = b, j, other, at, a, i, row, pose
        ends = ends[::-1]
    here, between, there = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    _to_frame_of(a, i, pose, here)
    x, y, z = carried(here, ends[0])
    leaf = leaf_at(a.trees, a.roots[i], x, y, z)
    if b.roots[j] < 0:
        solid = np.empty(ROW)
        moved(other, here, solid)
        return float(solid_to_leaf(a.trees, leaf, solid))
    _to_frame_of(b, j, at, there)
    x, y, z = carried(there, ends[1])
    other_leaf = leaf_at(b.trees, b.roots[j], x, y, z)
    compose(at, b.poses[j], there)
    compose(here, there, between)
    return float(triangles_apart(a.trees, leaf, b.trees, other_leaf, between))


@njit_cached
def _to_frame_of(shapes: Any, number: int, pose: Any, out: Any) -> None:
    """Writes the pose (3, 4) that takes the workspace to the frame of a mesh, given the pose of
    the frame that it is placed in."""
    there = np.empty((3, 4))
    compose(pose, shapes.poses[number], there)
    undo(there, out)


@njit_cached
def boxes_apart(
    a: Any, i: int, pose: Any, b: Any, j: int, other: Any, at: Any, most: float
) -> float:
    """What a box that holds a mesh keeps from another shape at least: one that holds it, too, or
    itself if it is no mesh. As `separation`, of which shape i is the mesh."""
    here = np.empty((3, 4))
    _to_frame_of(a, i, pose, here)
    if b.roots[j] < 0:
        solid = np.empty((1, ROW))
        moved(other, here, solid[0])
        return float(solid_to_node(a.trees, a.roots[i], solid, most))
    there, between = np.empty((3, 4)), np.empty((3, 4))
    compose(at, b.poses[j], there)
    compose(here, there, between)
    return float(node_to_node(a.trees, a.roots[i], b.trees, b.roots[j], between, most))


@njit_cached
def corners(shapes: Any, number: int) -> Any:
    """Of the hull of a shape, see `corners_by_cell`."""
    return shapes.corners, shapes.first_corners[number]


@njit_cached
def _surface_separation(
    a: Any, i: int, pose: Any, b: Any, j: int, other: Any, at: Any, row: Any, most: float
) -> float:
    """The `separation` of two shapes of which one is a mesh or both are, by their surfaces."""
    if a.roots[i] >= 0 and b.roots[j] >= 0:
        return meshes_apart(a, i, pose, b, j, at, most, 0.0)
    if a.roots[i] < 0:
        a, i, row, pose, b, j, other, at = b, j, other, at, a, i, row, pose
    here, solid = np.empty((3, 4)), np.empty(ROW)
    _to_frame_of(a, i, pose, here)
    moved(other, here, solid)
    return float(solid_to_mesh(a.trees, a.roots[i], solid, most))


@njit_cached
def meshes_apart(
    a: Any, i: int, pose: Any, b: Any, j: int, at: Any, most: float, enough: float
) -> float:
    """`mesh_to_mesh` of shape i of `a` and shape j of `b`, given the poses (3, 4) of the frames
    that they are placed in."""
    between = np.empty((3, 4))
    pose_between(a, i, pose, b, j, at, between)
    return float(mesh_to_mesh(a.trees, a.roots[i], b.trees, b.roots[j], between, most, enough))


@njit_cached
def pose_between(a: Any, i: int, pose: Any, b: Any, j: int, at: Any, between: Any) -> None:
    """Writes the pose (3, 4) of shape j of `b` in the frame of shape i of `a`, given those of the
    frames that they are placed in."""
    here, there = np.empty((3, 4)), np.empty((3, 4))
    _to_frame_of(a, i, pose, here)
    compose(at, b.poses[j], there)
    compose(here, there, between)


def contacts_array(may_touch: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """What compiled code is given of which shapes may touch which that stand still: an array
    without rows if None."""
    found = np.zeros((0, 0), dtype=np.bool_) if may_touch is None else may_touch
    return np.array(found, dtype=np.bool_, order="C")


@njit_hot
def is_allowed(may_touch: Any, part: int, j: int) -> bool:
    """Whether a shape may touch one that stands still, see `contacts_array`."""
    return len(may_touch) > 0 and bool(may_touch[part, j])


@njit_cached
def clearances_of_each(
    shapes: Any,
    poses: Any,
    around: Any,
    pairs: Any,
    may_touch: Any,
    most: float,
    near: float,
    found: Any,
) -> bool:
    """Writes what each moving shape keeps, (moving,), from shapes that stand still and from others
    that it must not touch, as `separation` has it: of all that are no farther than the nearest, or
    than `near`; of others something at least as great. `most` where that is less, and of whatever
    is not asked any more once something touches.

    Args:
        shapes: the robot's, whose frames are at `poses` (p, 3, 4).
        around: those that stand still.
        pairs: (k, 2); each counts for the first of the two, which moves.
        may_touch: which moving shapes may touch which that stand still, see `contacts_array`.

    Returns:
        Whether it is known as well that nothing is within another.
    """
    rows, still = np.empty((len(shapes.rows), ROW)), np.eye(3, 4)
    for part in range(len(rows)):
        moved(shapes.rows[part], poses[part], rows[part])
    found[:] = most
    each, gaps = _near_pairs(rows, around.rows, pairs, may_touch, len(found), most)
    least, known = most, True
    for n in np.argsort(gaps):  # the nearest first, which spare most others
        if gaps[n] >= max(least, near) or least <= 0.0:
            break
        part, j = each[n, 0], each[n, 1]
        here = min(found[part], max(least, near))
        if j < len(rows):
            apart, is_known = separated(
                shapes, part, rows[part], poses[part], shapes, j, rows[j], poses[j], here
            )
        else:
            j -= len(rows)
            apart, is_known = separated(
                shapes, part, rows[part], poses[part], around, j, around.rows[j], still, here
            )
        found[part], known = min(found[part], apart), known and is_known
        least = min(least, apart)
    return known


@njit_cached
def _near_pairs(
    rows: Any, around: Any, pairs: Any, may_touch: Any, moving: int, most: float
) -> tuple[Any, Any]:
    """The pairs (k, 2) of shapes that must not touch, the first of which moves, whose spheres are
    less than `most` apart, and how far these are (k,). Those that stand still count from the number
    of rows on."""
    count = len(pairs) + moving * len(around)
    each, gaps, n = np.empty((count, 2), dtype=np.int64), np.empty(count), 0
    for pair in pairs:
        each[n, 0], each[n, 1] = pair[0], pair[1]
        gaps[n] = sphere_gap(rows[pair[0]], rows[pair[1]])
        n += gaps[n] < most
    for part in range(moving):
        for j in range(len(around)):
            if is_allowed(may_touch, part, j):
                continue
            each[n, 0], each[n, 1] = part, len(rows) + j
            gaps[n] = sphere_gap(rows[part], around[j])
            n += gaps[n] < most
    return each[:n], gaps[:n]


@njit_hot
def sphere_gap(row: Any, other: Any) -> float:
    """Between the spheres that hold two shapes."""
    x, y, z = row[9] - other[9], row[10] - other[10], row[11] - other[11]
    return math.sqrt(x * x + y * y + z * z) - float(row[15]) - float(other[15])


@njit_hot
def are_beyond(row: Any, other: Any, most: float) -> bool:
    """Whether the spheres that hold two shapes are at least `most` apart."""
    x, y, z = row[9] - other[9], row[10] - other[10], row[11] - other[11]
    beyond: float = most + row[15] + other[15]
    return bool(x * x + y * y + z * z >= beyond * beyond)


@njit_cached
def separations(shapes: Any, i: int, j: int, poses: Any, most: float) -> Any:
    """The `separation` (n,) of two shapes whose frames are at poses (n, 2, 3, 4)."""
    row, other = np.empty(ROW), np.empty(ROW)
    found = np.empty(len(poses))
    for n in range(len(poses)):
        pose, at = poses[n, 0], poses[n, 1]
        moved(shapes.rows[i], pose, row)
        moved(shapes.rows[j], at, other)
        found[n] = separation(shapes, i, row, pose, shapes, j, other, at, most)
    return found


@njit_hot
def undo(pose: Any, out: Any) -> None:
    """Writes the pose (3, 4) that undoes one."""
    for i in range(3):
        out[i, 3] = 0.0
        for j in range(3):
            out[i, j] = pose[j, i]
            out[i, 3] -= pose[j, i] * pose[j, 3]
