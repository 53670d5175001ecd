"""Arms in worlds of obstacles: those that ship, on generated cluttered tables, and users' own."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from envs.collision.shapes import Box, Cylinder, PlacedShape
from envs.errors import InputError
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.base_placement import BasePlacement
from envs.robots.named_robots import robot_named
from envs.robots.planning_group import PlanningGroup
from envs.robots.robot_description import RobotDescription
from envs.robots.srdf import Srdf, read_srdf
from envs.robots.urdf import read_urdf
from envs.robots.urdf_elements import numbers_of
from envs.scenes.arm_world import ArmWorld
from envs.scenes.scene_file import Scene, read_scene
from envs.seeding import stream

_MODELS = Path(__file__).parents[1] / "robots" / "models"


class ShippedArm(ArmWorld):
    """One of the arms that ship, at a table with shelves, posts and boxes. At least 60 % of the
    straight lines between the ends of its problems are blocked.

    Args:
        model: "arm4", "arm5" or "arm6".
        scene: the seed of what stands on the table, >= 0.
        self_collision: whether links must not touch each other; the paper ignores that.
        posts: how many stand on the table, from 0 to 40: the more, the harder.

    Raises:
        InputError: an argument is out of range.
    """

    most_free_of_five = 2

    def __init__(
        self, model: str, scene: int = 0, self_collision: bool = False, posts: int = 3
    ) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"{model}: scene must be between 0 and 2^32 - 1, not {scene}")
        if not 0 <= posts <= _MOST_POSTS:
            raise InputError(f"{model}: posts must be between 0 and {_MOST_POSTS}, not {posts}")
        tree, parts = read_urdf(_MODELS / f"{model}.urdf")
        super().__init__(Arm(tree, parts, self_collision), tabletop(scene, posts), model, (scene,))
        self._model_name = model

    @property
    def robot_name(self) -> str:
        return self._model_name


class UserArm(ArmWorld):
    """A robot from a URDF file, or one that has a name, among the solids of a scene file.

    At most one of `group`, `tip` and `joints` says which joints move: by default all that mimic no
    other. Their order is that of the robot's tree.

    Args:
        urdf: the robot, see `envs.robots.urdf.read_urdf`; or
        robot: its name, see `envs.robots.named_robots`. It has an `srdf`, a `state`, and a `group`,
            `tip` or `joints` of its own, each of which counts where nothing else is said.
        scene: a file of obstacles, our YAML or a planning scene of MoveIt in YAML or text (.scene),
            see `envs.scenes.scene_file.read_scene`; without one, nothing is about.
        self_collision: whether links that are not neighbours must not touch each other.
        srdf: the robot's SRDF file, with groups, states and links that may touch.
        group: the name of a planning group of the SRDF's.
        tip: the name of a link, for the joints between the base and it.
        joints: names of joints.
        state: the name of group states of the SRDF's, where the other joints stand.
        pose: where some of the others stand, as JOINT:VALUE in radians or metres. What neither
            says stands at 0, or as near as its limits allow.
        geometry: which geometry of the links collides, "collision" or "visual".
        base: where the base stands in the world, in which obstacles are placed: x, y, z, or these
            and roll, pitch, yaw, in metres and radians; by default at the origin. Of a base that
            moves, where the frame is in which it does.
        volume: between which corners planar and floating joints move that have no limits of their
            own: x, y, z of the lower one and then of the upper, in metres (of planar ones x, y will
            do), in the frame of the joint.

    Raises:
        InputError: a file cannot be used, or does not have what is named.
    """

    def __init__(
        self,
        urdf: str = "",
        scene: str = "",
        self_collision: bool = True,
        srdf: str = "",
        group: str = "",
        tip: str = "",
        joints: tuple[str, ...] = (),
        state: str = "",
        pose: tuple[str, ...] = (),
        geometry: str = "collision",
        robot: str = "",
        base: tuple[float, ...] = (),
        volume: tuple[float, ...] = (),
    ) -> None:
        named = _description(urdf, robot)
        if not (group or tip or joints):
            group, tip, joints = named.group, named.tip, named.joints
        file = Path(srdf) if srdf else named.srdf
        semantics = read_srdf(file) if file else Srdf()
        values = dict(map(_value_of, pose))
        planned = PlanningGroup(semantics, group, tip, joints, state or named.state, values)
        placement = BasePlacement.of_numbers(base, volume)
        tree, parts = read_urdf(named.urdf, planned, geometry, placement)
        links = [link.name for link in tree.links]
        still = {link.name: link.offset for link in tree.links if link.body == 0}
        about = read_scene(Path(scene), still) if scene else Scene(Path())
        about.check_names(links)
        allowed = semantics.allowed(links) | about.allowed_links(links)
        arm = Arm(tree, parts, self_collision, allowed)
        allows = about.touching(links)
        super().__init__(arm, about.obstacles, "arm", names=about.names, allows=allows)
        self._robot_name = robot

    @property
    def robot_name(self) -> str:
        return self._robot_name


def _description(urdf: str, robot: str) -> RobotDescription:
    """Of the robot that a file or a name stands for; that of a file has nothing of its own."""
    if urdf and robot:
        raise InputError("arm: urdf and robot both say which robot; give one of them")
    if robot:
        return robot_named(robot)
    if not urdf:
        raise InputError(
            "arm: urdf=FILE or robot=NAME is needed, and scene=FILE.yaml with the obstacles"
        )
    return RobotDescription(urdf, Path(urdf))


def _value_of(text: str) -> tuple[str, float]:
    """A joint's name and value."""
    name, _, value = text.rpartition(":")
    try:
        [number] = numbers_of("pose", value)
    except InputError as error:
        raise InputError(f"arm: pose={text!r} must be JOINT:VALUE, a finite number") from error
    return name, number


