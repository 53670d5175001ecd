"""Environments and paths as JSON data for 3-D views, with no more points than can be seen.

Arrays and texts are packed to travel inside the page; `assets/unpack.js` undoes it.
"""

from __future__ import annotations

import base64
import gzip
import math
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.report.postures import RobotShape, along, triangles_of
from bench.report.projection import faced
from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.grid import cells_of
from envs.problem import Array

TOLERANCE = 1e-3
"""How far drawn paths may be from the true ones, by the world's longest side."""

POSTURES = 17
"""Of a robot along a path, from start to goal."""

_ROUNDING = 0.1  # of the tolerance, for rounding; the rest is for leaving points out
_MOST_FACES = 18_000
_MOST_LINK_FACES = 600
_POSES_STEP = 1e-4  # of rotations, and of translations in workspace units, at most
_TRACE_POINTS = 400
_FLAT = 0.3  # the cosine of how steep a ceiling may be


class Scene:
    """How an environment and paths in it are shown, in the workspace: obstacles, the ways of the
    points that `Robot.trace` follows, and robots that are no points in postures."""

    def __init__(self, env: Environment) -> None:
        self._env, self._robot = env, RobotShape(env, env.robot)
        self._links = [] if env.is_point_robot else self._robot.links
        self._lower, self._upper = _corners(env) if env.is_point_robot else self._robot.bounds
        self._scale = _Scale(float((self._upper - self._lower).max()))

    def data(self) -> dict[str, Any]:
        """What does not depend on problems: `meshes` that stand still and `links` that move (see
        `_Scale.mesh`), `lower` and `upper` corners of the picture, whether free space is
        `enclosed`, so that it is to be cut open, and what is `followed` by the curves."""
        still = self._scale.mesh(self._robot.still, _MOST_FACES)
        return {
            "meshes": [self.obstacles(self._env), still],
            "links": [self._scale.mesh(link, _MOST_LINK_FACES) for link in self._links],
            "lower": self._lower.tolist(),
            "upper": self._upper.tolist(),
            "enclosed": self._env.rooms is not None,
            "followed": self._env.trace_label,
        }

    def obstacles(self, env: Environment) -> dict[str, Any]:
        """The first of the `meshes`, of an environment with this robot."""
        obstacles = triangles_of(env.obstacles)
        if env.rooms is not None:
            obstacles = obstacles[~_is_ceiling(env.rooms, obstacles)]
        return self._scale.mesh(obstacles, _MOST_FACES)

    def points(self, q: Array) -> Array:
        """Where the points that are traced are at configurations (n, d): (n, k, 3)."""
        return self._env.robot.trace(q)

    def drawn(self, path: Array) -> dict[str, Any]:
        """A path (k, d): the `curves` of the points that are traced, (m, 3) each, and of what has
        links its `postures`, (POSTURES, links, 3, 4)."""
        if not self._links:
            return {"curves": self._curves(path)}
        postures = [self._robot.poses(q) for q in self._along(path, POSTURES)]
        return {
            "curves": self._curves(self._along(path, _TRACE_POINTS)),
            "postures": packed(np.array(postures), min(_POSES_STEP, self._scale.step)),
        }

    def _along(self, path: Array, count: int) -> Array:
        return along(self._env.space, path, np.linspace(0, 1, count))

    def _curves(self, q: Array) -> list[dict[str, Any]]:
        return [self._scale.curve(way) for way in self.points(q).swapaxes(0, 1)]


def _corners(env: Environment) -> tuple[Array, Array]:
    """The corners (3,) in the workspace of where a point robot may be."""
    lower, upper = env.robot.trace(np.array(env.free_bounds))[:, 0]
    return lower, upper


class _Scale:
    """To what precision things are kept in a world whose longest side is `side`.

    Attributes:
        step: of what numbers are rounded to multiples.
    """

    def __init__(self, side: float) -> None:
        self._tolerance = TOLERANCE * side
        self.step = _ROUNDING * self._tolerance

    def curve(self, points: Array) -> dict[str, Any]:
        """A curve (k, 3) to the tolerance, as of `packed`."""
        return packed(thinned(points, self._tolerance - self.step), self.step)

    def mesh(self, triangles: Array, most: int) -> dict[str, Any]:
        """The surface of triangles (n, 3, 3) with at most so many faces: `vertices` and `faces`
        as of `packed`, and how `many` there were."""
        mesh = simplified(triangles, most)
        return {
            "vertices": packed(mesh.vertices, self.step),
            "faces": packed(mesh.faces, 1),
            "many": len(triangles),
        }


def _is_ceiling(rooms: Allowed, triangles: Array) -> Any:
    """Which of the faces (n, 3, 3) of a building have free space only below them, (n,) of bool:
    without them one sees into it from above."""
    normals, before, behind = faced(rooms, triangles)
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
