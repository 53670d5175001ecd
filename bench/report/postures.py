"""A robot's surface in postures, what it stands on, and its postures along a path."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from envs import Environment
from envs.collision.shapes import Bodies, Obstacle
from envs.problem import Array
from envs.spaces import Space

_DRAWS = 4000
"""Postures among which one is sought that is free of collision."""

_REACHED = 2000
"""Postures by which it is seen how far a robot reaches."""

_FAR_OUT = 10
"""How far out of bounds configurations are still shown, by the extent of the bounds."""


def triangles_of(obstacles: Sequence[Obstacle]) -> Array:
    """The surfaces (n, 3, 3) of solids and obstacles, in the frame that they are placed in."""
    surfaces = [np.asarray(obstacle.triangulate().triangles) for obstacle in obstacles]
    return np.concatenate([np.zeros((0, 3, 3)), *surfaces])


def along(space: Space, path: Array, shares: Array) -> Array:
    """Configurations (n, d) at shares (n,) of the length of a path (k, d), from 0 to 1."""
    following = np.concatenate([path[1:], path[-1:]])  # at the end it stays where it is
    lengths = space.distance(path, following)
    begins = np.concatenate([[0.0], np.cumsum(lengths[:-1])])
    at = shares * begins[-1]
    piece = np.searchsorted(begins, at, side="right") - 1
    rest = np.divide(at - begins[piece], lengths[piece], where=lengths[piece] > 0, out=0 * at)
    return space.interpolate(path[piece], following[piece], rest.clip(0, 1))


def drawable(env: Environment, path: Array) -> bool:
    """Whether an array is a path of this environment that is anywhere near its bounds, and of
    which quaternions are rotations."""
    if path.ndim != 2 or len(path) == 0 or path.shape[1] != env.space.size:
        return False
    sizes = [part.size for part in env.space.parts]
    numbers = np.split(path, np.cumsum(sizes)[:-1], axis=1)
    rotate = all(
        part.contains(own).all()
        for part, own in zip(env.space.parts, numbers, strict=True)
        if part.size > part.dimension
    )
    # Not a number is nowhere.
    near = np.abs(path - env.lower) <= _FAR_OUT * (env.upper - env.lower)
    return rotate and bool(near.all())


def free_posture(env: Environment) -> Array:
    """A configuration (d,) without contact: all numbers at 0, or what reaches up the highest among
    many draws. Where there is no room at all, all numbers as close to 0 as they may be, or any
    configuration."""
    rest = np.zeros(env.space.size).clip(env.lower, env.upper)
    draws = env.space.sample(np.random.default_rng(0), _DRAWS)
    if not env.contains(rest[None])[0]:
        rest = draws[0]
    if env.clearance(rest[None])[0] > 0:
        return rest
    draws = draws[env.approximate_clearance(draws) >= env.min_clearance]
    if len(draws) == 0:
        return rest
    heights = env.robot.trace(draws)[..., 2].max(axis=1)
    highest: Array = draws[int(np.argmax(heights))]
    return highest


class RobotShape:
    """The surfaces of an environment's robot.

    Args:
        env: the environment.
        bodies: what is shown of the robot.

    Attributes:
        links: of each shape that moves its triangles (n, 3, 3), in its own frame.
        still: triangles (n, 3, 3) of what does not move, with what the robot stands on.
    """

    def __init__(self, env: Environment, bodies: Bodies) -> None:
        self._env, self._robot = env, bodies
        surfaces = [triangles_of([solid]) for solid in self._robot.shapes]
        anywhere = env.space.sample(np.random.default_rng(0), 1)[0]
        fixed = self._robot.poses(anywhere)[self._robot.moving :]
        self.links = surfaces[: self._robot.moving]
        self.still = _placed(
            [*surfaces[self._robot.moving :], triangles_of(env.scenery)],
            [*fixed, np.eye(3, 4)],
        )

    def poses(self, q: Array) -> Array:
        """Rotations and translations (links, 3, 4) of what moves, at a configuration (d,)."""
        return self._robot.poses(q)[: self._robot.moving]

    def triangles(self, q: Array) -> Array:
        """The surface (n, 3, 3) of what moves, at a configuration (d,)."""
        return _placed(self.links, self.poses(q))

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Corners (3,) of a box about what does not move, and about where the robot and the points
        that are traced come to, by many random configurations."""
        draws = self._env.space.sample(np.random.default_rng(0), _REACHED)
        places = [self._env.robot.trace(draws), self.triangles(draws[0]), self.still]
        reached = np.concatenate([place.reshape(-1, 3) for place in places])
        return reached.min(axis=0), reached.max(axis=0)


def _placed(surfaces: Sequence[Array], poses: Sequence[Array] | Array) -> Array:
    """Surfaces (n, 3, 3) each, moved by poses (3, 4) each, as one."""
    return np.concatenate(
        [
            surface @ pose[:, :3].T + pose[:, 3]
            for surface, pose in zip(surfaces, poses, strict=True)
        ]
    )
