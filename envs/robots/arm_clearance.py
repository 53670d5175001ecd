"""Clearances of arms among obstacles from spheres that cover the links, compiled.

They are never more than the true ones, and less by about `envs.robots.arm.SLACK`; at flat ends and
edges of links by more. What is proved free with them is free. Clearances of links from each other
are the true ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.continuous import compiled_is_covered
from envs.collision.gjk import at, moved
from envs.collision.part_scenes import PartScenes, scene_of
from envs.collision.primitive_sdf import NO_OBSTACLE, nearest
from envs.collision.separation import are_beyond, separated
from envs.collision.shapes import ROW
from envs.compiled import njit_cached, njit_hot, parallel_for
from envs.problem import Array
from envs.robots.arm import RobotArrays, motion_bounds
from envs.robots.kinematic_tree import body_poses

NEAR = 0.03
"""Metres up to which links that are meshes are asked how far their surfaces are apart."""

TOUCHING = -1e-9
"""The clearance where something touches, which says no more than that."""

_BLOCK = 4096
"""Configurations that a thread takes at a time."""


def clearances(arm: RobotArrays, scenes: PartScenes, q: Array) -> Array:
    """Clearances (n,) at configurations (n, d), in metres, on as many threads as Numba may use."""
    found = np.empty(len(q))
    q = np.ascontiguousarray(q, dtype=np.float64)
    parallel_for(lambda part: _clearances(arm, scenes, q[part], found[part]), len(q), _BLOCK)
    return found


def paths_are_free(
    arm: RobotArrays, scenes: PartScenes, paths: Sequence[Array], tolerance: float
) -> NDArray[np.bool_]:
    """Which paths, each (k, d), are proved free, (n,) of bool; see `segment_is_free`."""
    ready = (np.ascontiguousarray(path, dtype=np.float64) for path in paths)
    return np.array([_path_is_free(arm, scenes, path, tolerance) for path in ready], dtype=np.bool_)


@njit_cached
def part_clearances(arm: Any, scenes: Any, q: Any, clearances: Any, most: float) -> float:
    """Writes the clearances (moving,) of the parts at a configuration (d,), or `most` where that is
    less; the least of them is returned. Where parts must not touch each other, that counts for the
    one of the greater body, whose bound (see `part_bounds`) says how fast the two come nearer."""
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    body_poses(arm.tree, q, bodies)
    clearances[:] = most
    _from_obstacles(arm, scenes, bodies, clearances)
    if len(arm.branches) > 0:
        rows = moved_rows(arm, bodies)
        for n in range(len(arm.branches)):
            part, other = arm.branches[n, 0], arm.branches[n, 1]
            clearances[part] = apart(arm, bodies, rows, part, other, clearances[part])[0]
    least: float = clearances.min()
    return least


@njit_hot
def _from_obstacles(arm: Any, scenes: Any, bodies: Any, clearances: Any) -> None:
    """Lowers clearances (moving,) of the parts to those of the spheres that cover them from
    obstacles, with the bodies at poses (1 + j, 3, 4)."""
    for part in range(arm.moving):
        clearances[part] = _of_part(arm, scenes, bodies[arm.bodies[part]], part, clearances[part])


@njit_hot
def _of_part(arm: Any, scenes: Any, pose: Any, part: int, most: float) -> float:
    """The clearance of a part from obstacles, whose body is at a pose (3, 4), or `most`."""
    scene = scene_of(scenes, part)
    x, y, z = at(pose, arm.middles[part])
    if nearest(scene, x, y, z, most + arm.extents[part])[1] == NO_OBSTACLE:
        return most  # all of its spheres are farther away
    least = most
    for ball in range(arm.first_balls[part], arm.first_balls[part + 1]):
        x, y, z = at(pose, arm.balls[ball])
        radius = arm.balls[ball, 3]
        least = nearest(scene, x, y, z, least + radius)[0] - radius
    return least


@njit_cached
def moved_rows(arm: Any, bodies: Any) -> Any:
    """The rows (p, ROW) of the parts where the bodies are, at poses (1 + j, 3, 4)."""
    rows = np.empty((len(arm.bodies), ROW))
    for part in range(len(rows)):
        moved(arm.shapes.rows[part], bodies[arm.bodies[part]], rows[part])
    return rows


@njit_cached
def apart(
    arm: Any, bodies: Any, rows: Any, part: int, other: int, most: float
) -> tuple[float, bool]:
    """The distance of two parts, or `most` if that is less, and whether it is known that neither is
    within the other. Of meshes at least that of their hulls, and at most `NEAR` where these do not
    tell more; any nearer it is exact."""
    if are_beyond(rows[part], rows[other], most):
        return most, True
    enough = within_reach(arm.shapes, part, arm.shapes, other, most)
    found, known = separated(
        arm.shapes,
        part,
        rows[part],
        bodies[arm.bodies[part]],
        arm.shapes,
        other,
        rows[other],
        bodies[arm.bodies[other]],
        enough,
    )
    return min(most, found if found > 0.0 else TOUCHING), known


@njit_hot
def within_reach(shapes: Any, i: int, others: Any, j: int, most: float) -> float:
    """How far the surfaces of two shapes are asked for their distance, at most `most`: any farther
    the hulls of meshes tell enough, in less time."""
    if shapes.roots[i] >= 0 or others.roots[j] >= 0:
        return min(most, NEAR)
    return most


@njit_cached
def _clearances(arm: Any, scenes: Any, q: Any, clearances: Any) -> None:
    if len(arm.branches) > 0:
        parts = np.empty(arm.moving)
        for n in range(len(q)):
            clearances[n] = part_clearances(arm, scenes, q[n], parts, np.inf)
        return
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    for n in range(len(q)):
        body_poses(arm.tree, q[n], bodies)
        clearances[n] = _least(arm, scenes, bodies)


@njit_hot
def _least(arm: Any, scenes: Any, bodies: Any) -> float:
    """The least of the parts' clearances from obstacles. Those farther out come first: they are
    nearer to things, and then most others are seen to be farther away at a glance."""
    least = np.inf
    for part in range(arm.moving - 1, -1, -1):
        least = _of_part(arm, scenes, bodies[arm.bodies[part]], part, least)
    return least


@njit_cached
def segment_is_free(arm: Any, scenes: Any, a: Any, b: Any, tolerance: float) -> bool:
    """Whether the straight motion from a to b (d,) is proved free of collision.

    As `envs.collision.continuous.segment_is_free`, but with a bound for each part: those near the
    base move little, and may be near obstacles; and one for each pair of parts: links of a wrist
    are near each other wherever it moves them.
    """
    bounds, parts = np.empty(arm.moving), np.empty(arm.moving)
    nearing = np.empty(len(arm.branches))
    motion_bounds(arm, a, b, bounds, nearing)
    motion = (arm, scenes, a, b, tolerance, bounds, nearing, parts)
    return compiled_is_covered(_share_free, motion, 1.0)


@njit_cached
def _share_free(motion: Any, t: float) -> float:
    """How much of a motion about t is proved free, or -1 where it is not."""
    arm, scenes, a, b, tolerance, bounds, nearing, parts = motion
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    body_poses(arm.tree, a + t * (b - a), bodies)
    for part in range(arm.moving):  # farther away than this is far enough for all of the motion
        parts[part] = bounds[part] + 2 * tolerance
    _from_obstacles(arm, scenes, bodies, parts)
    if parts.min() <= tolerance:
        return -1.0
    share: float = np.inf
    for part in range(arm.moving):
        if bounds[part] > 0:
            share = min(share, (parts[part] - tolerance / 2) / bounds[part])
    if len(nearing) == 0:
        return share
    rows = moved_rows(arm, bodies)
    return share_of_pairs(arm, bodies, rows, nearing, tolerance, tolerance / 2, share)[0]


@njit_cached
def share_of_pairs(
    arm: Any, bodies: Any, rows: Any, nearing: Any, asked: float, kept: float, share: float
) -> tuple[float, bool]:
    """How much of a motion is proved to keep more than `kept`, at most `share`, by how far the
    pairs of parts are apart and how fast they come nearer, (k,); -1 where two are no more than
    `asked` apart. And whether it is known that none is within the other."""
    known = True
    share = min(share, 1.0)  # which is all of the motion, from wherever on it
    for n in range(len(nearing)):
        # Farther apart than this, the two do not lessen the share.
        enough = max(share * nearing[n] + kept, 2 * asked - kept)
        found, is_known = apart(arm, bodies, rows, arm.branches[n, 0], arm.branches[n, 1], enough)
        if found <= asked:
            return -1.0, False
        known = known and is_known
        if nearing[n] > 0:
            share = min(share, (found - kept) / nearing[n])
    return share, known


@njit_cached
def _path_is_free(arm: Any, scenes: Any, path: Any, tolerance: float) -> bool:
    if len(path) == 1:
        return segment_is_free(arm, scenes, path[0], path[0], tolerance)
    for n in range(len(path) - 1):
        if not segment_is_free(arm, scenes, path[n], path[n + 1], tolerance):
            return False
    return True
