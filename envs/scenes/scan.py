"""The surface of a house as a scanner within it would deliver it: a mesh with flaws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from envs.files.mesh_file import FileMesh
from envs.problem import Array
from envs.scenes.floor_plan import CELL, Plan
from envs.scenes.furniture import Boxes
from envs.seeding import stream

_UNEVEN = 0.35  # by how much, relatively, cells differ in size
_WARP_M, _WARP_WAVES_M = 0.015, (1.0, 4.0)  # slow drift of the scan
_NOISE_M = 0.004  # of single points
_PATCHES, _PATCH_M = 60, (0.08, 0.35)  # missing ones, and their radii
_MISSING_PANES = 0.3  # glass that the scanner looked through
_DIGITS = 4  # to which coordinates are rounded, as in a file: the same on every machine


def scanned(plan: Plan, scene: int) -> FileMesh:
    """The mesh of a house's surface in metres, z up, wound inward (normals point into the rooms).

    Flaws, all deterministic from `scene`: cells of uneven size, slow and fast noise, patches and
    window panes that are missing.
    """
    rng = stream("scan", scene)
    corners, quads = _surface(plan)
    faces = _triangles(rng, quads)
    faces = faces[~_missing_panes(rng, corners[faces], plan.panes)]
    points = np.stack([_uneven(rng, column) for column in corners.T], axis=1)
    faces = faces[~_in_patches(rng, points, faces)]
    points = points + _warp(rng, points) + rng.normal(0, _NOISE_M, points.shape)
    used, renumbered = np.unique(faces, return_inverse=True)
    return FileMesh(
        np.round(points[used], _DIGITS),
        renumbered.reshape(-1, 3).astype(np.int64),
        dropped=0,
        closed=False,
        outward=False,
    )


def _surface(plan: Plan) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The lattice points (n, 3) on the boundary of free space, and its squares (m, 4), each wound
    so that its normal points into free space."""
    low = plan.spaces[:, 0].min(axis=0) - 1
    free = np.zeros(plan.spaces[:, 1].max(axis=0) + 1 - low, dtype=bool)
    for boxes, value in ((plan.spaces, True), (plan.solids, False)):
        for a, b in boxes - low:
            free[a[0] : b[0], a[1] : b[1], a[2] : b[2]] = value
    squares = np.concatenate([_squares(free, axis) for axis in range(3)])
    corners, index = np.unique(squares.reshape(-1, 3), axis=0, return_inverse=True)
    return corners + low, index.reshape(-1, 4)


def _squares(free: NDArray[np.bool_], axis: int) -> NDArray[np.int64]:
    """The squares (m, 4, 3) between free and other cells that are neighbours along an axis."""
    cells = np.moveaxis(free, axis, 0)
    sides = []
    for ahead in (True, False):
        before, after = (cells[:-1], cells[1:]) if ahead else (cells[1:], cells[:-1])
        where = np.argwhere(~before & after)
        where[:, 0] += 1
        ring = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]])
        square = where[:, None] + (ring if ahead else ring[::-1])
        sides.append(square)
    # With y in front the axes are (y, x, z), a mirrored frame, which turns the winding round.
    both = np.concatenate(sides)
    if axis == 1:
        both = both[:, ::-1]
    back = np.empty_like(both)
    order = [axis, *(i for i in range(3) if i != axis)]
    back[..., order] = both
    return back


def _triangles(rng: np.random.Generator, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Squares (m, 4) cut along either diagonal."""
    turned = np.where(rng.random((len(quads), 1)) < 0.5, quads, np.roll(quads, 1, axis=1))
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _missing_panes(
    rng: np.random.Generator, triangles: NDArray[np.int64], panes: Boxes
) -> NDArray[np.bool_]:
    """Which triangles (m, 3, 3), on the lattice, lie in a pane that was not seen."""
    missing = np.zeros(len(triangles), dtype=bool)
    for low, high in panes[rng.random(len(panes)) < _MISSING_PANES]:
        missing |= ((triangles >= low) & (triangles <= high)).all(axis=(1, 2))
    return missing


def _uneven(rng: np.random.Generator, index: NDArray[np.int64]) -> Array:
    """Metres (n,) of lattice indices (n,) along an axis, at a spacing that varies slowly."""
    lines = np.arange(index.min(), index.max() + 1)
    wave = rng.uniform(20, 60, (3, 1))
    phase = rng.uniform(0, 2 * np.pi, (3, 1))
    spacing = CELL * (1 + _UNEVEN / 3 * np.sin(2 * np.pi * lines / wave + phase).sum(axis=0))
    place = np.concatenate([[0.0], np.cumsum(spacing[:-1])])
    metres: Array = place[index - index.min()]
    return metres


def _in_patches(
    rng: np.random.Generator, points: Array, faces: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which faces lie in one of the missing patches."""
    centers = points[faces].mean(axis=1)
    missing = np.zeros(len(faces), dtype=bool)
    for middle in centers[rng.integers(len(faces), size=_PATCHES)]:
        missing |= np.linalg.norm(centers - middle, axis=1) < rng.uniform(*_PATCH_M)
    return missing


def _warp(rng: np.random.Generator, points: Array) -> Array:
    """A smooth displacement (n, 3) of points (n, 3), in metres."""
    waves = 24
    direction = rng.normal(size=(waves, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    turn = 2 * np.pi * direction / rng.uniform(*_WARP_WAVES_M, (waves, 1))
    phase = rng.uniform(0, 2 * np.pi, waves)
    amplitude = rng.normal(0, _WARP_M * np.sqrt(2 / waves), (waves, 3))
    displaced: Array = np.sin(points @ turn.T + phase) @ amplitude
    return displaced
