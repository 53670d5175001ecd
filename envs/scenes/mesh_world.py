"""A point robot about, within or among the surfaces of a triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from envs.collision.ball_distances import balls_to_shapes
from envs.collision.distance_fields import distance_transform
from envs.collision.enclosure import NO_INSIDE, Enclosure
from envs.collision.fcl_model import Allowed, Searcher
from envs.collision.margin_search import least_among_shapes
from envs.collision.mesh import cap_holes, queries, widest_gap
from envs.collision.separation import shapes_of
from envs.collision.shapes import Mesh
from envs.collision.winding import Sides
from envs.errors import InputError, suggestion, tell_once
from envs.files.mesh_file import FileMesh, read_mesh
from envs.grid import RegularGrid, node_axes, node_counts
from envs.problem import Array
from envs.robots.point import PointRobot
from envs.scenes import HALF_SIDE
from envs.scenes.point_world import PointWorld
from envs.speed_model import SpeedModel

DEFAULT_RADIUS = 0.01
"""The robot's radius in the paper's units, if none is given: the paper's collision threshold."""


ROUGH = 0.08
"""The error of clearances for learning, by the speed model's d_max."""


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
    "interior": Kind(20.0, SpeedModel(d_min=1.0 / 7, d_max=1.0, contact=0.02)),
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


_BESIDE_HOLES = 0.2
"""By how much winding numbers may be on the wrong side of a half, see `MeshWorld.allowed`."""


