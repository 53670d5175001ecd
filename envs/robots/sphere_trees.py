"""Trees of spheres that cover the parts of robots, for compiled proofs.

The leaves are the spheres that cover a part. A sphere above holds the leaves below it: what keeps
away from it keeps away from these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.mesh import queries
from envs.collision.primitive_sdf import to_solid
from envs.collision.shapes import Mesh, PlacedShape
from envs.compiled import njit_cached
from envs.problem import Array
from envs.robots.arm import SLACK

_STEPS = 20
"""Toward the centre of a sphere that holds others."""

_CHILDREN = 4
"""Of a sphere that is no leaf, at most."""

_MESH_SLACK = 0.003
"""As `SLACK`, of meshes, whose distances take long."""

NONE_INSIDE = -np.inf
"""The radius of a sphere within a part where none is known to be."""


class SphereTrees(NamedTuple):
    """Trees of p parts, as compiled code sees them, each sphere before those below it.

    Attributes:
        centers: (n, 3) in the frames of the parts' bodies, in metres.
        radii: (n,) in metres.
        skips: (n,) the number after the last that is below each; of a leaf the next.
        inner: (n,) radii about the leaves' centres of spheres that are wholly within the part; of
            others how far from their centres such spheres of leaves below them reach, at most.
            `NONE_INSIDE` where none is known.
        firsts: (p + 1,) where each part's begin: with the one that holds all of it.
        beyond: (p,) how far centres are outside of the sphere that holds the part, at most.
    """

    centers: Array
    radii: Array
    skips: NDArray[np.int64]
    inner: Array
    firsts: NDArray[np.int64]
    beyond: Array


def sphere_trees(parts: Sequence[PlacedShape]) -> SphereTrees:
    """The trees of parts: p solids, placed in the frames of their bodies."""
    rows: list[tuple[Array, float, int, float]] = []
    firsts, beyond = [0], []
    for part in parts:
        slack = _MESH_SLACK if isinstance(part.solid, Mesh) else SLACK
        spheres = part.solid.sphere_cover(slack)
        centers = spheres.centers @ part.pose[:3, :3].T + part.pose[:3, 3]
        _add(rows, centers, spheres.radii, _inner_radii(part, centers))
        middle, radius = part.solid.bounding_sphere()
        middle = part.pose[:3, :3] @ middle + part.pose[:3, 3]
        away = [float(np.linalg.norm(row[0] - middle)) for row in rows[firsts[-1] :]]
        beyond.append(max(0.0, max(away) - radius))
        firsts.append(len(rows))
    centers, radii, skips, inner = zip(*rows, strict=True)
    return SphereTrees(
        np.array(centers),
        np.array(radii),
        np.array(skips),
        np.array(inner),
        np.array(firsts),
        np.array(beyond),
    )


def _add(
    rows: list[tuple[Array, float, int, float]], centers: Array, radii: Array, inner: Array
) -> None:
    """Adds the tree of some leaves."""
    if len(centers) == 1:
        rows.append((centers[0], float(radii[0]), len(rows) + 1, float(inner[0])))
        return
    number = len(rows)
    rows.append((centers[0], 0.0, 0, NONE_INSIDE))
    for some in _groups(centers):
        _add(rows, centers[some], radii[some], inner[some])
    center = _middle(centers, radii)
    radius = float((np.linalg.norm(centers - center, axis=1) + radii).max())
    deep = float((np.linalg.norm(centers - center, axis=1) + inner).max())
    rows[number] = center, radius * (1 + 1e-12), len(rows), deep


@njit_cached
def _middle(centers: Any, radii: Any) -> Any:
    """About the centre (3,) of the least sphere that holds others: it goes toward the farthest of
    them by ever smaller steps (Badoiu and Clarkson 2003)."""
    middle = np.zeros(3)
    for i in range(3):
        middle[i] = ((centers[:, i] - radii).min() + (centers[:, i] + radii).max()) / 2
    for step in range(_STEPS):
        most, farthest = -1.0, 0
        for n in range(len(centers)):
            away = np.sqrt(((centers[n] - middle) ** 2).sum()) + radii[n]
            if away > most:
                most, farthest = away, n
        middle += (centers[farthest] - middle) / (step + 2)
    return middle


def _groups(centers: Array) -> list[NDArray[np.int64]]:
    """Parts leaves into few groups that lie close together, each halved across its longest side."""
    groups = [np.arange(len(centers))]
    while len(groups) < min(_CHILDREN, len(centers)):
        spread = [
            np.ptp(centers[group], axis=0).max() if len(group) > 1 else -1 for group in groups
        ]
        widest = groups.pop(int(np.argmax(spread)))
        axis = int(np.ptp(centers[widest], axis=0).argmax())
        order = widest[np.argsort(centers[widest, axis], kind="stable")]
        groups += [order[: len(order) // 2], order[len(order) // 2 :]]
    return groups


def _inner_radii(part: PlacedShape, centers: Array) -> Array:
    """Radii (n,) about places in the frame of the part's body; see `SphereTrees.inner`."""
    solid = part.solid
    if isinstance(solid, Mesh):
        local = (centers - part.pose[:3, 3]) @ part.pose[:3, :3]
        asked = queries(solid)
        if asked.filled.has_holes:  # whether something is within cannot be told by a place alone
            return np.full(len(centers), NONE_INSIDE)
        return np.where(asked.is_inside(local), asked.distance(local), NONE_INSIDE)
    depth = -_to_solid(solid.distance_row(part.pose), centers)
    return np.where(depth >= 0, depth, NONE_INSIDE)


@njit_cached
def _to_solid(row: Any, points: Any) -> Any:
    """Signed distances (n,) of points (n, 3) from a solid, see `to_solid`."""
    found = np.empty(len(points))
    rows = row.reshape(1, -1)
    for n in range(len(points)):
        found[n] = to_solid(rows, 0, points[n, 0], points[n, 1], points[n, 2])
    return found
