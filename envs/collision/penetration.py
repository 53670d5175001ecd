"""How deep two shapes are in each other, for messages and audits."""

from __future__ import annotations

from functools import cached_property
from weakref import WeakKeyDictionary

from trimesh import remesh

from envs.collision.mesh import MeshQueries, queries
from envs.collision.shapes import Mesh, Solid
from envs.problem import Array

_FINENESS = 40
"""Points of a surface are no farther apart than this part of the shape's size."""


def penetration_depth(one: Solid, other: Solid, one_pose: Array, other_pose: Array) -> float:
    """How far the deepest of many points of either's surface is within the other, in workspace
    units; 0 where none is.

    Args:
        one, other: two solids.
        one_pose, other_pose: (3, 4), from their frames to the workspace.

    Example:
        >>> from envs.collision.shapes import Box
        >>> cube, still, moved = Box([0, 0, 0], [2, 2, 2]), np.eye(3, 4), np.eye(3, 4)
        >>> moved[0, 3] = 1.75
        >>> round(penetration_depth(cube.solid, cube.solid, still, moved), 6)
        0.25
    """
    a, b = _surface(one), _surface(other)
    return max(_depth(a, b, one_pose, other_pose), _depth(b, a, other_pose, one_pose))


class _Surface:
    """That of a solid, in its own frame, whose points and queries take long to make."""

    def __init__(self, solid: Solid) -> None:
        self._triangles = solid.triangulate()
        self.low, self.high = self._triangles.bounds

    @cached_property
    def points(self) -> Array:
        """Many, (n, 3)."""
        longest = float(self._triangles.scale) / _FINENESS
        divided = remesh.subdivide_to_size(  # type: ignore[no-untyped-call]
            self._triangles.vertices, self._triangles.faces, longest
        )
        points: Array = divided[0]
        return points

    @cached_property
    def queries(self) -> MeshQueries:
        """Distances and insides."""
        return queries(self._mesh)

    @cached_property
    def _mesh(self) -> Mesh:
        return Mesh(self._triangles.vertices, self._triangles.faces)


_SURFACES: WeakKeyDictionary[Solid, _Surface] = WeakKeyDictionary()


def _surface(solid: Solid) -> _Surface:
    """Made once for as long as there is the solid: an audit asks of each a thousand times."""
    if solid not in _SURFACES:
        _SURFACES[solid] = _Surface(solid)
    return _SURFACES[solid]


def _depth(points_of: _Surface, within: _Surface, pose: Array, other_pose: Array) -> float:
    """Of the first's points in the second."""
    there = points_of.points @ pose[:, :3].T + pose[:, 3]
    points = (there - other_pose[:, 3]) @ other_pose[:, :3]  # in the second's own frame
    near = points[((points >= within.low) & (points <= within.high)).all(axis=1)]
    if not len(near):
        return 0.0
    inside = near[within.queries.is_inside(near)]
    return float(within.queries.distance(inside).max(initial=0.0))
