"""What is seen of an environment and of paths in it, as JSON data."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from bench.report.html.packing import packed
from bench.report.html.simplify import simplified, thinned
from bench.report.interior import faced, interior
from bench.report.postures import ArmShape, along, triangles_of
from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.collision.shapes import Placed
from envs.problem import Array
from envs.scenes.arm_world import ArmWorld

TOLERANCE = 1e-3
"""How far drawn paths may be from the true ones, by the world's longest side."""

POSTURES = 17
"""Of an arm along a path, from start to goal."""

_ROUNDING = 0.1  # of the tolerance, for rounding; the rest is for leaving points out
_MOST_FACES = 18_000
_MOST_LINK_FACES = 600
_POSES_STEP = 1e-4  # of rotations, and of translations in metres
_TRACE_POINTS = 400
_DRAWS = 2000  # of configurations, to see how far an arm reaches
_FAR_OUT = 10  # configurations, by the extent of the bounds
_FLAT = 0.3  # the cosine of how steep a ceiling may be


class Scene(Protocol):
    """How an environment and paths in it are shown, in the workspace."""

    def data(self) -> dict[str, Any]:
        """What does not depend on problems: `meshes` that stand still and `links` that move (see
        `_Scale.mesh`), `lower` and `upper` corners of the picture, and whether free space is
        `enclosed`, so that it is to be cut open."""

    def points(self, q: Array) -> Array:
        """Where configurations (n, d) are: of an arm its hand. (n, 3)."""

    def drawn(self, path: Array) -> dict[str, Any]:
        """A path (k, d): its `curve` (m, 3), and of arms `postures`, (POSTURES, links, 3, 4)."""


def scene_of(env: Environment) -> Scene | None:
    """None if there is no way to show it."""
    if isinstance(env, ArmWorld):
        return ArmScene(env)
    return PointScene(env) if env.dimension == 3 else None


def drawable(env: Environment, path: Array) -> bool:
    """Whether an array is a path of this environment that is anywhere near its bounds."""
    if path.ndim != 2 or len(path) == 0 or path.shape[1] != env.dimension:
        return False
    # Not a number is nowhere.
    return bool((np.abs(path - env.lower) <= _FAR_OUT * (env.upper - env.lower)).all())


class PointScene:
    """A robot that only translates in three dimensions."""

    def __init__(self, env: Environment) -> None:
        self._env = env
        self._scale = _Scale(float((env.upper - env.lower).max()))

    def data(self) -> dict[str, Any]:
        triangles = triangles_of(self._env.obstacles)
        within = interior(self._env)
        seen = triangles if within is None else triangles[~_is_ceiling(within, triangles)]
        lower, upper = self._env.free_bounds
        return {
            "meshes": [self._scale.mesh(seen, _MOST_FACES)],
            "links": [],
            "lower": lower.tolist(),
            "upper": upper.tolist(),
            "enclosed": within is not None,
        }

    def points(self, q: Array) -> Array:
        return q

    def drawn(self, path: Array) -> dict[str, Any]:
        return {"curve": self._scale.curve(path)}


class ArmScene:
    """An arm, whose hand's way is the curve."""

    def __init__(self, env: ArmWorld) -> None:
        self._env, self._shape = env, ArmShape(env.robot)
        draws = np.random.default_rng(0).uniform(env.lower, env.upper, (_DRAWS, env.dimension))
        reached = np.concatenate([self.points(draws), self._shape.base.reshape(-1, 3)])
        self._lower, self._upper = reached.min(axis=0), reached.max(axis=0)
        self._scale = _Scale(float((self._upper - self._lower).max()))

    def data(self) -> dict[str, Any]:
        moving = self._env.robot.parts[: self._env.robot.moving]
        links = [triangles_of([Placed(part.placed.solid, np.eye(4))]) for part in moving]
        still = [triangles_of(self._env.obstacles), self._shape.base]
        return {
            "meshes": [self._scale.mesh(triangles, _MOST_FACES) for triangles in still],
            "links": [self._scale.mesh(triangles, _MOST_LINK_FACES) for triangles in links],
            "lower": self._lower.tolist(),
            "upper": self._upper.tolist(),
            "enclosed": False,
        }

    def points(self, q: Array) -> Array:
        return self._shape.tips(q)

    def drawn(self, path: Array) -> dict[str, Any]:
        hand = self.points(along(path, np.linspace(0, 1, _TRACE_POINTS)))
        postures = [self._poses(q) for q in along(path, np.linspace(0, 1, POSTURES))]
        return {
            "curve": self._scale.curve(hand),
            "postures": packed(np.array(postures), _POSES_STEP),
        }

    def _poses(self, q: Array) -> Array:
        """Rotations and translations (links, 3, 4) at a configuration (d,)."""
        poses = self._env.robot.poses(q)[: self._env.robot.moving]
        turns = [np.eye(3) if turn is None else turn for turn, _ in poses]
        shifts = [shift for _, shift in poses]
        return np.concatenate([np.array(turns), np.array(shifts)[:, :, None]], axis=2)


class _Scale:
    """To what precision things are kept in a world whose longest side is `side`."""

    def __init__(self, side: float) -> None:
        self._tolerance = TOLERANCE * side
        self._step = _ROUNDING * self._tolerance

    def curve(self, points: Array) -> dict[str, Any]:
        """A curve (k, 3) to the tolerance, as of `packed`."""
        return packed(thinned(points, self._tolerance - self._step), self._step)

    def mesh(self, triangles: Array, most: int) -> dict[str, Any]:
        """The surface of triangles (n, 3, 3) with at most so many faces: `vertices` and `faces`
        as of `packed`, and how `many` there were."""
        mesh = simplified(triangles, most)
        return {
            "vertices": packed(mesh.vertices, self._step),
            "faces": packed(mesh.faces, 1),
            "many": len(triangles),
        }


def _is_ceiling(within: Allowed, triangles: Array) -> Any:
    """Which of the faces (n, 3, 3) of a building have free space only below them, (n,) of bool:
    without them one sees into it from above."""
    normals, before, behind = faced(within, triangles)
    falls = normals[:, 2] < 0
    above, below = np.where(falls, (behind, before), (before, behind))
    return below & ~above & (np.abs(normals[:, 2]) > _FLAT)
