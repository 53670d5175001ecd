"""Clearances of arms among obstacles from spheres that cover the links, compiled.

They are never more than the true ones, and less by about `envs.robots.arm.SLACK`; at flat ends and
edges of links by more. What is proved free with them is free. Clearances of links from each other
are the true ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.continuous import compiled_is_covered
from envs.collision.gjk import at, moved
from envs.collision.primitive_sdf import NO_OBSTACLE, SceneArrays, nearest, to_solid
from envs.collision.separation import separation
from envs.collision.shapes import MESH, ROW
from envs.compiled import njit_cached, njit_hot, parallel_for
from envs.problem import Array
from envs.robots.arm import RobotArrays, motion_bounds
from envs.robots.kinematic_tree import body_poses

_NEAR = 0.03
"""Metres up to which links that are meshes are asked how far they are apart."""

TOUCHING = -1e-9
"""The clearance where something touches, which says no more than that."""

_BLOCK = 4096
"""Configurations that a thread takes at a time."""


def clearances(arm: RobotArrays, scene: SceneArrays, q: Array) -> Array:
    """Clearances (n,) at configurations (n, d), in metres, on as many threads as Numba may use."""
    found = np.empty(len(q))
    q = np.ascontiguousarray(q, dtype=np.float64)
    parallel_for(lambda part: _clearances(arm, scene, q[part], found[part]), len(q), _BLOCK)
    return found


def paths_are_free(
    arm: RobotArrays, scene: SceneArrays, paths: Sequence[Array], tolerance: float
) -> NDArray[np.bool_]:
    """Which paths, each (k, d), are proved free, (n,) of bool; see `segment_is_free`."""
    ready = (np.ascontiguousarray(path, dtype=np.float64) for path in paths)
    return np.array([_path_is_free(arm, scene, path, tolerance) for path in ready], dtype=np.bool_)


@njit_cached
def part_clearances(arm: Any, scene: Any, q: Any, clearances: Any, most: float) -> float:
    """Writes the clearances (moving,) of the parts at a configuration (d,), or `most` where that is
    less; the least of them is returned. Where parts must not touch each other, that counts for the
    one of the greater body, whose bound (see `part_bounds`) says how fast the two come nearer."""
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    body_poses(arm.tree, q, bodies)
    balls = np.empty((len(arm.balls), 3))
    clearances[:] = most
    _from_obstacles(arm, scene, bodies, balls, clearances)
    if len(arm.branches) > 0:
        _against_itself(arm, bodies, balls, clearances)
    least: float = clearances.min()
    return least


@njit_cached
def _from_obstacles(arm: Any, scene: Any, bodies: Any, balls: Any, clearances: Any) -> None:
    """Lowers clearances (moving,) of the parts to those from obstacles, and writes where the
    spheres that cover all parts are, (m, 3), with the bodies at poses (1 + j, 3, 4)."""
    for ball in range(len(arm.balls)):
        part = arm.ball_parts[ball]
        x, y, z = at(bodies[arm.bodies[part]], arm.balls[ball])
        balls[ball, 0], balls[ball, 1], balls[ball, 2] = x, y, z
        if part < arm.moving:
            radius = arm.balls[ball, 3]
            clearances[part] = nearest(scene, x, y, z, clearances[part] + radius)[0] - radius


@njit_cached
def _against_itself(arm: Any, bodies: Any, balls: Any, clearances: Any) -> None:
    """Lowers clearances to those from other parts, which count once for each pair: for the part
    whose bound knows of the other."""
    rows = _moved_rows(arm, bodies)
    for n in range(len(arm.branches)):
        part, other = arm.branches[n, 0], arm.branches[n, 1]
        clearances[part] = _apart(arm, bodies, balls, rows, part, other, clearances[part])


@njit_cached
def _moved_rows(arm: Any, bodies: Any) -> Any:
    """The rows of the parts where the bodies are."""
    rows = np.empty((len(arm.bodies), ROW))
    for part in range(len(rows)):
        moved(arm.shapes.rows[part], bodies[arm.bodies[part]], rows[part])
    return rows


@njit_cached
def _apart(
    arm: Any, bodies: Any, balls: Any, rows: Any, part: int, other: int, most: float
) -> float:
    """The distance of two parts, or `most` if that is less. Of meshes it is that of their spheres
    at `balls` (m, 3) while these are `_NEAR` apart, and at most `_NEAR` if they are not. Any nearer
    it is exact: the spheres of two links side by side may overlap wherever these are."""
    ax, ay, az = at(bodies[arm.bodies[part]], arm.middles[part])
    bx, by, bz = at(bodies[arm.bodies[other]], arm.middles[other])
    between = math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)
    # What holds a part's spheres holds the part. Most pairs are seen to be far apart by this.
    if between - arm.extents[part] - arm.extents[other] >= most:
        return most
    if arm.shapes.roots[part] >= 0 or arm.shapes.roots[other] >= 0:
        apart = _distance_of_spheres(arm, balls, part, other, rows)
        if apart >= min(most, _NEAR):
            return min(most, apart)
        most = min(most, _NEAR)  # a lower bound is enough
    apart = separation(
        arm.shapes,
        part,
        rows[part],
        bodies[arm.bodies[part]],
        arm.shapes,
        other,
        rows[other],
        bodies[arm.bodies[other]],
        most,
    )
    return min(most, apart if apart > 0.0 else TOUCHING)


@njit_cached
def _distance_of_spheres(arm: Any, balls: Any, part: int, other: int, rows: Any) -> float:
    """The least distance of the spheres of one part from those of another. Where one is no mesh
    it stands for its own spheres, which reach far out of flat ends."""
    if rows[part, 16] != MESH:
        part, other = other, part
    least = np.inf
    for a in range(arm.first_balls[part], arm.first_balls[part + 1]):
        x, y, z, radius = balls[a, 0], balls[a, 1], balls[a, 2], arm.balls[a, 3]
        if rows[other, 16] != MESH:
            least = min(least, to_solid(rows, other, x, y, z) - radius)
            continue
        for b in range(arm.first_balls[other], arm.first_balls[other + 1]):
            squared = (x - balls[b, 0]) ** 2 + (y - balls[b, 1]) ** 2 + (z - balls[b, 2]) ** 2
            least = min(least, math.sqrt(squared) - radius - arm.balls[b, 3])
    return least


@njit_cached
def _clearances(arm: Any, scene: Any, q: Any, clearances: Any) -> None:
    if len(arm.branches) > 0:
        parts = np.empty(arm.moving)
        for n in range(len(q)):
            clearances[n] = part_clearances(arm, scene, q[n], parts, np.inf)
        return
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    for n in range(len(q)):
        body_poses(arm.tree, q[n], bodies)
        clearances[n] = _least(arm, scene, bodies)


@njit_hot
def _least(arm: Any, scene: Any, bodies: Any) -> float:
    """The least of the parts' clearances from obstacles. Those farther out come first: they are
    nearer to things, and then most others are seen to be farther away at a glance."""
    least = np.inf
    for part in range(arm.moving - 1, -1, -1):
        pose = bodies[arm.bodies[part]]
        x, y, z = at(pose, arm.middles[part])
        if nearest(scene, x, y, z, least + arm.extents[part])[1] == NO_OBSTACLE:
            continue
        for ball in range(arm.first_balls[part], arm.first_balls[part + 1]):
            x, y, z = at(pose, arm.balls[ball])
            radius = arm.balls[ball, 3]
            least = nearest(scene, x, y, z, least + radius)[0] - radius
    return least


@njit_cached
def segment_is_free(arm: Any, scene: Any, a: Any, b: Any, tolerance: float) -> bool:
    """Whether the straight motion from a to b (d,) is proved free of collision.

    As `envs.collision.continuous.segment_is_free`, but with a bound for each part: those near the
    base move little, and may be near obstacles; and one for each pair of parts: links of a wrist
    are near each other wherever it moves them.
    """
    bounds, parts = np.empty(arm.moving), np.empty(arm.moving)
    nearing = np.empty(len(arm.branches))
    motion_bounds(arm, a, b, bounds, nearing)
    motion = (arm, scene, a, b, tolerance, bounds, nearing, parts)
    return compiled_is_covered(_share_free, motion, 1.0)


@njit_cached
def _share_free(motion: Any, t: float) -> float:
    """How much of a motion about t is proved free, or -1 where it is not."""
    arm, scene, a, b, tolerance, bounds, nearing, parts = motion
    bodies = np.empty((1 + len(arm.tree.parents), 3, 4))
    body_poses(arm.tree, a + t * (b - a), bodies)
    balls = np.empty((len(arm.balls), 3))
    parts[:] = np.inf
    _from_obstacles(arm, scene, bodies, balls, parts)
    if parts.min() <= tolerance:
        return -1.0
    share: float = np.inf
    for part in range(arm.moving):
        if bounds[part] > 0:
            share = min(share, (parts[part] - tolerance / 2) / bounds[part])
    if len(nearing) == 0:
        return share
    share = min(share, 1.0)  # which is all of the motion, from wherever on it
    rows = _moved_rows(arm, bodies)
    for n in range(len(nearing)):
        # Farther apart than this, the two do not lessen the share.
        enough = max(share * nearing[n] + tolerance / 2, 2 * tolerance)
        part, other = arm.branches[n, 0], arm.branches[n, 1]
        apart = _apart(arm, bodies, balls, rows, part, other, enough)
        if apart <= tolerance:
            return -1.0
        if nearing[n] > 0:
            share = min(share, (apart - tolerance / 2) / nearing[n])
    return share


@njit_cached
def _path_is_free(arm: Any, scene: Any, path: Any, tolerance: float) -> bool:
    if len(path) == 1:
        return segment_is_free(arm, scene, path[0], path[0], tolerance)
    for n in range(len(path) - 1):
        if not segment_is_free(arm, scene, path[n], path[n + 1], tolerance):
            return False
    return True
