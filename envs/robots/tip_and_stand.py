"""What pictures show of an arm besides its solids: the way of its tip, and what it stands on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from envs.collision.shapes import Cylinder, PlacedShape
from envs.problem import Array
from envs.robots.kinematic_tree import KinematicTree, Link

_STAND_SHARE, _WIDEST_STAND = 0.4, 0.1
"""The radius of a stand that is made up: by the height of the first joint; at most, in metres."""

_END = 0.98
"""What is farther out, by the farthest point of a tool, is its end."""


def tip_of(last: Link, carried: Sequence[PlacedShape]) -> Array:
    """The tip of a tool, (3,) in the frame of the last link: the origin of that, as of a tool
    without solids, or the far end of the solids that move with it, whichever is farther from the
    last joint. `carried` are those solids, in their body's frame."""
    corners = [np.asarray(placed.triangulate().triangles).reshape(-1, 3) for placed in carried]
    far = [np.linalg.norm(points, axis=1) for points in corners]
    farthest = max((float(distances.max()) for distances in far), default=0.0)
    if farthest <= np.linalg.norm(last.offset[:3, 3]):
        return np.zeros(3)
    points, distances = np.concatenate(corners), np.concatenate(far)
    end = np.unique(points[distances > _END * farthest].round(9), axis=0).mean(axis=0)
    to_link = np.linalg.inv(last.offset)
    tip: Array = to_link[:3, :3] @ end + to_link[:3, 3]
    return tip


def stand(tree: KinematicTree) -> list[PlacedShape]:
    """What holds an arm up of which the base's solids are not known: from the base to the first
    joint."""
    import trimesh  # half a second, which processes that draw nothing can save

    begin = tree.links[0].offset[:3, 3]
    to_joint = tree.joints[0].origin[:3, 3] - begin
    height = float(np.linalg.norm(to_joint))
    if height < 1e-3:
        return []
    pose = np.asarray(trimesh.geometry.align_vectors([0, 0, 1], to_joint))  # type: ignore[no-untyped-call]
    pose[:3, 3] = begin + to_joint / 2
    return [PlacedShape(Cylinder(min(_STAND_SHARE * height, _WIDEST_STAND), height), pose)]
