"""Obstacles as FCL has them, for each shape of a robot that meets them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress
from typing import Any

import fcl
import numpy as np
from numpy.typing import NDArray

from envs.collision.shapes import Obstacle
from envs.problem import Array


def broad_phases(objects: Sequence[Any], checked: NDArray[np.bool_]) -> list[Any]:
    """FCL's broad phase of what each shape of a robot must not touch; shapes that must not touch
    the same share one.

    Args:
        objects: FCL's collision objects (k,).
        checked: (shapes, k) which of them each must not touch.
    """
    made: dict[bytes, Any] = {}
    for row in checked:
        if row.tobytes() not in made:
            made[row.tobytes()] = _broad_phase(list(compress(objects, row)))
    return [made[row.tobytes()] for row in checked]


def _broad_phase(objects: Sequence[Any]) -> Any:
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    return manager


def placed_in_fcl(obstacle: Obstacle) -> fcl.CollisionObject:
    solid, pose = obstacle.solid, obstacle.pose
    transform = fcl_transform(pose[:3, :3], pose[:3, 3], solid.offset)
    return fcl.CollisionObject(solid.fcl_geometry(), transform)


def fcl_transform(rotation: Array, translation: Array, offset: Array | None) -> fcl.Transform:
    """Of what FCL is given of a solid at a pose, see `Solid.offset`."""
    if offset is not None:
        translation = translation + rotation @ offset
    return fcl.Transform(rotation, translation)
