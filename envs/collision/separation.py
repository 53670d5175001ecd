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

from envs.collision.gjk import compose, distance, moved
from envs.collision.mesh_distance import mesh_to_mesh, solid_to_mesh
from envs.collision.mesh_tree import Trees, trees_of
from envs.collision.shapes import ROW, Mesh, Obstacle
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array


class Shapes(NamedTuple):
    """Placed shapes as compiled code sees them, each in the frame that it is placed in.

    Attributes:
        rows: (p, ROW), see `envs.collision.shapes.solid`.
        poses: (p, 3, 4) of the shapes.
        roots: (p,) of the trees of those that are meshes, -1 of others.
        trees: of all meshes.
    """

    rows: Array
    poses: Array
    roots: NDArray[np.int64]
    trees: Trees


def shapes_of(placed: Sequence[Obstacle]) -> Shapes:
    """What compiled code is given of shapes."""
    trees, found = trees_of([one.solid for one in placed if isinstance(one.solid, Mesh)])
    roots = np.full(len(placed), -1)
    roots[[isinstance(one.solid, Mesh) for one in placed]] = found
    return Shapes(
        np.array([one.solid.distance_row(one.pose) for one in placed]).reshape(-1, ROW),
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
    if a.roots[i] < 0 and b.roots[j] < 0:
        return float(distance(row, other, most))
    x, y, z = row[9] - other[9], row[10] - other[10], row[11] - other[11]
    apart = math.sqrt(x * x + y * y + z * z) - row[15] - other[15]
    if apart >= most:
        return float(apart)
    here, there, between = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    if a.roots[i] >= 0 and b.roots[j] >= 0:
        compose(pose, a.poses[i], here)
        _undo(here, between)
        compose(at, b.poses[j], there)
        compose(between, there, here)
        return float(mesh_to_mesh(a.trees, a.roots[i], b.trees, b.roots[j], here, most))
    if a.roots[i] < 0:
        a, i, row, pose, b, j, other, at = b, j, other, at, a, i, row, pose
    compose(pose, a.poses[i], here)
    _undo(here, between)
    solid = np.empty(ROW)
    moved(other, between, solid)
    return float(solid_to_mesh(a.trees, a.roots[i], solid, most))


@njit_cached
def least_separation(a: Any, i: int, turn: Any, shift: Any, around: Any, most: float) -> float:
    """The least `separation` of shape i of `a`, after a rotation (3, 3) and a translation (3,),
    from shapes that stand still; or something above `most`."""
    pose, still, row = np.empty((3, 4)), np.eye(3, 4), np.empty(ROW)
    pose[:, :3], pose[:, 3] = turn, shift
    moved(a.rows[i], pose, row)
    least = most
    for j in range(len(around.rows)):
        apart = separation(a, i, row, pose, around, j, around.rows[j], still, least)
        least = min(least, apart)
    return least


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
def _undo(pose: Any, out: Any) -> None:
    """Writes the pose (3, 4) that undoes one."""
    for i in range(3):
        out[i, 3] = 0.0
        for j in range(3):
            out[i, j] = pose[j, i]
            out[i, 3] -= pose[j, i] * pose[j, 3]
