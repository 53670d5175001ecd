"""What touches what at a configuration, and how deep."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from envs import Environment
from envs.problem import Array


@dataclass(frozen=True)
class TouchingPair:
    """Two shapes that touch, or are too near to tell.

    Attributes:
        names: links, or a link and an obstacle, by `Environment.shape_names` and `obstacle_names`.
        distance: in workspace units, never more than it is; 0 where they touch.
        depth: how far the deepest of many points of either's surface is within the other, in
            workspace units; 0 where none is.
    """

    names: tuple[str, str]
    distance: float
    depth: float


def touching_pairs(scene: Environment, q: Array, tolerance: float) -> Iterator[TouchingPair]:
    """The pairs that must not touch and are no more than a tolerance apart at a configuration (d,),
    in workspace units."""
    # What it imports takes a second, which only those who ask pay.
    from envs.collision.penetration import penetration_depth

    pairs = scene.checked_pairs()
    names = [*scene.shape_names, *scene.obstacle_names]
    solids = [*scene.robot.shapes, *(obstacle.solid for obstacle in scene.obstacles)]
    poses = [*scene.robot.poses(q), *(obstacle.pose[:3] for obstacle in scene.obstacles)]
    apart = pairs.distances(q, [2 * tolerance] * len(pairs.numbers))
    for (i, j), distance in zip(pairs.numbers, apart, strict=True):
        if distance <= tolerance:
            depth = 0.0
            if distance <= 0:
                depth = penetration_depth(solids[i], solids[j], poses[i], poses[j])
            yield TouchingPair((names[i], names[j]), distance, depth)