class MeshWorld(PointWorld):
    """A sphere-shaped robot that translates in a cube of side 20 centred at the origin.

    The mesh is centred and scaled into the cube, see `transform`. `kind` says what it means:

    - "solid": the robot may not be within, which includes cavities. `cap_holes` closes its holes.
    - "interior": the robot is within the largest part, and outside is out of bounds; other parts
      there are solid. Holes are closed.
    - "shell": a surface of no thickness, with free space on both sides, as in the paper.

    What is within does not depend on the winding of faces, see `enclosure`. The default kind does:
    "solid" for a watertight mesh, "interior" if its largest part is wound inward, and "shell" for
    one that is not watertight.

    Args:
        file: OBJ, PLY, OFF, STL, GLB or Collada (.dae).
        kind: see above; "" for the default.
        robot_radius: in the mesh's own unit (metres, of Collada); 0 for `DEFAULT_RADIUS`, which is
            in the world's.
        scale: world units for one of the mesh's; 0 for what makes the mesh fill the cube
            ("interior") or leaves room about it (the others).

    Attributes:
        transform: from the mesh's frame to the world's.

    Raises:
        InputError: the file holds no usable mesh, or an argument is out of range.
    """

    min_clearance = 0.2
    kind_of_problems = "mesh"
    advice = (
        "the robot has too little room; make it smaller (robot_radius), or is it another kind of "
        "world?"
    )

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
        self.kind = kind or default_kind(read)
        self.transform = _fitted(read.vertices, KINDS[self.kind].extent, scale, name)
        if not 0 <= robot_radius * self.transform.scale <= HALF_SIDE / 2:
            most = HALF_SIDE / 2 / self.transform.scale
            raise InputError(f"{name}: robot_radius must be between 0 and {most:.3g} mesh units")
        radius = robot_radius * self.transform.scale or DEFAULT_RADIUS
        super().__init__(radius, KINDS[self.kind].speed)
        self._take(read, name)

    def _take(self, read: FileMesh, name: str) -> None:
        """Makes obstacles of a mesh, once it is known what kind of world it is and where."""
        self._name = name
        self._mesh = Mesh(self.transform.to_world(read.vertices), read.faces)
        self._queries = queries(self._mesh)
        if not self._enclosure.known:
            raise InputError(
                f"nothing tells what {name} encloses: its faces lie on one another in part, or are "
                "written both ways and leave holes; mend it (trimesh and MeshLab can), or take "
                "kind=shell"
            )
        self._close(read)

    @property
    def _enclosure(self) -> Enclosure:
        if self.kind == "shell":
            return NO_INSIDE
        return self._queries.room if self.is_interior else self._queries.filled

    def _close(self, read: FileMesh) -> None:
        """Closes holes where there is an inside, and says what the world is like."""
        lid = cap_holes(self._mesh, self._enclosure)
        self._lids = [] if lid is None else [lid]
        self.obstacles = [self._mesh, *self._lids]
        self._whole = self._mesh if lid is None else self._mesh.joined(lid)
        self._distance = self._queries if lid is None else queries(self._whole)
        said = [f"{self._name}: {self.kind}, {len(read.faces)} faces"]
        if self.kind == "shell" and read.holes:
            said.append(f"free on both sides, also within, as it is not closed ({read.holes})")
        if read.dropped:
            said.append(f"{read.dropped} degenerate ones dropped")
        if lid is not None:
            said.append(f"holes closed with {len(lid.faces)} more")
        if self._enclosure.solids:
            said.append(f"parts of it that are solid: {self._enclosure.solids}")
        said += read.notes
        said.append(f"1 mesh unit is {self.transform.scale:.4g} world units")
        tell_once(", ".join(said))

    @property
    def allowed(self) -> Allowed | None:
        """Where the winding number is on the right side of a half, or not far on the wrong one.

        It varies about a half beside holes too narrow for a lid. If it were decided by a half,
        motions would pass through the wrong side there, or not, by where they are asked. What
        lies behind a lid cannot be reached anyway.
        """
        if self.kind == "shell":
            return None
        encloses = self._enclosure.encloses
        if self.kind == "interior":
            return lambda q: encloses(q) > 0.5 - _BESIDE_HOLES
        return lambda q: encloses(q) < 0.5 + _BESIDE_HOLES

    @cached_property
    def sides(self) -> Sides:
        """By less than what is `allowed`, as a judge asks elsewhere on a motion. Scans have cracks
        that the robot may pass without touching anything."""
        level = 0.5 + (-1 if self.is_interior else 1) * _BESIDE_HOLES / 2
        return self._enclosure.sides(level, widest_gap(self._mesh), self._lids)

    @property
    def searcher(self) -> Searcher:
        ball, around = self.compiled_shapes

        def search(path: Array, bounds: Array, *rest: Any) -> tuple[float, bool, int, int]:
            waypoints = np.ascontiguousarray(path)
            found: tuple[float, bool, int, int] = least_among_shapes(
                waypoints, bounds, ball, around, *rest
            )
            return found

        return search

    def approximate_clearance(self, q: Array) -> Array:
        """Off by at most `ROUGH` d_max, but for one in a thousand, see `distance_transform`."""
        return self._grid.interpolate(self.configurations(q))

    @cached_property
    def _grid(self) -> RegularGrid:
        spacing = ROUGH * self.speed_model.d_max * 2 / np.sqrt(self.dimension)
        axes = node_axes(*self.free_bounds, node_counts(*self.free_bounds, spacing))
        closest = self._distance.closest
        values = distance_transform(self._whole, closest, self._is_out, axes)
        clearances = (values - self.robot.radius).astype(np.float32)
        return RegularGrid.between(clearances, *self.free_bounds)

    def _is_out(self, points: Array) -> Any:
        """Whether points (n, 3) are where the robot may not be, (n,) of bool."""
        return (self._enclosure.encloses(points) > 0.5) != self.is_interior

    @property
    def is_interior(self) -> bool:
        return self.kind == "interior"

    @property
    def rooms(self) -> Allowed | None:
        return self.allowed if self.is_interior else None

    @property
    def free_bounds(self) -> tuple[Array, Array]:
        if self.kind != "interior":
            return self.lower, self.upper
        corners = self._mesh.vertices
        return np.maximum(corners.min(axis=0), self.lower), np.minimum(
            corners.max(axis=0), self.upper
        )

    def clearance(self, q: Array) -> Array:
        points = self.configurations(q)
        distance = self._distance.distance(points)
        return np.where(self._is_out(points), -distance, distance) - self.robot.radius

    def surface_clearance(self, q: Array) -> Array:
        _, around = self.compiled_shapes
        point = shapes_of(PointRobot(0.0).shapes)
        distance = balls_to_shapes(point, around, self.configurations(q))
        return distance - self.robot.radius

    def definition(self) -> dict[str, Any]:
        return {
            "class": "MeshWorld",
            "version": 1,
            "mesh": self._mesh.digest,
            "kind": self.kind,
            "transform": [self.transform.scale, self.transform.offset.tolist()],
            **self.point_definition(),
        }


def default_kind(read: FileMesh) -> str:
    """What a mesh means if nobody says so, see `MeshWorld`."""
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
