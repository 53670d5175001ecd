"""How fast a motion moves the parts of an arm, and brings them nearer to each other, at most:
compiled bounds, by which certified checks go."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.collision.gjk import at
from envs.compiled import njit_cached, njit_hot
from envs.robots.kinematic_tree import body_poses


@njit_cached
def part_bounds(arm: Any, a: Any, b: Any, bounds: Any) -> None:
    """Writes bounds (moving,) as `motion_bounds` does, that of a part no less than those of its
    pairs with parts of lower bodies."""
    nearing = np.empty(len(arm.branches))
    motion_bounds(arm, a, b, bounds, nearing)
    for n in range(len(nearing)):
        part = arm.branches[n, 0]
        bounds[part] = max(bounds[part], nearing[n])


@njit_cached
def motion_bounds(arm: Any, a: Any, b: Any, bounds: Any, nearing: Any) -> None:
    """Writes bounds (moving,) on the speed of any point of each part, in metres per unit of t,
    while the configuration moves as a + t (b - a), t in [0, 1]; and (k,) on the speed at which the
    parts of each pair of `branches` come nearer.

    Joint i moves a point by its change times the point's distance from its axis, which is at most
    what it is in the middle of the motion, and what the joints between add by then. That holds for
    every joint on the way from the part to the base, and what several do adds up at most, also
    where they follow the same coordinate.

    What both parts of a pair are on moves them as one. Seen from the body on which they branch, the
    distance of the two changes no faster than both of them move. Where one is on the other, that is
    by part of what moves the outer one; on two branches it may be more than either's own.
    """
    tree = arm.tree
    m = len(tree.parents)
    half, steps = np.empty(m), np.zeros((len(arm.bodies), m))
    for i in range(m):
        k = tree.coordinates[i]
        half[i] = abs(tree.ratios[i]) * (abs(b[k] - a[k]) / 2)
    bodies = np.empty((1 + m, 3, 4))
    body_poses(tree, (a + b) / 2, bodies)
    for part in range(arm.moving):
        body = arm.bodies[part]
        pose = bodies[body]
        x, y, z = at(pose, arm.middles[part])
        bounds[part] = 0.0
        later = 0.0  # by how much the joints after i may move the part within half the motion
        while body > 0:
            i = body - 1
            reach = arm.reach[i, part]
            if not tree.prismatic[i]:
                reach = min(reach, _from_axis(arm, bodies, i, x, y, z) + arm.radii[part] + later)
            steps[part, i] = 2 * half[i] * reach
            bounds[part] += steps[part, i]
            later += half[i] * arm.reach[i, part]
            body = tree.parents[i]
    for n in range(len(nearing)):
        part, other, branch = arm.branches[n]
        nearing[n] = _moved_since(arm, steps, part, branch)
        nearing[n] += _moved_since(arm, steps, other, branch)


@njit_hot
def _moved_since(arm: Any, steps: Any, part: int, branch: int) -> float:
    """How far a part moves, at most, as seen from a body that it is on, by what each joint moves
    it, (p, m)."""
    moved, body = 0.0, arm.bodies[part]
    while body != branch:
        moved += steps[part, body - 1]
        body = arm.tree.parents[body - 1]
    return moved


@njit_cached
def _from_axis(arm: Any, bodies: Any, joint: int, x: float, y: float, z: float) -> float:
    """The distance of a point from the axis of a joint, whose body's pose is in `bodies`."""
    pose = bodies[joint + 1]
    axis = arm.tree.axes[joint]
    ux = pose[0, 0] * axis[0] + pose[0, 1] * axis[1] + pose[0, 2] * axis[2]
    uy = pose[1, 0] * axis[0] + pose[1, 1] * axis[1] + pose[1, 2] * axis[2]
    uz = pose[2, 0] * axis[0] + pose[2, 1] * axis[1] + pose[2, 2] * axis[2]
    dx, dy, dz = x - pose[0, 3], y - pose[1, 3], z - pose[2, 3]
    cx, cy, cz = dy * uz - dz * uy, dz * ux - dx * uz, dx * uy - dy * ux
    return math.sqrt(cx * cx + cy * cy + cz * cz)
