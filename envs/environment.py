"""The contract of an environment."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision import continuous as batched
from envs.collision.checked_pairs import CheckedPairs
from envs.collision.continuous import DEFAULT_TOLERANCE
from envs.collision.fcl_model import Allowed, CollisionModel, Prover, Searcher
from envs.collision.motion_check import MotionCheck
from envs.collision.part_scenes import PartScenes
from envs.collision.shapes import Bodies, Obstacle, Robot
from envs.collision.winding import EVERYWHERE, Sides
from envs.plain_scene import PlainRobot, PlainScene
from envs.problem import Array, Problem
from envs.spaces import Coordinates, Space
from envs.speed_model import SpeedModel

_FINEST = 2e-5
"""The least tolerance, by the extent of a scene: what the judge asks to decide on a segment grows
with the inverse of this."""


class LinkGeometry(NamedTuple):
    """The links of a robot and the obstacles, as compiled code sees them.

    Attributes:
        robot: `envs.robots.arm.RobotArrays`: joints, and spheres that cover the links.
        scenes: the obstacles that each link's solids must not touch.
    """

    robot: Any
    scenes: PartScenes


class Environment(ABC):
    """The contract of an environment: a robot, a scene, the bounds of the configuration space, and
    problems. Subclass it, or a world that knows more (`BoxWorld`, `MeshWorld`, `ArmWorld`).

    The harness makes an instance for itself, whose problems it asks for and in which the judge
    works, and another in each planner's process. All of them must be the same: everything random
    comes from `envs.seeding`, and equal definitions mean equal scenes and problems.

    A subclass sets the attributes below and implements `clearance`, `sample_problems` and
    `definition`; the rest has defaults. Configurations are float64 (n, d), d being the size of the
    `space`: in R^d, which is the default, its dimension; with rotations in space more, as each
    takes the four numbers of a quaternion for three degrees of freedom.

    Attributes:
        lower: float64 (d,), the lower bounds of the configurations, in the environment's unit: of
            point robots the paper's (a cube of side 20), of arms radians.
        upper: float64 (d,), the upper bounds.
        min_clearance: float, least clearance of a problem's start and goal, in workspace units (of
            arms metres).
        robot: `envs.collision.shapes.Robot`, the moving body.
        obstacles: sequence of `Obstacle`, shapes in the workspace frame, which do not move.
        speed_model: `SpeedModel`, equation 3 with this environment's constants.
        units: mapping of str, what tables call the units of a "configuration" and of lengths in the
            "workspace".
        trace_label: str, what pictures call the points that `Robot.trace` follows.
        allowed_apart: bool, whether `allowed` forbids nothing but that things are within others,
            so that it need not be asked where they are known not to be.
        scenes_differ: bool, whether problems have scenes of their own, see `scene_of`.
        problem_count: int, how many problems there are, where these are a list, whatever the seed;
            None where any number can be drawn.

    Example:
        >>> import envs
        >>> env = envs.make("c3d:scene=3")
        >>> env.dimension
        3
        >>> [problem] = env.sample_problems(1, seed=0)
        >>> ends = np.array([problem.start, problem.goal])
        >>> bool((env.clearance(ends) >= env.min_clearance).all())
        True
    """

    lower: Array
    upper: Array
    min_clearance: float
    robot: Robot
    obstacles: Sequence[Obstacle]
    speed_model: SpeedModel
    units: Mapping[str, str] = MappingProxyType({"configuration": "units", "workspace": "units"})
    trace_label: str = "middle of the robot"
    allowed_apart: bool = False
    scenes_differ: bool = False
    problem_count: int | None = None

    def scene_of(self, problem: Problem) -> Environment:
        """The environment in which a problem lives, by default this one.

        Where scenes differ from problem to problem (`scenes_differ`), paths are planned, judged and
        drawn in that of their problem, whose robot and space are those of this environment. Two
        problems with the same scene get the same object, as long as they are asked for in a row.

        Args:
            problem: `Problem`, of this environment.

        Returns:
            `Environment`.
        """
        return self

    @property
    def velocity_limits(self) -> Array | None:
        """Limits of each coordinate's velocity, float64 (d,), positive, in the configurations' unit
        a second; None where the robot has none that are known, which is the default."""
        return None

    @cached_property
    def space(self) -> Space:
        """The configuration space, whose shortest ways are checked, judged and measured: by
        default R^d between `lower` and `upper`. Those of another must be the space's."""
        return Space([Coordinates(self.lower, self.upper)])

    @property
    def sampling_space(self) -> Space:
        """What of the `space` holds all of free space, by its `free_bounds`. Samplers need not look
        elsewhere."""
        return self.space.narrowed(*self.free_bounds)

    @property
    def dimension(self) -> int:
        """The degrees of freedom of a configuration."""
        return self.space.dimension

    @property
    def extent(self) -> float:
        """How far from each other, along an axis, places can be that the robot comes to, in
        workspace units: by default, for robots that translate, the largest side of the bounds."""
        return float((self.upper - self.lower).max())

    @property
    def tolerance(self) -> float:
        """To which the judge decides (see `CollisionModel`), in workspace units: 1e-3, but in
        scenes of more than 50 units a 50,000th of the `extent`, up to a quarter of what the ends
        of problems keep clear."""
        return min(max(DEFAULT_TOLERANCE, _FINEST * self.extent), self.min_clearance / 4)

    @property
    def planning_tolerance(self) -> float:
        """The tolerance for planners, in workspace units. Motions found free at this one have more
        than the judge's tolerance everywhere, so that it refuses none of them. At the judge's own,
        half of that would be accepted."""
        return 2 * self.tolerance

    @property
    def free_bounds(self) -> tuple[Array, Array]:
        """Corners (d,) of a box within the bounds that holds all of free space, by default the
        bounds themselves."""
        return self.lower, self.upper

    @property
    def is_interior(self) -> bool:
        """Whether free space is the inside of rooms, where thin walls part places that are close
        together; by default not."""
        return False

    @property
    def is_point_robot(self) -> bool:
        """Whether the robot is a point, or a ball, at the position in the workspace that its
        configuration is: (3,), or (2,) in the plane z = 0, where it is a disc among what stands
        upright; by default not. Then a curve tells all of a path, and learners may look about a
        configuration among the obstacles."""
        return False

    @property
    def drawn_robot(self) -> Bodies:
        """The robot as pictures show it, where more of it is to be seen than what collides; by
        default `robot`."""
        return self.robot

    @property
    def rooms(self) -> Allowed | None:
        """Where in the workspace the rooms of a building are, (n, 3) -> (n,) of bool; by default
        None: there are none, or it is not known. Pictures cut buildings open by this."""
        return None

    @property
    def scenery(self) -> Sequence[Obstacle]:
        """Shapes in the workspace frame that pictures show and that nothing collides with, such
        as what a robot stands on; by default none."""
        return ()

    @property
    def coordinate_names(self) -> Sequence[str]:
        """What messages call each of a configuration's numbers: by default "coordinate 1" and so
        on."""
        return [f"coordinate {n + 1}" for n in range(self.space.size)]

    @property
    def shape_names(self) -> Sequence[str]:
        """What messages call each of the robot's shapes: by default "the robot" where it has only
        one, else "shape 1", "shape 2" and so on."""
        count = len(self.robot.shapes)
        return ["the robot"] if count == 1 else [f"shape {n + 1}" for n in range(count)]

    @property
    def obstacle_names(self) -> Sequence[str]:
        """What messages call each of the obstacles: by default the kind and the number, from 1, as
        in "obstacle 3 (a box)"."""
        kinds = (obstacle.solid.kind for obstacle in self.obstacles)
        return [f"obstacle {n} (a {kind})" for n, kind in enumerate(kinds, start=1)]

    @property
    def link_geometry(self) -> LinkGeometry | None:
        """What learners need that are told where each link is and how near to obstacles; by
        default None, and they are told the configuration alone."""
        return None

    @property
    def plain_scene(self) -> PlainScene | None:
        """Robot and scene as plain data, for planners that are other programs; None, which is the
        default, where nobody has said how that is to be told."""
        return None

    @abstractmethod
    def clearance(self, q: Array) -> Array:
        """The signed distance from the robot's surface to the obstacles.

        Args:
            q: configurations, float64 (n, d), within the bounds or not.

        Returns:
            float64 (n,) in workspace units: exact in free space, negative in collision, by the
            depth if that is known.
        """

    def approximate_clearance(self, q: Array) -> Array:
        """`clearance` for learning, which asks for millions: where that is slow it may be off by
        a small share of the speed model's d_max, and the first call may take a while."""
        return self.clearance(q)

    def surface_clearance(self, q: Array) -> Array:
        """By how much the robot is away from all surfaces of obstacles, (n,), or less by a ten
        millionth: where that is quicker to tell than on which side of them it is, and `allowed`
        says that. Configurations along a path take less time. By default `clearance`."""
        return self.clearance(q)

    @abstractmethod
    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """The first test problems of a seed, the same on every machine.

        Args:
            n: int, how many; a larger one only adds problems at the end.
            seed: int, from 0; test problems have seeds below 2^32, those for training and warming
                up others (`envs.seeding`).

        Returns:
            n problems, `envs.Problem` with index 0, 1, ..., whose start and goal, (d,) within the
            bounds, keep `min_clearance`. Those of a list have the numbers that they have there, in
            ascending order, and ends as they are there.

        Raises:
            InputError: the scene leaves too little free space.
        """

    def problems_at(self, indices: Sequence[int], seed: int) -> list[Problem]:
        """Problems of a seed by their indices (int), in that order.

        Raises:
            InputError: there is none of one of them.
        """
        made = self.sample_problems(max(indices, default=-1) + 1, seed)
        return [made[index] for index in indices]

    def known_length(self, problem: Problem) -> float | None:
        """The length of a path that is known to solve a problem, in the configurations' unit, as of
        problem sets that have such; None where none is known, which is the default. The metric
        `length_over_known` compares with it."""
        return None

    def problem_statistics(self, n: int, seed: int) -> dict[str, float]:
        """What is worth knowing of how the first `n` problems of `seed` came about: numbers by
        what they count, which tables show."""
        return {}

    @abstractmethod
    def definition(self) -> dict[str, Any]:
        """Everything that defines the scene and its problems.

        Returns:
            JSON data (dict). Its digest is the `fingerprint`, by which stored results and trained
            weights know the environment; change a number in it (say, "version") whenever scene or
            problems change.
        """

    def family(self) -> Sequence[Environment]:
        """Scenes of the same kind, for learners that are to generalise over scenes; this one
        alone by default. Environments with an equal `family_fingerprint` have equal families."""
        return [self]

    def family_definition(self) -> dict[str, Any]:
        """What environments of a family have in common, as JSON data."""
        return self.definition()

    def symmetries(self) -> Array:
        """Orthogonal matrices (k, d, d) about the middle of the bounds that turn scenes of the
        family, workspace and configurations alike, into equally likely ones; by default none
        besides the identity."""
        return np.eye(self.dimension)[None]

    @property
    def allowed(self) -> Allowed | None:
        """Where configurations may be that are in contact with nothing, for obstacles that are
        surfaces. See `CollisionModel`."""
        return None

    @property
    def may_touch(self) -> NDArray[np.bool_] | None:
        """Which of the robot's shapes that move may touch which obstacles, or be within them:
        (moving, obstacles) of bool; None, which is the default, where none may touch any."""
        return None

    @property
    def not_allowed(self) -> str:
        """Where a robot is that touches nothing, but is not where it is `allowed`, for messages."""
        if self.is_interior:
            return "outside the rooms"
        return "within a closed mesh, or has something within a mesh of its own"

    @property
    def prover(self) -> Prover | None:
        """Quick proofs, which decide about motions in place of searches; by default none. See
        `CollisionModel`."""
        return None

    @property
    def searcher(self) -> Searcher | None:
        """A quick search for the least clearance of paths; by default none. See
        `CollisionModel`."""
        return None

    def speed(self, q: Array) -> Array:
        """Speeds S*(q) (n,) at configurations (n, d)  (equation 3): `speed_model` of `clearance`.
        To have others, set the model; metrics apply it to clearances that they have already."""
        return self.speed_model(self.clearance(q))

    def speed_on_grid(self, q: Array) -> Array:
        """`speed` for planners on grids, which ask for millions: by `approximate_clearance` where
        that is never more than the exact one."""
        return self.speed(q)

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        """Which paths, each (k, d), are proved free of collision, (n,) of bool, by the
        environment's batched clearances. See `envs.collision.continuous.paths_are_free`."""
        return batched.paths_are_free(
            self.clearance, self.robot.rate_bound, paths, tolerance, self.space
        )

    @property
    def sides(self) -> Sides | None:
        """What compiled code is told of `allowed`, of a point robot, to follow motions from where
        it is allowed to be: `EVERYWHERE` if all of such a motion is as well that touches nothing;
        None if only `allowed` tells, which is the default where there is one."""
        return EVERYWHERE if self.allowed is None else None

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        """Proofs that motions are free, for planners that are compiled themselves, to a tolerance
        in workspace units; None, which is the default, where there are only those in Python."""
        return None

    def contains(self, q: Array) -> Any:
        """Whether configurations (n, d) lie within the bounds, (n,) of bool.

        An excess of one part in 10^9 of the extent is taken for rounding.
        """
        return self.space.contains(q)

    def collision_model(self, tolerance: float | None = None) -> CollisionModel:
        """A new FCL model of this robot and scene, which decides to a tolerance in workspace units,
        by default that of the judge (`tolerance`)."""
        decides_to = self.tolerance if tolerance is None else tolerance
        return CollisionModel(
            self.robot,
            self.obstacles,
            decides_to,
            self.allowed,
            self.space,
            allowed_apart=self.allowed_apart,
            prover=self.prover,
            may_touch=self.may_touch,
            searcher=self.searcher,
            motion_check=lambda: self.motion_check(decides_to),
        )

    def plain_scene_of(self, robot: PlainRobot) -> PlainScene:
        """The `plain_scene` with a robot."""
        solids = tuple(obstacle.solid.plain(obstacle.pose) for obstacle in self.obstacles)
        wraps = self.space.wraps
        return PlainScene(
            *(self.fingerprint, self.lower, self.upper, wraps, self.tolerance),
            *(robot, solids, self.plain_names),
        )

    @property
    def plain_names(self) -> tuple[str, ...]:
        """What `plain_scene` calls the obstacles, each unlike any other."""
        return tuple(f"obstacle-{n}" for n in range(1, len(self.obstacles) + 1))

    def checked_pairs(self) -> CheckedPairs:
        """The pairs of shapes that must not touch in this scene, one by one, for messages."""
        return CheckedPairs(self.robot, self.obstacles, self.may_touch)

    @property
    def fingerprint(self) -> str:
        """A digest of `definition()`: equal exactly if scene and problems are equal."""
        return _digest(self.definition())

    @property
    def family_fingerprint(self) -> str:
        """A digest of `family_definition()`."""
        return _digest(self.family_definition())

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled, for other processes: nothing that is computed once, where it is asked
        for. Models of FCL could not be."""
        computed = {
            name
            for of in type(self).__mro__
            for name, value in vars(of).items()
            if isinstance(value, cached_property)
        }
        return {name: value for name, value in vars(self).items() if name not in computed}

    def configurations(self, q: Array) -> Array:
        """`q` as float64 (n, d).

        Raises:
            ValueError: it has another shape.
        """
        array = np.asarray(q, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != self.space.size:
            raise ValueError(f"configurations must be (n, {self.space.size}), not {array.shape}")
        return array


def _digest(definition: dict[str, Any]) -> str:
    text = json.dumps(definition, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
