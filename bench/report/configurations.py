"""An arm's surface and tool tip in postures, and the postures along a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from envs.collision.shapes import Cylinder, Obstacle, PlacedShape
from envs.problem import Array
from envs.robots.arm import Arm
from envs.scenes.arm_world import ArmWorld

_DRAWS = 4000
"""Postures among which one is sought that is free of collision."""

_STAND_SHARE, _WIDEST_STAND = 0.4, 0.1
"""The radius of a stand that is made up: by the height of the first joint; at most, in metres."""

_END = 0.98
"""What is farther out, by the farthest point of a tool, is its end."""


def triangles_of(obstacles: Sequence[Obstacle]) -> Array:
    """The surfaces (n, 3, 3) of solids and obstacles, in the frame that they are placed in."""
    surfaces = [np.asarray(obstacle.triangulate().triangles) for obstacle in obstacles]
    return np.concatenate([np.zeros((0, 3, 3)), *surfaces])


def along(path: Array, shares: Array) -> Array:
    """Configurations (n, d) at shares (n,) of the length of a path (k, d), from 0 to 1."""
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.stack([np.interp(shares * at[-1], at, joint) for joint in path.T], axis=1)


def free_posture(env: ArmWorld) -> Array:
    """A configuration (d,) without contact: all joints at 0, or what reaches up the highest among
    many draws. Where the arm has no room at all, all joints as close to 0 as they may be."""
    rest = np.zeros(env.dimension).clip(env.lower, env.upper)
    if env.clearance(rest[None])[0] > 0:
        return rest
    draws = np.random.default_rng(0).uniform(env.lower, env.upper, (_DRAWS, env.dimension))
    draws = draws[env.approximate_clearance(draws) >= env.min_clearance]
    if len(draws) == 0:
        return rest
    heights = ArmShape(env.robot).tips(draws)[:, 2]
    highest: Array = draws[int(np.argmax(heights))]
    return highest


class ArmShape:
    """The surfaces of an arm.

    Attributes:
        base: triangles (n, 3, 3) of what does not move.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        moving, fixed = arm.parts[: arm.moving], arm.parts[arm.moving :]
        self._surfaces = [triangles_of([part.placed.solid]) for part in moving]
        self._tip = self._tip_of_last_link()
        self.base = triangles_of([part.placed for part in fixed] or _stand(arm))

    def triangles(self, q: Array) -> Array:
        """The surface (n, 3, 3) of what moves, at a configuration (d,)."""
        return np.concatenate(
            [
                surface @ (np.eye(3) if turn is None else turn).T + shift
                for surface, (turn, shift) in zip(self._surfaces, self._arm.poses(q), strict=False)
            ]
        )

    def tips(self, q: Array) -> Array:
        """Where the tip of the tool is, (n, 3), at configurations (n, d)."""
        poses = self._arm.tree.forward(q)[:, -1]
        found: Array = poses[:, :3, :3] @ self._tip + poses[:, :3, 3]
        return found

    def _tip_of_last_link(self) -> Array:
        """Its frame's origin, as of a tool without solids, or the far end of the solids that move
        with it, whichever is farther from the last joint: (3,) in its frame."""
        last = self._arm.tree.links[-1]
        to_link = np.linalg.inv(last.offset)
        carried = [part.placed for part in self._arm.parts if part.body == last.body]
        corners = triangles_of(carried).reshape(-1, 3)
        far = np.linalg.norm(corners, axis=1)
        if len(far) == 0 or far.max() <= np.linalg.norm(last.offset[:3, 3]):
            return np.zeros(3)
        end = np.unique(corners[far > _END * far.max()].round(9), axis=0).mean(axis=0)
        tip: Array = to_link[:3, :3] @ end + to_link[:3, 3]
        return tip


def _stand(arm: Arm) -> list[PlacedShape]:
    """What holds an arm up of which the base's solids are not known: from the origin to the first
    joint."""
    to_joint = arm.tree.joints[0].origin[:3, 3]
    height = float(np.linalg.norm(to_joint))
    if height < 1e-3:
        return []
    pose = np.asarray(trimesh.geometry.align_vectors([0, 0, 1], to_joint))  # type: ignore[no-untyped-call]
    pose[:3, 3] = to_joint / 2
    return [PlacedShape(Cylinder(min(_STAND_SHARE * height, _WIDEST_STAND), height), pose)]
