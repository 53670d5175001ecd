"""How a scene is looked at from far away, and from where most of it is seen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from bench.report import raster
from envs.problem import Array

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
