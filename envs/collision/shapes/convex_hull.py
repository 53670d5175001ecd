"""Convex hulls of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from envs.collision.shapes.solid import LARGEST
from envs.collision.shapes.triangle_mesh import Mesh, digest_of
from envs.problem import Array, frozen_array

_FLAT = 1e-9
"""Of the extent: points that are no farther from a plane lie in it."""


@dataclass(frozen=True, eq=False)
class ConvexHull(Mesh):
    """The solid between points: all that is within their convex hull. Distances are those from its
    surface, which is closed, as of other solids that are meshes.

    Make it by `of_points`.

    Example:
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 0.2]]
        >>> hull = ConvexHull.of_points(corners)
        >>> len(hull.vertices), len(hull.faces)
        (4, 4)
    """

    kind: ClassVar[str] = "hull"

    @classmethod
    def of_points(cls, points: ArrayLike) -> ConvexHull:
        """The hull of points (n, 3) in its frame, in any order, of which some may be within.

        Raises:
            ValueError: they are no such numbers, or fewer than 4 of them differ, or all of them lie
                in one plane.
        """
        from scipy import spatial  # a quarter of a second, which processes without hulls can save

        there = _checked(points)
        try:
            found = spatial.ConvexHull(there)
        except spatial.QhullError as error:
            raise ValueError(_IN_A_PLANE) from error
        corners, renumbered = np.unique(found.simplices, return_inverse=True)
        vertices = there[corners]
        return cls(vertices, _outward(vertices, renumbered.reshape(-1, 3)))

    def definition(self) -> list[Any]:
        """By its corners alone: which triangles its sides are cut into does not matter."""
        return [self.kind, digest_of(self.vertices)]

    def piece_points(self) -> Array:
        return self.vertices[:1]


_IN_A_PLANE = "a hull's points must not all lie in one plane; a flat hull is a thin box or a mesh"


def _checked(points: ArrayLike) -> Array:
    """The points that differ, in one order, so that the same ones make the same hull."""
    there = frozen_array(points, 2, "a hull's points")
    if there.shape[1:] != (3,):
        raise ValueError(f"a hull's points must be (n, 3), not {there.shape}")
    if not (np.abs(there) <= LARGEST).all():
        raise ValueError(f"a hull's points must be at most {LARGEST:g} from the origin")
    there = np.unique(there, axis=0)
    if len(there) < 4:
        raise ValueError(f"a hull needs at least 4 points that differ, not {len(there)}")
    spread = np.linalg.svd(there - there.mean(axis=0), compute_uv=False)
    if spread[2] <= _FLAT * spread[0]:
        raise ValueError(_IN_A_PLANE)
    return there


def _outward(vertices: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces (m, 3) of a closed surface, all wound outward."""
    import igl  # a sixth of a second, which processes without hulls can save

    wound, _ = igl.bfs_orient(faces)
    corners = vertices[wound] - vertices.mean(axis=0)
    outward: NDArray[np.int64] = wound if np.linalg.det(corners).sum() > 0 else wound[:, ::-1]
    return outward
