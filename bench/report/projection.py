"""How a scene is seen: its direction, what is in the picture, where buildings are cut open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.report import raster
from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.problem import Array
from envs.robots.arm import Arm

_ELEVATIONS = (24, 40)
_AZIMUTHS = range(-180, 180, 15)

_SPREAD_COUNTS = 0.7
"""How much it counts that paths fill the picture, against that nothing is in front of them."""

_COARSE = 120
"""Pixels along a picture's longer side where it is only asked what is hidden."""


@dataclass(frozen=True)
class Projection:
    """A parallel projection; angles in degrees, as Matplotlib counts them."""

    elevation: float
    azimuth: float

    @cached_property
    def axes(self) -> Array:
        """Unit vectors (3, 3), a row each: to the right, up, and toward the eye."""
        up, round_ = np.radians([self.elevation, self.azimuth])
        toward = np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])
        right = np.array([-np.sin(round_), np.cos(round_), 0.0])
        return np.array([right, np.cross(toward, right), toward])

    def __call__(self, points: Array) -> Array:
        """Where points (..., 3) are to the right, up, and toward the eye."""
        shown: Array = points @ self.axes.T
        return shown


def most_telling(points: Array, traces: Array, obstacles: Array) -> Projection:
    """The projection in which obstacles hide few of the points, and traces are seen at length.

    Args:
        points: (n, 3) of what is to be seen.
        traces: (m, 3) points along the paths.
        obstacles: (k, 3, 3), triangles.
    """
    choices = [Projection(e, a) for e, a in product(_ELEVATIONS, _AZIMUTHS)]
    widths = np.array([_width(choice(traces)[:, :2]) for choice in choices])
    seen = np.array([_share_seen(choice(points), choice(obstacles)) for choice in choices])
    return choices[int(np.argmax(seen + _SPREAD_COUNTS * widths / max(widths.max(), 1e-12)))]


def _width(flat: Array) -> float:
    """The root of about the area over which points (m, 2) are spread."""
    return float(max(np.linalg.det(np.cov(flat.T)), 0.0) ** 0.25)


def _share_seen(points: Array, obstacles: Array) -> float:
    """Of projected points (n, 3), before which there is none of the triangles (k, 3, 3)."""
    lower, upper = points.min(axis=0)[:2], points.max(axis=0)[:2]
    pixel = float((upper - lower).max()) / _COARSE
    columns, rows = ((upper - lower) / pixel).astype(int) + 1
    nearest = raster.depths(obstacles, lower, pixel, (int(rows), int(columns)))
    at = ((points[:, :2] - lower) / pixel).astype(int)
    return float((nearest[at[:, 1], at[:, 0]] <= points[:, 2] / pixel).mean())


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
    reach = float(arm.arrays.reach.max())
    at = arm.tree.joints[0].origin[:3, 3]
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
