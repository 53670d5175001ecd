"""Triangle meshes (libigl): batched distances and insides, the closing of holes, and whether links
and obstacles lie within each other, where FCL sees only surfaces.
"""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Mesh, Obstacle, Robot
from envs.grid import node_counts, node_positions
from envs.problem import Array

if TYPE_CHECKING:  # what it imports takes a second, which processes without meshes can save
    from envs.collision.enclosure import Enclosure

_KEPT = 4  # meshes whose lids are kept in a process
_CELLS = 128  # along the longest side of the grid on which holes are sought
_COVERED = 0.75  # of a cell: nearer to the surface, the surface itself closes


class MeshQueries:
    """Distances to a mesh and what it encloses, with the trees that make them fast."""

    def __init__(self, mesh: Mesh) -> None:
        import igl  # a sixth of a second, which processes without meshes can save

        # Copies: libigl wants arrays that it may write to.
        self._arrays = np.array(mesh.vertices), np.array(mesh.faces)
        self._tree = igl.AABB()
        self._tree.init(*self._arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        return queries, (Mesh(*self._arrays),)

    def distance(self, points: Array) -> Array:
        """Unsigned distances (n,) of points (n, 3) to the surface."""
        squared, _, _ = self._tree.squared_distance(*self._arrays, np.ascontiguousarray(points))
        distance: Array = np.sqrt(squared)
        return distance

    def closest(self, points: Array) -> Array:
        """The points (n, 3) of the surface that are closest to points (n, 3)."""
        found: Array = self._tree.squared_distance(*self._arrays, np.ascontiguousarray(points))[2]
        return found

    @cached_property
    def filled(self) -> Enclosure:
        """The mesh as a solid, see `enclosure.filled`."""
        from envs.collision.enclosure import filled

        return filled(Mesh(*self._arrays))

    @cached_property
    def room(self) -> Enclosure:
        """The mesh as a room, see `enclosure.room`."""
        from envs.collision.enclosure import room

        return room(Mesh(*self._arrays))

    def is_inside(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (n, 3) are within the solid that the mesh stands for, (n,) of bool.

        The way its faces are wound, or how often they are written, does not matter; through holes
        the generalised winding number changes steadily, and more than half counts as inside.
        """
        inside: NDArray[np.bool_] = self.encloses(points) > 0.5
        return inside

    def encloses(self, points: Array) -> Array:
        """How far the solid encloses points (n, 3), (n,): see `is_inside`."""
        return self.filled.encloses(points)


_known: WeakKeyDictionary[Mesh, MeshQueries] = WeakKeyDictionary()


def queries(mesh: Mesh) -> MeshQueries:
    """The queries of a mesh, made once for as long as there is the mesh: queries change nothing, so
    worlds share them."""
    if mesh not in _known:
        _known[mesh] = MeshQueries(mesh)
    return _known[mesh]


@lru_cache(maxsize=_KEPT)
def cap_holes(mesh: Mesh, enclosure: Enclosure | None = None) -> Mesh | None:
    """Surfaces that close a mesh's holes, or None if it has none.

    They are where it encloses points by half (`enclosure`; None for the solid that it stands for):
    the level set by marching cubes, without its parts along the mesh's own surface. Holes narrower
    than a cell, a 128th of the mesh's longest side, stay open.
    """
    import igl

    enclosure = enclosure or queries(mesh).filled
    if not enclosure.has_holes:
        return None
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    cell = float((high - low).max()) / _CELLS
    counts = node_counts(low, high, cell) + 4
    axes = [start + cell * np.arange(n) for start, n in zip(low - 2 * cell, counts, strict=True)]
    # First axis fastest, as marching cubes wants it.
    nodes = np.ascontiguousarray(node_positions(axes).transpose(2, 1, 0, 3).reshape(-1, 3))
    level = enclosure.encloses(nodes) - 0.5
    vertices, faces, _ = igl.marching_cubes(level, nodes, *map(int, counts), 0.0)
    if len(faces) == 0:
        return None
    away = queries(mesh).distance(vertices)[faces].max(axis=1) > _COVERED * cell
    used, renumbered = np.unique(faces[away], return_inverse=True)
    return Mesh(vertices[used], renumbered.reshape(-1, 3)) if away.any() else None


def widest_gap(mesh: Mesh) -> float:
    """Half the width of holes that `cap_holes` may leave open, in the mesh's units."""
    return (1 + _COVERED) * float(np.ptp(mesh.vertices, axis=0).max()) / _CELLS


# libigl's objects must be gone before its module is, or it complains at exit.
atexit.register(_known.clear)
atexit.register(cap_holes.cache_clear)


class Containment:
    """Which configurations have no part of a robot wholly within an obstacle that is a mesh, and
    no obstacle, or other part, wholly within a part that is a mesh.

    What touches no surface is either apart from a solid or wholly within it, so a point of each
    piece tells. Meshes stand for closed solids.

    Args:
        robot: its shapes, of which the first `moving` meet the obstacles.
        obstacles: fixed in the workspace.
        may_touch: (moving, obstacles) of bool, which may be within each other, as in
            `CollisionModel`.

    Attributes:
        possible: whether there are meshes at all.
    """

    def __init__(
        self,
        robot: Robot,
        obstacles: Sequence[Obstacle],
        may_touch: NDArray[np.bool_] | None = None,
    ) -> None:
        self._robot, shapes = robot, robot.shapes
        points = [shape.piece_points() for shape in shapes]
        self._points = np.concatenate(points)
        self._owners = np.repeat(np.arange(len(shapes)), [len(some) for some in points])
        around = [o.piece_points() for o in obstacles]
        self._around = np.concatenate([np.zeros((0, 3)), *around])
        checked = np.zeros((len(shapes), len(obstacles)), dtype=np.bool_)
        checked[: robot.moving] = True if may_touch is None else ~may_touch
        numbers = [n for n, shape in enumerate(shapes) if isinstance(shape, Mesh)]
        self._meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
        self._numbers = np.array(numbers, dtype=np.int64)
        pieces = np.array([len(some) for some in around], dtype=np.int64)
        of_each = np.repeat(np.arange(len(obstacles)), pieces)
        self._asked = np.hstack([self._pairs(), checked[:, of_each]])[numbers]
        self._obstacles = [
            (obstacle.solid, obstacle.pose, checked[self._owners, n])
            for n, obstacle in enumerate(obstacles)
            if isinstance(obstacle.solid, Mesh)
        ]
        bounds = [mesh.bounds for mesh in self._meshes]
        self._low, self._high = np.array(bounds).reshape(-1, 2, 1, 3).swapaxes(0, 1)
        self.possible = bool(self._obstacles or self._meshes)

    def _pairs(self) -> NDArray[np.bool_]:
        """Whether a point of the robot's pieces must not be within a shape: (shapes, points) of
        bool."""
        count = len(self._robot.shapes)
        pairs = np.zeros((count, count), dtype=np.bool_)
        for a, b in self._robot.pairs:
            pairs[a, b] = pairs[b, a] = True
        return pairs[:, self._owners]

    def __call__(self, q: Array) -> NDArray[np.bool_]:
        """(n,) of bool, at configurations (n, d)."""
        return np.array([not self._within(one) for one in q], dtype=np.bool_)

    def robot_encloses(self, q: Array) -> NDArray[np.bool_]:
        """Which have an obstacle, or another part, wholly within a part that is a mesh, (n,) of
        bool, at configurations (n, d)."""
        return np.array([self._encloses(*self._placed(one)) for one in q], dtype=np.bool_)

    def _within(self, q: Array) -> bool:
        poses, points = self._placed(q)
        for mesh, pose, asked in self._obstacles:
            there = (points[asked] - pose[:3, 3]) @ pose[:3, :3]
            low, high = mesh.bounds
            if _has_inside(mesh, there[((there >= low) & (there <= high)).all(axis=1)]):
                return True
        return self._encloses(poses, points)

    def _placed(self, q: Array) -> tuple[Array, Array]:
        """The poses (p, 3, 4) of the robot's shapes, and the points (k, 3) of their pieces."""
        poses = self._robot.poses(q)
        of_each = poses[self._owners]
        points = np.einsum("kij,kj->ki", of_each[:, :, :3], self._points) + of_each[:, :, 3]
        return poses, points

    def _encloses(self, poses: Array, points: Array) -> bool:
        if not self._meshes:
            return False
        poses, points = poses[self._numbers], np.concatenate([points, self._around])
        there = (points - poses[:, None, :, 3]) @ poses[:, :, :3]
        # What is beside its vertices is outside a mesh; so is nearly all that is asked.
        asked = self._asked & ((there >= self._low) & (there <= self._high)).all(axis=2)
        return any(
            _has_inside(self._meshes[n], there[n, asked[n]])
            for n in np.flatnonzero(asked.any(axis=1))
        )


def _has_inside(mesh: Mesh, points: Array) -> bool:
    """Whether any of some points (n, 3) is within a mesh, in its frame."""
    return len(points) > 0 and bool(queries(mesh).is_inside(points).any())
