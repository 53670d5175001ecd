"""What of a scene is drawn about an arm, so that it fills the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from envs.problem import Array
from envs.robots.arm import Arm

_MARGIN = 0.06
"""About what is drawn whole, in metres."""

_WHOLE = 1.5
"""The largest obstacles that are drawn whole, by the arm's reach."""

_SIDES = 48
"""Of the prism that stands for a cylinder."""


@dataclass(frozen=True)
class Region:
    """The upright cylinder of which the inside is drawn: `middle` (2,), `radius`, and from where
    up to where, in metres."""

    middle: Array
    radius: float
    low: float
    high: float

    def cropped(self, triangles: Array) -> Array:
        """What of triangles (n, 3, 3) lies in the region."""
        angles = 2 * math.pi * np.arange(_SIDES) / _SIDES
        out = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_SIDES)])
        up = np.array([[0.0, 0.0, 1.0]])
        middle = np.append(self.middle, 0.0)
        planes = np.concatenate([middle + self.radius * out, self.low * up, self.high * up])
        corners = triangles.reshape(-1, 3)
        mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
        return np.asarray(mesh.slice_plane(planes, np.concatenate([-out, up, -up])).triangles)


def region_about(drawn: Array, arm: Arm, surfaces: Sequence[Array]) -> Region:
    """What holds points (n, 3), and whole those of the obstacles within reach that are not much
    larger, as tables, floors and rooms are."""
    reach = float(arm.view.reach.max())
    at = arm.chain.joints[0].origin[:3, 3]
    held = [drawn]
    for corners in (surface.reshape(-1, 3) for surface in surfaces):
        low, high = corners.min(axis=0), corners.max(axis=0)
        near = np.linalg.norm(np.clip(at, low, high) - at) < reach
        if near and (high - low).max() < _WHOLE * reach:
            held.append(corners)
    points = np.concatenate(held)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high)[:2] / 2
    radius = float(np.linalg.norm(points[:, :2] - middle, axis=1).max()) + _MARGIN
    return Region(middle, radius, float(low[2]) - _MARGIN, float(high[2]) + _MARGIN)
