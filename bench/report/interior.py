"""Buildings, whose obstacles enclose free space: pictures show them cut open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.problem import Array

_FREE_SIDE = 1e-2  # how far from a face its free side is looked for, in workspace units


def interior(env: Environment) -> Allowed | None:
    """Which places are within the rooms of a building; None where obstacles enclose no free space,
    or no more than clearances say what is free, as among boxes that are walls. Those are seen
    through instead."""
    outside = np.asarray(env.upper)[None] + 1.0
    return None if env.allowed is None or env.allowed(outside)[0] else env.allowed


def faced(within: Allowed, faces: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Of faces (n, 3, 3) of a building the unit normals (n, 3), and whether what is before and
    behind each, where its normal points and elsewhere, is within the rooms, (n,) of bool."""
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    middles = faces.mean(axis=1)
    before, behind = (within(middles + side * _FREE_SIDE * normals) for side in (1, -1))
    return normals, before, behind
