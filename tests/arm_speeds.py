"""How fast the parts of arms move, and the bounds on that."""

from __future__ import annotations

import numpy as np
import pytest

from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import KinematicTree, Link
from envs.robots.motion_bounds import part_bounds


def greatest_speeds(arm: Arm, a: Array, b: Array, steps: int = 40) -> Array:
    """Of points on each moving part's surface, (moving,), while the numbers change evenly from a to
    b (d,) in unit time."""
    t = np.linspace(0, 1, steps + 1)[:, None]
    return greatest_speeds_on(arm, a + t * (b - a))


def greatest_speeds_on(arm: Arm, way: Array) -> Array:
    """The same at places (k, d) of a motion, one after another in equal times: the longest chords
    by the time they take, which is never more than the highest speed."""
    parts, steps = arm.parts[: arm.moving], len(way) - 1
    links = tuple(Link("", part.body, part.placed.pose) for part in parts)
    poses = KinematicTree(arm.tree.joints, links, arm.tree.parents).forward(way)
    found = []
    for number, part in enumerate(parts):
        points = part.placed.solid.triangulate().vertices
        turn, shift = poses[:, number, :3, :3], poses[:, number, None, :3, 3]
        places = points @ turn.transpose(0, 2, 1) + shift
        found.append(steps * np.linalg.norm(np.diff(places, axis=0), axis=2).max())
    return np.array(found)


def bounds_of(arm: Arm, a: Array, b: Array) -> Array:
    bounds = np.empty(arm.moving)
    part_bounds(arm.arrays, a, b, bounds)
    return bounds


def assert_bounded(arm: Arm, a: Array, b: Array) -> Array:
    speeds, bounds = greatest_speeds(arm, a, b), bounds_of(arm, a, b)
    assert (speeds <= bounds + 1e-9).all()
    assert arm.motion_bound(a, b) == bounds.max()
    assert bounds.max() <= arm.rate_bound * np.linalg.norm(b - a) + 1e-9
    assert bounds == pytest.approx(bounds_of(arm, b, a))
    return speeds / bounds
