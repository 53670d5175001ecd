"""Distances of a ball from shapes of any kind, one place after another, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.collision.gjk import moved
from envs.collision.point_to_mesh import ball_to_mesh
from envs.collision.separation import separation
from envs.collision.shapes import ROW
from envs.compiled import njit_cached
from envs.problem import Array


@njit_cached
def none_nearest(around: Any) -> Any:
    """What `ball_to_shapes` is given the first time."""
    return np.full(len(around.rows), -1)


@njit_cached
def room_for_ball() -> Any:
    """Arrays that `ball_to_shapes` works in."""
    return np.empty(ROW), np.eye(3, 4), np.eye(3, 4)


@njit_cached
def ball_to_shapes(
    ball: Any, around: Any, nearest: Any, place: Any, room: Any, most: float
) -> float:
    """What a ball at a place (3,) keeps from shapes at least, or `most`, if that is less.

    Args:
        ball: the only one of `Shapes`, about the origin.
        around: the others.
        nearest: (m,), of those that are meshes the leaf that was nearest last time, or -1, which is
            replaced: a ball that is asked about next is mostly nearby.
        room: see `room_for_ball`.
    """
    row, pose, still = room
    for i in range(3):
        pose[i, 3] = place[i]
    moved(ball.rows[0], pose, row)
    for j in range(len(around.rows)):
        if around.roots[j] >= 0:
            apart = _to_mesh(around, j, row, most, nearest)
        else:
            apart = separation(ball, 0, row, pose, around, j, around.rows[j], still, most)
        most = min(most, apart)
    return most


@njit_cached
def _to_mesh(around: Any, j: int, row: Any, most: float, nearest: Any) -> float:
    """The `separation` of the ball in a row (ROW,) from one that is a mesh."""
    pose = around.poses[j]
    u, v, w = row[9] - pose[0, 3], row[10] - pose[1, 3], row[11] - pose[2, 3]
    x = pose[0, 0] * u + pose[1, 0] * v + pose[2, 0] * w
    y = pose[0, 1] * u + pose[1, 1] * v + pose[2, 1] * w
    z = pose[0, 2] * u + pose[1, 2] * v + pose[2, 2] * w
    trees, root = around.trees, around.roots[j]
    found, nearest[j] = ball_to_mesh(trees, root, x, y, z, row[17], most, nearest[j])
    return float(found)


@njit_cached
def balls_to_shapes(ball: Any, around: Any, places: Any) -> Array:
    """What a ball at each place (n, 3) keeps from shapes at least, (n,): see `ball_to_shapes`."""
    found, nearest, room = np.empty(len(places)), none_nearest(around), room_for_ball()
    for n in range(len(places)):
        found[n] = ball_to_shapes(ball, around, nearest, places[n], room, np.inf)
    return found
