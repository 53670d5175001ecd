"""Signed distances to primitive solids and meshes in compiled code, one point at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from envs.collision.mesh import queries
from envs.collision.shapes import BOX, CYLINDER, ROW, Mesh, Obstacle
from envs.compiled import njit_cached, njit_hot, njit_inline
from envs.grid import RegularGrid, central_differences, distance_beyond, trilinear
from envs.problem import Array

_SPACING = 0.02
"""Between the nodes of the grid of distances to meshes, by the extent of where it is asked."""

MESHES, NO_OBSTACLE = -1, -2
"""Stand for meshes, and for no obstacle, where a nearest one is named."""


class SceneArrays(NamedTuple):
    """Obstacles as compiled code sees them.

    Attributes:
        solids: (b, ROW), the rows in the workspace of those that are no meshes, see
            `envs.collision.shapes.solid`.
        grid: of distances to meshes, in single precision, at most what they are within the cells
            about the nodes; a single node where there are no meshes.
    """

    solids: Array
    grid: RegularGrid


def scene_arrays(obstacles: Sequence[Obstacle], lower: Array, upper: Array) -> SceneArrays:
    """What compiled code is given of obstacles, asked between two corners (3,)."""
    return SceneArrays(solid_rows(obstacles), mesh_grid(obstacles, lower, upper))


def solid_rows(obstacles: Sequence[Obstacle]) -> Array:
    """See `SceneArrays.solids`."""
    rows = [o.solid.distance_row(o.pose) for o in obstacles if not isinstance(o.solid, Mesh)]
    return np.array(rows).reshape(-1, ROW)


def mesh_grid(obstacles: Sequence[Obstacle], lower: Array, upper: Array) -> RegularGrid:
    """See `SceneArrays.grid`."""
    meshes = [(o.solid, o.pose) for o in obstacles if isinstance(o.solid, Mesh)]
    return _grid(meshes, lower, upper) if meshes else _NO_MESHES


def _grid(meshes: Sequence[tuple[Mesh, Array]], lower: Array, upper: Array) -> RegularGrid:
    """The distances to meshes, negative within, lowered by what interpolation may be off."""
    spacing = _SPACING * float((upper - lower).max())

    def distance(points: Array) -> Array:
        found = np.full(len(points), np.inf)
        for mesh, pose in meshes:
            local = (points - pose[:3, 3]) @ pose[:3, :3]
            asked = queries(mesh)
            signed = np.where(asked.is_inside(local), -1.0, 1.0) * asked.distance(local)
            found = np.minimum(found, signed)
        return found - math.sqrt(3) / 2 * spacing

    return RegularGrid.sampled(distance, lower, upper, spacing)


_NO_MESHES = RegularGrid(np.ones((1, 1, 1), dtype=np.float32), np.zeros(3), np.ones(3), np.ones(3))


@njit_inline  # a tenth less for all of a clearance
def to_solid(solids: Any, n: int, x: float, y: float, z: float) -> float:
    """Signed distance from a point to the solid in row n as in `SceneArrays`; see `nearest`."""
    dx, dy, dz = x - solids[n, 9], y - solids[n, 10], z - solids[n, 11]
    a = solids[n, 0] * dx + solids[n, 1] * dy + solids[n, 2] * dz
    b = solids[n, 3] * dx + solids[n, 4] * dy + solids[n, 5] * dz
    c = solids[n, 6] * dx + solids[n, 7] * dy + solids[n, 8] * dz
    distance: float
    if solids[n, 16] == BOX:
        a, b, c = abs(a) - solids[n, 12], abs(b) - solids[n, 13], abs(c) - solids[n, 14]
        out_a, out_b, out_c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
        distance = math.sqrt(out_a * out_a + out_b * out_b + out_c * out_c)
        distance += min(max(a, b, c), 0.0)
    elif solids[n, 16] == CYLINDER:
        aside, above = math.sqrt(a * a + b * b) - solids[n, 12], abs(c) - solids[n, 13]
        out_a, out_b = max(aside, 0.0), max(above, 0.0)
        distance = math.sqrt(out_a * out_a + out_b * out_b) + min(max(aside, above), 0.0)
    else:
        distance = math.sqrt(a * a + b * b + c * c)
    return distance - float(solids[n, 17])


@njit_hot
def nearest(scene: Any, x: float, y: float, z: float, most: float) -> tuple[float, int]:
    """Signed distance from a point to the nearest obstacle, and its number or `MESHES`; or `most`
    and `NO_OBSTACLE`, if that is less.

    Exact outside of solids (to meshes never too great); within it is negative and at most the
    true depth in size.
    """
    least, which = most, NO_OBSTACLE
    if scene.grid.values.size > 1:
        to_meshes = _to_meshes(scene.grid, x, y, z)
        if to_meshes < least:
            least, which = to_meshes, MESHES
    solids = scene.solids
    for n in range(len(solids)):
        dx, dy, dz = x - solids[n, 9], y - solids[n, 10], z - solids[n, 11]
        beyond = least + solids[n, 15]
        if dx * dx + dy * dy + dz * dz >= beyond * beyond and beyond > 0:
            continue
        distance = to_solid(solids, n, x, y, z)
        if distance < least:
            least, which = distance, n
    return least, which


@njit_cached
def normal_at(scene: Any, which: int, x: float, y: float, z: float, normal: Any) -> None:
    """Writes the gradient (3,) of the distance to obstacle number `which`, see `nearest`."""
    if which == MESHES:
        central_differences(_to_meshes, scene.grid, scene.grid.per_unit, x, y, z, normal)
        return
    row = scene.solids[which]
    local, slope = np.empty(3), np.empty(3)
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            at = x if j == 0 else y if j == 1 else z
            local[i] += row[3 * i + j] * (at - row[9 + j])
    if row[16] == BOX:
        _slope_of_box(local, row[12:15], slope)
    elif row[16] == CYLINDER:
        _slope_of_cylinder(local, row[12], row[13], slope)
    else:
        slope[:] = local / max(math.sqrt((local**2).sum()), 1e-12)
    for i in range(3):
        normal[i] = row[i] * slope[0] + row[3 + i] * slope[1] + row[6 + i] * slope[2]


@njit_cached
def _slope_of_box(local: Any, half: Any, slope: Any) -> None:
    squared = 0.0
    deepest, axis = -np.inf, 0
    for i in range(3):
        beyond = abs(local[i]) - half[i]
        if beyond > deepest:
            deepest, axis = beyond, i
        slope[i] = math.copysign(max(beyond, 0.0), local[i])
        squared += slope[i] * slope[i]
    if squared > 0.0:
        slope /= math.sqrt(squared)
    else:
        slope[axis] = math.copysign(1.0, local[axis])


@njit_cached
def _slope_of_cylinder(local: Any, radius: float, half: float, slope: Any) -> None:
    out = math.sqrt(local[0] ** 2 + local[1] ** 2)
    aside, above = out - radius, abs(local[2]) - half
    if aside > 0.0 and above > 0.0:
        distance = math.sqrt(aside**2 + above**2)
        share, rise = aside / distance, above / distance
    elif aside > above:
        share, rise = 1.0, 0.0
    else:
        share, rise = 0.0, 1.0
    slope[0] = share * local[0] / max(out, 1e-12)
    slope[1] = share * local[1] / max(out, 1e-12)
    slope[2] = math.copysign(rise, local[2])


@njit_hot
def _to_meshes(grid: Any, x: float, y: float, z: float) -> float:
    """The distance between the grid's nodes; beyond them, their border's less the way to it."""
    return trilinear(grid, x, y, z) - distance_beyond(grid, x, y, z)
