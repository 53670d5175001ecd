"""Whether a robot's links and the obstacles lie within each other, where FCL sees only surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from envs.collision.mesh import queries
from envs.collision.shapes import Box, Mesh, Obstacle, Placed, Solid
from envs.problem import Array
from envs.robots.base import Robot


class Containment:
    """Which configurations have no part of a robot wholly within an obstacle that is a mesh, and
    no obstacle, or other part, wholly within a part that is a mesh.

    What touches no surface is either apart from a solid or wholly within it, so a point of each
    piece tells. Meshes stand for closed solids.

    Args:
        robot: its shapes, of which the first `moving` meet the obstacles.
        obstacles: fixed in the workspace.

    Attributes:
        possible: whether there are meshes at all.
    """

    def __init__(self, robot: Robot, obstacles: Sequence[Obstacle]) -> None:
        self._robot = robot
        self._points = [piece_points(shape) for shape in robot.shapes]
        self._link_meshes = [
            (number, shape) for number, shape in enumerate(robot.shapes) if isinstance(shape, Mesh)
        ]
        placed = [o if isinstance(o, Placed) else Placed(o, np.eye(4)) for o in obstacles]
        self._meshes = [(o.solid, o.pose) for o in placed if isinstance(o.solid, Mesh)]
        self._obstacle_points = np.concatenate(
            [
                np.zeros((0, 3)),
                *(piece_points(o.solid) @ o.pose[:3, :3].T + o.pose[:3, 3] for o in placed),
            ]
        )
        self.possible = bool(self._meshes or self._link_meshes)

    def __call__(self, q: Array) -> NDArray[np.bool_]:
        """(n,) of bool, at configurations (n, d)."""
        return np.array([not self._within(one) for one in q], dtype=np.bool_)

    def _within(self, q: Array) -> bool:
        robot = self._robot
        poses = [(np.eye(3) if turn is None else turn, shift) for turn, shift in robot.poses(q)]
        points = [p @ turn.T + shift for p, (turn, shift) in zip(self._points, poses, strict=True)]
        moving = np.concatenate(points[: robot.moving])
        for mesh, pose in self._meshes:
            if _is_inside(mesh, pose[:3, :3], pose[:3, 3], moving):
                return True
        for number, mesh in self._link_meshes:
            others = [points[b if a == number else a] for a, b in robot.pairs if number in (a, b)]
            if number < robot.moving:
                others.append(self._obstacle_points)
            if others and _is_inside(mesh, *poses[number], np.concatenate(others)):
                return True
        return False


def _is_inside(mesh: Mesh, turn: Array, shift: Array, points: Array) -> bool:
    if len(points) == 0:
        return False
    return bool(queries(mesh).is_inside((points - shift) @ turn).any())


def piece_points(solid: Solid) -> Array:
    """A point (n, 3) of each connected piece of a solid, in its frame."""
    if isinstance(solid, Mesh):
        import trimesh  # half a second, which processes without meshes can save

        whole = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
        pieces = trimesh.graph.connected_components(
            whole.face_adjacency, nodes=np.arange(len(solid.faces))
        )
        return np.array([solid.vertices[solid.faces[piece[0], 0]] for piece in pieces])
    return solid.center[None] if isinstance(solid, Box) else np.zeros((1, 3))
