"""Rigid bodies in the worlds of OMPL.app's problem files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.collision.shapes import Mesh, PlacedShape
from envs.errors import InputError, suggestion
from envs.files.assimp_mesh import read_as_assimp
from envs.files.mesh_file import FileMesh
from envs.files.omplapp_cfg import Pose, RigidBodyProblem, read_problem
from envs.problem import Array, Problem
from envs.robots.rigid_body import SLACK, InSpace, InThePlane, Placement, RigidBody, radius_of
from envs.scenes import HALF_SIDE
from envs.scenes.mesh_world import (
    DEFAULT_RADIUS,
    KINDS,
    MeshWorld,
    Transform,
    default_kind,
)
from envs.scenes.point_world import PointWorld
from envs.scenes.rigid_body_world import DRAWS, SEARCH, RigidBodyWorld
from envs.seeding import derived_seed
from envs.speed_model import SpeedModel

SPACES = ("se3", "se2")

_CLOSEST = 1e-5
"""By the longest side of the bounds: what start and goal must keep clear, at least. The judge would
have to decide to less than this, and takes the longer."""

_Bounds = tuple[Array, Array]


class _WorldMesh(MeshWorld):
    """A mesh where its file has it, for positions between bounds (3,) in the file's units. Lengths
    that are fixed in worlds of side 20 have the same share of the longest side of these."""

    def __init__(self, read: FileMesh, kind: str, bounds: _Bounds, name: str) -> None:
        self.kind = kind
        self.transform = Transform(1.0, np.zeros(3))
        unit = _unit(bounds)
        speed = KINDS[kind].speed
        scaled = SpeedModel(speed.d_min * unit, speed.d_max * unit, speed.s_const, speed.contact)
        PointWorld.__init__(self, DEFAULT_RADIUS * unit, scaled)
        self.lower, self.upper = bounds
        self.min_clearance = MeshWorld.min_clearance * unit
        self.min_separation = MeshWorld.min_separation * unit
        self._take(read, name)


class OmplApp(RigidBodyWorld):
    """A rigid body in the world of one of OMPL.app's problem files (`.cfg`), in the file's units.

    Problem 0 of each seed has the start and the goal of the file. Those after it are sampled: their
    ends are uniform in free space, keep a hundredth of the longest side of the bounds clear, have
    positions a fifth of it apart, and are joined by a long search.

    As in OMPL.app, a configuration says where the body's centre is, the mean of its mesh's vertices
    (in the plane it keeps its z); Collada's units and up axes are applied, and y is up; positions
    are within the volume, or the box about the world, widened to hold start and goal. The world is
    a surface. Where it encloses something it is solid (`kind`), unless start and goal are within.

    A radian of turning is as long as what the body's farthest point travels. With `weight=0.5` it
    is as long as in OMPL's state spaces, whatever the size of the body.

    Args:
        file: the problem, which names the meshes of body and world, in its folder or beside it.
        space: "se3" or "se2", in which the body turns about z; "" for that of the file.
        kind: of the world, see `MeshWorld`; "" for what it is by its mesh, and by start and goal.
        weight: of a radian of turning in distances, in the file's units; 0 for the body's radius.

    Raises:
        InputError: a file or an argument cannot be used, or start or goal are in collision.
    """

    advice = "problem 0, of the file, needs no such search: ask for one problem"

    def __init__(
        self, file: str = "", space: str = "", kind: str = "", weight: float = 0.0
    ) -> None:
        if not file:
            raise InputError("omplapp: say which problem, as in omplapp:file=Home.cfg")
        if space and space not in SPACES:
            raise InputError(f"omplapp: no space is called {space!r}; {suggestion(space, SPACES)}")
        if kind and kind not in KINDS:
            raise InputError(f"omplapp: no kind is called {kind!r}; {suggestion(kind, KINDS)}")
        problem = read_problem(file)
        scene = _Scene(problem, in_plane=space == "se2" or (problem.planar and space == ""))
        bounds = scene.bounds
        longest = float((bounds[1] - bounds[0]).max())
        if not 0 <= weight <= 50 * longest:
            raise InputError(
                f"omplapp: weight must be between 0 and {50 * longest:g}, not {weight}"
            )
        parts = [PlacedShape(scene.body, np.eye(4))]
        placement = scene.placement(weight or round(radius_of(parts), 6))
        robot = RigidBody(parts, placement)
        self._ends_of_file = scene.ends()
        world = _world(scene.world, kind, bounds, str(problem.world), robot, self._ends_of_file)
        super().__init__(robot, world, world.robot.radius, scene.body_is_closed)
        self._z = scene.z
        self.end_clearance = world.min_clearance
        self.min_separation = world.min_separation
        self.search_step = longest / 10
        self.min_clearance = min(self.end_clearance, self._clearance_of_ends(file, longest))

    def _clearance_of_ends(self, file: str, longest: float) -> float:
        """The less of start's and goal's; refuses the problem where one is not free."""
        model = self.collision_model(tolerance=_CLOSEST * longest)
        found = [model.clearance(end) for end in self._ends_of_file]
        for end, clearance in zip(("start", "goal"), found, strict=True):
            if clearance < _CLOSEST * longest:
                how = "touches the world, or is where the world is solid"
                if clearance > 0:
                    how = f"is only {clearance:.2g} from the world, too near to be checked"
                raise InputError(
                    f"{file}: its {end} {how}; correct {end}.x and so on (they are of the mean of "
                    "the body's vertices, y being up in the meshes), or its meshes"
                )
        return min(found)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """See `Environment.sample_problems`; problem 0 is that of the file."""
        if n == 0:
            return []
        first: tuple[Array, Array] = (self._ends_of_file[0], self._ends_of_file[1])
        pairs = [first, *self.sampled_ends(n - 1, seed).pairs]
        return [
            Problem(start, goal, index, derived_seed("omplapp planner", seed, index))
            for index, (start, goal) in enumerate(pairs)
        ]

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        return {"pairs_dropped_as_unsolved": self.sampled_ends(max(n - 1, 0), seed).dropped}

    def definition(self) -> dict[str, Any]:
        return {
            "class": "OmplApp",
            "version": 1,
            "parts": [part.definition() for part in self.robot.parts],
            "space": self.space.definition(),
            "z": self._z,
            "world": self.world.definition(),
            "ends": self._ends_of_file.tolist(),
            "problems": [self.end_clearance, self.min_separation, SEARCH, DRAWS, SLACK],
        }


class _Scene:
    """The meshes of a problem and its poses, in space or in the plane.

    Attributes:
        body: about its centre.
        body_is_closed: whether its surface is.
        world: the mesh that is in the way.
        z: of the plane.
        bounds: of positions, lower and upper, (3,) each; in the plane z is between those of the
            body.

    Raises:
        InputError: a mesh cannot be used, or the problem is none in the plane.
    """

    def __init__(self, problem: RigidBodyProblem, in_plane: bool) -> None:
        self._problem = problem
        self._in_plane = in_plane
        read, center = read_as_assimp(problem.robot)
        # OMPL.app leaves the body at its z where it moves in the plane.
        rise = float(center[2]) if problem.planar else 0.0
        if problem.planar and in_plane:
            center, rise = center * [1, 1, 0], 0.0
        self._rise = np.array([0.0, 0, rise])
        self.body = Mesh(read.vertices - center, read.faces)
        self.body_is_closed = read.closed
        self.world, _ = read_as_assimp(problem.world)
        self.z = float(problem.start.position[2] + rise)
        self.bounds = self._bounds()

    def placement(self, weight: float) -> Placement:
        if self._in_plane:
            return InThePlane(*self.bounds, self.z, weight)
        return InSpace(*self.bounds, weight)

    def ends(self) -> Array:
        """The configurations (2, size) of start and goal."""
        poses = (self._problem.start, self._problem.goal)
        if not self._in_plane:
            return np.array([[*(p.position + self._rise), *p.quaternion] for p in poses])
        if poses[0].position[2] != poses[1].position[2]:
            raise InputError("omplapp: start and goal differ in z, so that space=se2 cannot be")
        return np.array([[*p.position[:2], _heading(p)] for p in poses])

    def _bounds(self) -> _Bounds:
        lower, upper = self.world.vertices.min(axis=0), self.world.vertices.max(axis=0)
        if self._problem.volume is not None:
            size = len(self._problem.volume[0])
            lower[:size], upper[:size] = self._problem.volume
        for pose in (self._problem.start, self._problem.goal):  # as in OMPL.app
            lower = np.minimum(lower, pose.position + self._rise)
            upper = np.maximum(upper, pose.position + self._rise)
        if self._in_plane:
            low, high = self.body.vertices.min(axis=0), self.body.vertices.max(axis=0)
            beside = 0.01 * float((high - low).max())
            lower[2], upper[2] = self.z + low[2] - beside, self.z + high[2] + beside
        for axis, low, high in zip("xyz", lower, upper, strict=True):
            if low == high:
                raise InputError(
                    f"omplapp: its world is flat, at {axis} = {low:g}; give a volume to move in"
                )
        return lower, upper


def _heading(pose: Pose) -> float:
    """Of a pose in the plane, from -pi to pi."""
    x, y, z, w = pose.quaternion
    if math.hypot(x, y) > 1e-9:
        raise InputError("omplapp: it turns about other axes than z, so that space=se2 cannot be")
    return math.remainder(2 * math.atan2(z, w), 2 * math.pi)


def _unit(bounds: _Bounds) -> float:
    """What is 1 in a cube of side 20, by the longest side of bounds."""
    return float((bounds[1] - bounds[0]).max()) / (2 * HALF_SIDE)


def _world(
    read: FileMesh, kind: str, bounds: _Bounds, name: str, robot: RigidBody, ends: Array
) -> _WorldMesh:
    """The world of a kind, by default what it is by its mesh; or a shell, as in OMPL.app, where the
    body is within what would be solid at both ends (rows of `ends`), as in a closed room."""
    world = _WorldMesh(read, kind or default_kind(read), bounds, name)
    if kind or world.allowed is None:
        return world
    points = robot.placed(np.concatenate([p.piece_points() for p in robot.parts]), ends)
    outside = world.allowed(points.reshape(-1, 3)).reshape(points.shape[:2]).all(axis=1)
    if outside.any():
        return world
    return _WorldMesh(read, "shell", bounds, name)
