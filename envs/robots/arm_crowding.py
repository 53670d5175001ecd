"""What an arm is too near to, in words: why a world has too few problems."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import PlacedShape
from envs.problem import Array
from envs.robots.arm import Arm

_NAMED = 3
"""Causes that are named, the most frequent ones."""


def causes(
    arm: Arm, obstacles: Sequence[PlacedShape], q: Array, clear: float, kept: Array
) -> list[str]:
    """What is too near at some of the configurations (n, d), the most frequent first.

    Args:
        arm: the robot.
        obstacles: what is about it.
        q: where to look.
        clear: what links keep from obstacles, in metres.
        kept: (p, p) what parts keep from each other, in metres.
    """
    shapes = shapes_of([*(part.placed for part in arm.parts), *obstacles])
    parts, still = len(arm.parts), np.eye(3, 4)
    too_near: dict[str, set[int]] = {}
    for n, one in enumerate(q):
        poses = arm.body_poses(one)
        at = [*(poses[part.body] for part in arm.parts), *(still for _ in obstacles)]
        pairs = [(i, j, float(kept[i, j]), _of_links(arm, i, j)) for i, j in arm.pairs]
        pairs += [
            (i, parts + k, clear, _of_obstacle(arm, i, k, obstacles[k]))
            for i, k in product(range(arm.moving), range(len(obstacles)))
        ]
        for i, j, most, name in pairs:
            if separations(shapes, i, j, np.array([[at[i], at[j]]]), most)[0] < most:
                too_near.setdefault(name, set()).add(n)
    often = sorted(too_near.items(), key=lambda item: -len(item[1]))
    return [f"{name} in {len(which) / len(q):.0%}" for name, which in often[:_NAMED]]


def _of_links(arm: Arm, i: int, j: int) -> str:
    first, second = sorted((arm.links[i], arm.links[j]))
    return f"links {first!r} and {second!r} to each other"


def _of_obstacle(arm: Arm, part: int, number: int, obstacle: PlacedShape) -> str:
    return f"link {arm.links[part]!r} to obstacle {number + 1} (a {obstacle.solid.kind})"
