"""A point robot about, within or among the surfaces of a triangle mesh."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from envs.base import Environment
from envs.collision.fcl_model import Allowed
from envs.collision.mesh import MeshQueries, lids
from envs.collision.shapes import Mesh
from envs.errors import InputError, suggestion
from envs.free_space import GridComponents, connected_problems
from envs.problem import Array, Problem
from envs.robots.point import PointRobot
from envs.scenes import HALF_SIDE
from envs.scenes.mesh_file import FileMesh, read_mesh
from envs.seeding import derived_seed, stream
from envs.speed import SpeedModel

logger = logging.getLogger(__name__)

DEFAULT_RADIUS = 0.01
"""The robot's radius in the paper's units, if none is given: the paper's collision threshold."""


@dataclass(frozen=True)
class Kind:
    """What a mesh means.

    Attributes:
        extent: of the mesh's longest side in the cube.
        speed: the paper's constants for such a world.
    """

    extent: float
    speed: SpeedModel


KINDS = {
    "solid": Kind(12.0, SpeedModel(d_min=0.2, d_max=2.0)),
    "interior": Kind(20.0, SpeedModel(d_min=1.0 / 7, d_max=1.0)),
    "shell": Kind(12.0, SpeedModel(d_min=0.2, d_max=2.0)),
}


@dataclass(frozen=True)
class Transform:
    """From a mesh's own frame to the world's: p * scale + offset."""

    scale: float
    offset: Array

    def to_world(self, points: Array) -> Array:
        """Points (..., 3) of the mesh's frame, in the world's."""
        there: Array = points * self.scale + self.offset
        return there

    def to_mesh(self, points: Array) -> Array:
        """Points (..., 3) of the world, in the mesh's frame."""
        back: Array = (points - self.offset) / self.scale
        return back


class MeshWorld(Environment):
    """A sphere-shaped robot that translates in a cube of side 20 centred at the origin.

    The mesh is centred and scaled into the cube, see `transform`. `kind` says what it means:

    - "solid": the robot may not be within. Holes are closed, see `lids`.
    - "interior": the robot is within, and outside is out of bounds. Holes are closed.
    - "shell": a surface of no thickness, with free space on both sides, as in the paper.

    The default is "solid" for a watertight mesh wound outward, "interior" for one wound inward,
    and "shell" for one that is not watertight.

    Args:
        file: OBJ, PLY, OFF, STL or GLB.
        kind: see above; "" for the default.
        robot_radius: in the mesh's own unit; 0 for `DEFAULT_RADIUS`, which is in the world's.
        scale: world units for one of the mesh's; 0 for what makes the mesh fill the cube
            ("interior") or leaves room about it (the others).

    Attributes:
        transform: from the mesh's frame to the world's.

    Raises:
        InputError: the file holds no usable mesh, or an argument is out of range.
    """

    min_clearance = 0.2
    min_separation = 4.0

    def __init__(
        self, file: str = "", kind: str = "", robot_radius: float = 0.0, scale: float = 0.0
    ) -> None:
        if not file:
            raise InputError("mesh: say which, as in mesh:file=room.ply")
        if kind and kind not in KINDS:
            raise InputError(f"mesh: no kind is called {kind!r}; {suggestion(kind, KINDS)}")
        self._build(read_mesh(file), kind, robot_radius, scale, name=file)

    def _build(
        self, read: FileMesh, kind: str, robot_radius: float, scale: float, name: str
    ) -> None:
        self._name = name
        self.kind = kind or _default_kind(read)
        self.lower, self.upper = np.full(3, -HALF_SIDE), np.full(3, HALF_SIDE)
        self.speed_model = KINDS[self.kind].speed
        self.transform = _fitted(read.vertices, KINDS[self.kind].extent, scale, name)
        if not 0 <= robot_radius * self.transform.scale <= HALF_SIDE / 2:
            most = HALF_SIDE / 2 / self.transform.scale
            raise InputError(f"{name}: robot_radius must be between 0 and {most:.3g} mesh units")
        self._radius = robot_radius * self.transform.scale or DEFAULT_RADIUS
        self.robot = PointRobot(self._radius)
        self._mesh = Mesh(self.transform.to_world(read.vertices), read.faces)
        self._queries = MeshQueries(self._mesh)
        self._close(read)

    def _close(self, read: FileMesh) -> None:
        """Closes holes where there is an inside, and says what the world is like."""
        lid = None
        if self.kind != "shell" and not read.closed:
            lid = lids(self._mesh, self._queries)
        self.obstacles = [self._mesh] if lid is None else [self._mesh, lid]
        whole = self._mesh if lid is None else self._mesh.joined(lid)
        self._distance = self._queries if lid is None else MeshQueries(whole)
        said = [f"{self._name}: {self.kind}, {len(read.faces)} faces"]
        if read.dropped:
            said.append(f"{read.dropped} degenerate ones dropped")
        if lid is not None:
            said.append(f"holes closed with {len(lid.faces)} more")
        said.append(f"1 mesh unit is {self.transform.scale:.4g} world units")
        logger.info(", ".join(said))

    @property
    def allowed(self) -> Allowed | None:
        if self.kind == "shell":
            return None
        wanted = self.kind == "interior"
        return lambda q: self._queries.is_inside(q) == wanted

    def clearance(self, q: Array) -> Array:
        points = self.configurations(q)
        distance = self._distance.distance(points)
        allowed = self.allowed
        if allowed is not None:
            distance = np.where(allowed(points), distance, -distance)
        return distance - self._radius

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """Both ends uniform in free space, as `min_clearance` and `min_separation` demand, and
        proved to lie in one component of free space (see `GridComponents`)."""
        rng = stream("mesh problems", seed)
        return connected_problems(
            self,
            self._components,
            rng,
            n,
            lambda index: derived_seed("mesh planner", seed, index),
            advice=f"in {self._name} the robot has too little room; make it smaller "
            "(robot_radius), or is it another kind of world?",
        )

    @cached_property
    def _components(self) -> GridComponents:
        return GridComponents(self.clearance, self.lower, self.upper)

    def definition(self) -> dict[str, Any]:
        return {
            "class": "MeshWorld",
            "version": 1,
            "mesh": _digest(self._mesh),
            "kind": self.kind,
            "transform": [self.transform.scale, self.transform.offset.tolist()],
            "bounds": [self.lower.tolist(), self.upper.tolist()],
            "robot_radius": self._radius,
            "speed": [self.speed_model.d_min, self.speed_model.d_max, self.speed_model.s_const],
            "problems": [self.min_clearance, self.min_separation],
        }


def _default_kind(read: FileMesh) -> str:
    if not read.closed:
        return "shell"
    return "solid" if read.outward else "interior"


def _fitted(vertices: Array, extent: float, scale: float, name: str) -> Transform:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    longest = float((high - low).max())
    factor = scale or extent / longest
    if not 0 < factor * longest <= 2 * HALF_SIDE * (1 + 1e-9):
        most = 2 * HALF_SIDE / longest
        raise InputError(f"{name}: scale must be above 0 and at most {most:.4g}, not {scale}")
    return Transform(factor, -factor * (low + high) / 2)


def _digest(mesh: Mesh) -> str:
    digest = hashlib.sha256()
    digest.update(np.ascontiguousarray(mesh.vertices, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, dtype="<i8").tobytes())
    return digest.hexdigest()
