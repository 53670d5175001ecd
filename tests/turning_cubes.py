"""An environment, a robot and a shape that nothing else knows of, as of somebody's own package: two
cubes at the ends of a rod, which move and turn in a plane beside a third that stands still."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any, ClassVar

import fcl
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from envs import Environment, Problem
from envs.collision.shapes import BOX, PlacedShape, Solid, Spheres
from envs.collision.shapes.solid import make_row
from envs.problem import Array
from envs.spaces import Coordinates, Space
from envs.speed_model import SpeedModel

ARM = 1.0
"""From the middle of the rod to the middle of each cube."""

LIMIT = 4.0


class Cube(Solid):
    kind: ClassVar[str] = "cube"

    def __init__(self, side: float) -> None:
        self.side = side

    def definition(self) -> list[Any]:
        return [self.kind, self.side]

    def bounding_sphere(self) -> tuple[Array, float]:
        return np.zeros(3), self.side * np.sqrt(0.75)

    def sphere_cover(self, slack: float) -> Spheres:
        return Spheres(np.zeros((1, 3)), np.array([self.side * np.sqrt(0.75)]))

    def distance_row(self, pose: Array) -> Array:
        return make_row(BOX, pose[:3, :3], pose[:3, 3], np.full(3, self.side / 2))

    def triangulate(self) -> trimesh.Trimesh:
        return trimesh.creation.box(np.full(3, self.side))

    def fcl_geometry(self) -> fcl.CollisionGeometry:
        return fcl.Box(*np.full(3, self.side))


class Rod:
    """Placed by the position (x, y) of its middle and its heading."""

    shapes = (Cube(0.6), Cube(0.4), Cube(1.0))
    moving = 2
    pairs: tuple[tuple[int, int], ...] = ()
    rate_bound = 4.0

    def poses(self, q: Array) -> Array:
        found = np.array([np.eye(3, 4)] * 3)
        found[:2, :, :3] = Rotation.from_euler("z", q[2]).as_matrix()
        found[:2, :, 3] = self.trace(q[None])[0]
        found[2, :, 3] = 0.0, 0.0, 2.0
        return found

    def motion_bound(self, a: Array, b: Array) -> float:
        x, y, turn = SPACE.difference(a[None], b[None])[0]
        return float(np.hypot(x, y) + (ARM + 0.6) * abs(turn))

    def trace(self, q: Array) -> Array:
        out = ARM * np.column_stack([np.cos(q[:, 2]), np.sin(q[:, 2]), np.zeros(len(q))])
        middle = np.column_stack([q[:, :2], np.zeros(len(q))])
        return np.stack([middle - out, middle + out], axis=1)


SPACE = Space(
    [
        Coordinates([-LIMIT, -LIMIT], [LIMIT, LIMIT]),
        Coordinates([-np.pi], [np.pi], wraps=[True]),
    ]
)


class Plane(Environment):
    min_clearance = 0.1
    units = MappingProxyType({"configuration": "m and rad", "workspace": "m"})
    trace_label = "middles of the cubes"
    lower = np.array([-LIMIT, -LIMIT, -np.pi])
    upper = -lower
    space = SPACE

    def __init__(self) -> None:
        place = np.eye(4)
        place[:3, 3] = [0.0, 3.0, 0.0]
        self.robot = Rod()
        self.obstacles = [PlacedShape(Cube(1.0), place)]
        self.speed_model = SpeedModel(d_min=0.1, d_max=1.0)

    def clearance(self, q: Array) -> Array:
        model = self.collision_model()
        return np.array([model.clearance(one) for one in q])

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        rng = np.random.default_rng(seed)
        ends = [SPACE.sample(rng, 100) for _ in range(2)]
        starts, goals = (q[self.clearance(q) >= self.min_clearance] for q in ends)
        return [Problem(starts[i], goals[i], i) for i in range(n)]

    def definition(self) -> dict[str, Any]:
        return {"class": "Plane", "version": 1}


class OnePart(Plane):
    """Position and heading are measured together, as the joints of an arm are."""

    space = Space([Coordinates(Plane.lower, Plane.upper, wraps=[False, False, True])])