_TABLE = PlacedShape(Box(np.zeros(3), np.array([2.4, 2.4, 0.1])), np.eye(4))
_TABLE_TOP = -0.05  # under the base, which has a plinth

_POSTS, _MOST_POSTS = 3, 40
"""Posts that have a sector of their own, and how many there may be."""

_KEPT_CLEAR = 0.2
"""About the axis of the base, in metres, so that the arm can stand upright."""


def tabletop(scene: int, posts: int = _POSTS) -> list[PlacedShape]:
    """Solids in the frame of an arm's base, in metres, deterministic from `scene`.

    A table, a shelf of three boards and a back, three posts, a beam on one of them and three boxes,
    each in a sector of its own about the base. Further posts stand anywhere about it; all that
    stands among fewer stands there among more.
    """
    rng = stream("tabletop", scene)
    sectors = rng.uniform(-math.pi, math.pi) + 2 * math.pi / 7 * rng.permutation(7)
    around = sectors + rng.uniform(-0.2, 0.2, 7)
    solids = [PlacedShape(_TABLE.solid, _pose(0.0, 0.0, 0.0, _TABLE_TOP - 0.05))]
    solids += _shelf(rng, around[0])
    first = [_post(rng, angle) for angle in around[1 : 1 + _POSTS]]
    solids += first[:posts]
    solids.append(_beam(rng, around[4]))
    for angle in around[4:]:
        solids.append(_box(rng, angle))
    more = stream("further posts", scene)
    for _ in range(posts - _POSTS):
        solids.append(_post(more, more.uniform(-math.pi, math.pi)))
    return solids


def _pose(angle: float, out: float, turn: float, height: float, across: float = 0.0) -> Array:
    """Of what lies `out` from the axis of the base in a direction, `across` to the left of that and
    `height` up, turned about its own vertical."""
    x = out * math.cos(angle) - across * math.sin(angle)
    y = out * math.sin(angle) + across * math.cos(angle)
    c, s = math.cos(angle + turn), math.sin(angle + turn)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, height], [0, 0, 0, 1]])


def _shelf(rng: np.random.Generator, angle: float) -> list[PlacedShape]:
    """Boards that open toward the base, and the back that holds them."""
    out, width, depth = rng.uniform(0.5, 0.6), rng.uniform(0.5, 0.7), rng.uniform(0.22, 0.3)
    heights = np.cumsum(rng.uniform(0.24, 0.34, 3))
    boards = [
        PlacedShape(
            Box(np.zeros(3), np.array([depth, width, 0.02])),
            _pose(angle, out, 0.0, _TABLE_TOP + height),
        )
        for height in heights
    ]
    tall = float(heights[-1]) + 0.01
    back = Box(np.zeros(3), np.array([0.02, width, tall]))
    behind = _pose(angle, out + depth / 2, 0.0, _TABLE_TOP + tall / 2)
    return [*boards, PlacedShape(back, behind)]


def _post(rng: np.random.Generator, angle: float) -> PlacedShape:
    radius, tall = rng.uniform(0.025, 0.05), rng.uniform(0.5, 1.1)
    out = rng.uniform(_KEPT_CLEAR + 0.12, 0.65)
    return PlacedShape(Cylinder(radius, tall), _pose(angle, out, 0.0, _TABLE_TOP + tall / 2))


def _beam(rng: np.random.Generator, angle: float) -> PlacedShape:
    """A bar overhead that points at the axis of the base."""
    long, thick = rng.uniform(0.4, 0.6), rng.uniform(0.04, 0.08)
    out = _KEPT_CLEAR + 0.05 + long / 2
    bar = Box(np.zeros(3), np.array([long, thick, thick]))
    return PlacedShape(bar, _pose(angle, out, 0.0, rng.uniform(0.5, 0.75)))


def _box(rng: np.random.Generator, angle: float) -> PlacedShape:
    sides = rng.uniform([0.12, 0.12, 0.12], [0.25, 0.25, 0.35])
    out = rng.uniform(_KEPT_CLEAR + 0.18, 0.7)
    return PlacedShape(
        Box(np.zeros(3), sides),
        _pose(angle, out, rng.uniform(0, math.pi), _TABLE_TOP + sides[2] / 2),
    )
