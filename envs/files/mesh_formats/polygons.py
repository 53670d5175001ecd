"""Polygons cut into triangles that stay within them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import manifold3d
import numpy as np
from numpy.typing import NDArray

from envs.files.mesh_formats.soup import Soup, UnreadableError, check_corners, check_finite
from envs.problem import Array

Ints = NDArray[np.int64]

_THIN = 1e-9  # of a polygon's area: thinner triangles of a fan have no sides of their own
_BENT = 1e-3  # of the mesh's extent: farther from its plane a polygon is said not to be flat
_WRONG = 1e-3  # of the mesh's extent, squared: area that a polygon which crosses itself may have


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces of any numbers of corners.

    Attributes:
        vertices: (n, 3).
        counts: (p,), corners of each face.
        corners: (sum of counts,), indices of vertices, face by face.
    """

    vertices: Array
    counts: Ints
    corners: Ints

    def __post_init__(self) -> None:
        check_finite(self.vertices)
        check_corners(self.corners, self.vertices)

    def are_fans(self) -> bool:
        """Whether all may be cut from their first corner."""
        return all(self._is_fan(rows).all() for _, rows in self._groups())

    def cut(self) -> Soup:
        """Their triangles: fans where these stay within the polygon, else by ear clipping in the
        plane that fits it best (Newell's normal). Triangles come first, quadrilaterals next, as
        from trimesh.

        Raises:
            UnreadableError: a polygon crosses itself, so that nothing says what it covers.
        """
        faces, larger, order, bent = [], [], [], 0
        for which, rows in self._groups():
            fan, count = self._is_fan(rows), rows.shape[1]
            steps = np.arange(1, count - 1)
            cut = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
            if count == 4:  # as trimesh does
                cut = np.array([[0, 1, 2], [2, 3, 0]])
            # All first triangles, then all second ones.
            fans = rows[fan][:, cut].transpose(1, 0, 2).reshape(-1, 3)
            clipped = [self._clipped(row) for row in rows[~fan]]
            at = [np.tile(which[fan], len(cut))]
            at += [np.full(len(c), w) for c, w in zip(clipped, which[~fan], strict=True)]
            if count <= 4:
                faces += [fans, *clipped]
            else:
                larger += [fans, *clipped]
                order += at
            bent += self._count_bent(rows)
        if larger:
            faces.append(np.concatenate(larger)[np.argsort(np.concatenate(order), kind="stable")])
        notes = (f"{bent} polygons that are not flat are cut into triangles",) if bent else ()
        none = np.zeros((0, 3), dtype=np.int64)
        return Soup(self.vertices, np.concatenate([none, *faces]), notes)

    def _groups(self) -> Iterator[tuple[Ints, Ints]]:
        """Which polygons (g,) have the same number of corners, and these, (g, count). Those of
        less than three are left out, as they cover nothing."""
        start = np.cumsum(self.counts) - self.counts
        for count in np.unique(self.counts[self.counts >= 3]):
            which = np.flatnonzero(self.counts == count)
            yield which, self.corners[start[which][:, None] + np.arange(count)]

    def _is_fan(self, rows: Ints) -> NDArray[np.bool_]:
        """Whether fans from the first corner of polygons (g, k) stay within them."""
        if rows.shape[1] == 3:
            return np.ones(len(rows), dtype=np.bool_)
        normal = _newell(self.vertices[rows])
        spokes = self.vertices[rows[:, 1:]] - self.vertices[rows[:, :1]]
        areas = (np.cross(spokes[:, :-1], spokes[:, 1:]) * normal[:, None]).sum(axis=2)
        size = (normal * normal).sum(axis=1, keepdims=True)
        fan: NDArray[np.bool_] = (areas > _THIN * size).all(axis=1)
        return fan

    def _count_bent(self, rows: Ints) -> int:
        corners = self.vertices[rows]
        normal = _newell(corners)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        height = ((corners - corners.mean(axis=1, keepdims=True)) * normal[:, None]).sum(axis=2)
        return int((np.abs(height).max(axis=1, initial=0) > _BENT * self._extent).sum())

    @property
    def _extent(self) -> float:
        return float(np.ptp(self.vertices, axis=0).max())

    def _clipped(self, row: Ints) -> Ints:
        """The triangles (m, 3) of one polygon (k,)."""
        corners = self.vertices[row]
        new = (corners != np.roll(corners, 1, axis=0)).any(axis=1)
        row, corners = row[new], corners[new] - corners[0]
        if len(row) <= 3:
            return row.reshape(-1, 3) if len(row) == 3 else np.zeros((0, 3), dtype=np.int64)
        normal = _newell(corners[None])[0]
        area = float(np.linalg.norm(normal)) / 2
        if area == 0:
            return np.zeros((0, 3), dtype=np.int64)
        flat = corners @ _axes(normal / np.linalg.norm(normal))
        cut = np.asarray(manifold3d.triangulate([flat]), dtype=np.int64).reshape(-1, 3)
        sides = flat[cut[:, 1:]] - flat[cut[:, :1]]
        covered = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
        if abs(covered.sum() / 2 - area) > max(1e-6 * area, (_WRONG * self._extent) ** 2):
            x, y, z = self.vertices[row[0]]
            raise UnreadableError(
                f"a polygon of {len(row)} corners at {x:.5g} {y:.5g} {z:.5g} crosses itself; "
                "cut it into triangles"
            )
        triangles: Ints = row[cut]
        return triangles


def _newell(corners: Array) -> Array:
    """Normals (g, 3) of polygons (g, k, 3), of twice their area."""
    spokes = corners - corners[:, :1]
    normal: Array = np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1)
    return normal


def _axes(normal: Array) -> Array:
    """Two axes (3, 2) of a plane, anticlockwise about its unit normal."""
    other = np.zeros(3)
    other[np.abs(normal).argmin()] = 1
    first = np.cross(other, normal)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)], axis=1)


def fans_to_triangles(fan: Ints) -> Ints:
    """The triangles (m, 3) of a fan (k,): each corner but the first two makes one with the one
    before it and the first."""
    middle = np.full(max(len(fan) - 2, 0), fan[0] if len(fan) else 0)
    return np.stack([fan[1:-1], fan[2:], middle], axis=1)


def strips_to_triangles(strip: Ints) -> Ints:
    """The triangles (m, 3) of a strip (k,): each corner makes one with the two before it, and every
    other one is turned round. Negative numbers begin another strip."""
    at = np.arange(max(len(strip) - 2, 0))
    triangles = np.stack([strip[at], strip[at + 1], strip[at + 2]], axis=1)
    breaks = np.flatnonzero(strip < 0)
    begin = np.zeros(len(strip), dtype=np.int64)
    begin[breaks[breaks + 1 < len(strip)] + 1] = breaks[breaks + 1 < len(strip)] + 1
    odd = (at - np.maximum.accumulate(begin)[at]) % 2 == 1
    triangles[odd] = triangles[odd][:, [0, 2, 1]]
    return triangles[(triangles >= 0).all(axis=1)]
