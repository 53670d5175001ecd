"""Environments and paths as JSON data for 3-D views, with no more points than can be seen.

Arrays and texts are packed to travel inside the page; `assets/unpack.js` undoes it.
"""

from __future__ import annotations

import base64
import gzip
import math
from typing import Any, Protocol

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.report.configurations import ArmShape, along, triangles_of
from bench.report.projection import faced, interior
from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.grid import cells_of
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
        links = [triangles_of([part.placed.solid]) for part in moving]
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


_FIRST_CELL, _GROWTH = 0.5, 1.2
"""The first grid's cells, by the side of a square with two of the faces that are wanted; and how
much larger those of the next one are."""


def thinned(path: Array, tolerance: float) -> Array:
    """Some points (m, 3) of a curve (k, 3), its ends among them, from whose lines no other is
    farther than `tolerance`.

    D. H. Douglas and T. K. Peucker, "Algorithms for the reduction of the number of points required
    to represent a digitized line", Cartographica 1973.
    """
    kept = {0, len(path) - 1}
    waiting = [(0, len(path) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        off = _distances(path[first + 1 : last], path[first], path[last])
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = first + 1 + worst
            kept.add(middle)
            waiting += [(first, middle), (middle, last)]
    return path[sorted(kept)]


def _distances(points: Array, a: Array, b: Array) -> Array:
    """From points (n, 3) to the segment between a and b (3,)."""
    step = b - a
    shares = ((points - a) @ step / max(float(step @ step), 1e-300)).clip(0, 1)
    distances: Array = np.linalg.norm(points - (a + shares[:, None] * step), axis=1)
    return distances


def simplified(triangles: Array, most: int) -> trimesh.Trimesh:
    """The surface of triangles (n, 3, 3) with at most so many faces: as it is if it has no more,
    or with all corners within a cell of a grid put together in their middle. That works for any
    triangles, those of a scan that no edge collapse could begin with included.

    J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes",
    1993.
    """
    corners, numbers = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = numbers.reshape(-1, 3).astype(np.int64)
    mesh = trimesh.Trimesh(corners, faces, process=False)
    cell = _FIRST_CELL * math.sqrt(2 * mesh.area / most)
    while len(mesh.faces) > most:
        mesh = _clustered(corners, faces, cell)
        cell *= _GROWTH
    return mesh


def _clustered(corners: Array, faces: NDArray[np.int64], cell: float) -> trimesh.Trimesh:
    """`faces` (n, 3) between the middles of the corners (k, 3) in each cell of a grid, where they
    are still triangles."""
    cells = cells_of(corners, corners.min(axis=0), cell)
    _, of, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    of = of.reshape(-1)
    middles = np.stack([np.bincount(of, axis) for axis in corners.T], axis=1) / counts[:, None]
    left = of[faces]
    left = left[(left != np.roll(left, 1, axis=1)).all(axis=1)]
    _, once = np.unique(np.sort(left, axis=1), axis=0, return_index=True)
    return trimesh.Trimesh(middles, left[np.sort(once)], process=False)


_TYPES = (("Int16Array", "<i2", 2**15 - 1), ("Int32Array", "<i4", 2**31 - 1))
"""JavaScript's names of the types, ours, and the largest numbers they hold; the smallest first."""


def packed(values: Array, step: float) -> dict[str, Any]:
    """Numbers of any shape, flattened and rounded to multiples of `step`, as JSON data.

    Raises:
        ValueError: a number is not finite, or too many steps away from 0 for 32 bits.
    """
    whole = np.rint(np.asarray(values, dtype=np.float64) / step)
    for name, kind, largest in _TYPES:
        # Not a number fits nowhere.
        if whole.size == 0 or np.abs(whole).max() <= largest:
            data = base64.b64encode(whole.astype(kind).tobytes()).decode("ascii")
            return {"type": name, "step": step, "data": data}
    raise ValueError(f"some numbers are not finite, or too large for steps of {step:g}")


def compressed(text: str) -> str:
    """A text as the base64 of its gzip, the same whenever it is made."""
    return base64.b64encode(gzip.compress(text.encode("utf-8"), 9, mtime=0)).decode("ascii")
