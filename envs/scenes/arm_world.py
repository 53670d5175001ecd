"""Worlds of arms: the joints' box, the solids about the arm, clearances and certified motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.fcl_model import Allowed, Prover
from envs.collision.mesh import Containment
from envs.collision.motion_check import MotionCheck
from envs.collision.part_scenes import PartScenes, part_scenes
from envs.collision.shapes import PlacedShape, rounded
from envs.environment import LinkGeometry
from envs.plain_scene import PlainScene
from envs.problem import Array
from envs.robots import arm_clearance, rrt_connect
from envs.robots.arm import SLACK, Arm
from envs.robots.arm_prover import ArmProver
from envs.robots.plain_arm import plain_arm
from envs.robots.tip_and_stand import stand
from envs.scenes.arm_problems import ArmProblems
from envs.spaces import Space
from envs.speed_model import SpeedModel

_D_MAX = 0.05 / 0.4
"""Metres: the paper's 0.05, in whose space a metre is 0.4."""

_CONTACT = 0.02
"""The speed at contact, see `SpeedModel`: obstacles are thin here, too."""


class ArmWorld(ArmProblems):
    """An arm, or several on one base, among solids. Joints in radians (metres where they slide),
    lengths in metres, in the frame of the world. Joints without limits wrap.

    Args:
        arm: the robot.
        obstacles: solids; the base may touch them.
        kind: names the random streams of the problems, with `seeds`.
        names: of the obstacles, "" of those that have none; by default none has.
        allows: whether a link may touch an obstacle, by their names; by default none may. What has
            no name is not asked about.

    Its problems are those of `ArmProblems`.
    """

    units = MappingProxyType({"configuration": "rad", "workspace": "m"})
    trace_label = "tip of the tool"
    allowed_apart = True

    def __init__(
        self,
        arm: Arm,
        obstacles: Sequence[PlacedShape],
        kind: str,
        seeds: tuple[int, ...] = (),
        names: Sequence[str] = (),
        allows: Callable[[str, str], bool] | None = None,
    ) -> None:
        super().__init__(kind, seeds)
        self.robot: Arm = arm
        self.obstacles: Sequence[PlacedShape] = list(obstacles)
        self.lower, self.upper = arm.tree.lower, arm.tree.upper
        self.speed_model = SpeedModel(d_min=_D_MAX / 15, d_max=_D_MAX, contact=_CONTACT)
        self._names = names or [""] * len(obstacles)
        self._allows = allows

    @property
    def space(self) -> Space:
        return self.robot.tree.space

    @property
    def extent(self) -> float:
        return 2 * self.robot.extent

    @property
    def velocity_limits(self) -> Array | None:
        """As stated by the robot's file, if it states all."""
        stated = [joint.velocity for joint in self.robot.tree.coordinates]
        return None if None in stated else np.array(stated, dtype=float)

    @property
    def coordinate_names(self) -> Sequence[str]:
        joints = self.robot.tree.coordinates
        return [f"joint {j.name!r}" for j in joints for _ in range(4 if j.spherical else 1)]

    @property
    def shape_names(self) -> Sequence[str]:
        return [f"link {name!r}" for name in self.robot.links]

    @property
    def obstacle_names(self) -> Sequence[str]:
        """Those that they have, else their kinds and numbers."""
        others = super().obstacle_names
        both = zip(self._names, others, strict=True)
        return [f"obstacle {name!r}" if name else other for name, other in both]

    @property
    def plain_names(self) -> tuple[str, ...]:
        """Those that they have, but for names of links and for those that several have."""
        taken = {link.name for link in self.robot.tree.links}
        numbered = zip(self._names, super().plain_names, strict=True)
        return tuple(
            name if name and name not in taken and self._names.count(name) == 1 else number
            for name, number in numbered
        )

    @property
    def robot_name(self) -> str:
        """What its makers call the robot, where that is known; else empty."""
        return ""

    @property
    def plain_scene(self) -> PlainScene:
        robot = plain_arm(self.robot, self.robot_name, self.plain_names, self.may_touch)
        return self.plain_scene_of(robot)

    @cached_property
    def may_touch(self) -> NDArray[np.bool_] | None:
        if self._allows is None:
            return None
        links, names = self.robot.links[: self.robot.moving], self._names
        found = np.array(
            [[bool(name) and self._allows(link, name) for name in names] for link in links]
        )
        return found if found.any() else None

    @cached_property
    def scenes(self) -> PartScenes:
        """The obstacles as compiled code sees them, for each part."""
        reach = self.robot.extent + 2 * _D_MAX
        at = self.robot.tree.joints[0].origin[:3, 3]
        ends = at - reach, at + reach
        return part_scenes(self.obstacles, *ends, self.robot.moving, self.may_touch)

    @property
    def link_geometry(self) -> LinkGeometry:
        return LinkGeometry(self.robot.arrays, self.scenes)

    @cached_property
    def scenery(self) -> Sequence[PlacedShape]:
        """A stand, unless the solids of the base are there."""
        has_base = len(self.robot.shapes) > self.robot.moving
        return [] if has_base else stand(self.robot.tree)

    def clearance(self, q: Array) -> Array:
        """Distances (n,), in metres, by `CollisionModel`; just below 0 in contact. Of
        configurations (n, d) along a path they take less time."""
        q = self.configurations(q)
        found = self._model.clearances(q, self.robot.poses_along(q))
        return np.where(found <= 0, arm_clearance.TOUCHING, found)

    def approximate_clearance(self, q: Array) -> Array:
        """Never more than `clearance` in free space; see `envs.robots.arm_clearance`."""
        return arm_clearance.clearances(self.robot.arrays, self.scenes, self.configurations(q))

    def speed_on_grid(self, q: Array) -> Array:
        return self.speed_model(self.approximate_clearance(q))

    def paths_are_free(self, paths: Sequence[Array], tolerance: float) -> NDArray[np.bool_]:
        free = np.array([self._motions.are_free(path, tolerance) for path in paths], dtype=np.bool_)
        if self.allowed is not None:  # which cannot change along a path that touches nothing
            free &= self.allowed(np.array([path[0] for path in paths]))
        return free

    @cached_property
    def allowed(self) -> Allowed | None:
        containment = Containment(self.robot, self.obstacles, self.may_touch)
        return containment if containment.possible else None

    @property
    def prover(self) -> Prover:
        return self._prover_of(self.planning_tolerance)

    def _prover_of(self, tabled: float) -> ArmProver:
        return ArmProver(self.robot, self.obstacles, self.may_touch, tabled)

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        return self._prover_of(self.planning_tolerance).motion_check(tolerance)

    def definition(self) -> dict[str, Any]:
        model, tree = self.speed_model, self.robot.tree
        wraps, spherical = map(_listed, (tree.arrays.wraps, tree.arrays.spherical))
        pairs = [[i, j, round(self.kept[i, j], 6)] for i, j in self.robot.pairs]
        return {
            **({"pairs": pairs} if self.robot.self_collision else {}),
            **({"wraps": wraps} if wraps else {}),
            **({"spherical": spherical} if spherical else {}),
            **({} if tree.is_serial else {"tree": tree.definition()}),
            **(
                {}
                if self.may_touch is None
                else {"may_touch": np.argwhere(self.may_touch).tolist()}
            ),
            "class": "ArmWorld",
            "version": 1,
            "joints": [
                [
                    *(rounded(joint.origin[:3]), rounded(joint.axis)),
                    *(joint.prismatic, joint.lower, joint.upper),
                ]
                for joint in tree.joints
            ],
            "parts": [[part.body, part.placed.definition()] for part in self.robot.parts],
            "self_collision": self.robot.self_collision,
            "obstacles": [placed.definition() for placed in self.obstacles],
            "speed": [model.d_min, model.d_max, model.s_const, model.contact],
            "problems": [
                *(self.min_clearance, self.min_separation, self.most_free_of_five),
                *(rrt_connect.ITERATIONS, SLACK),
                *(self._kind, *self._seeds),
            ],
        }


def _listed(chosen: NDArray[np.bool_]) -> list[int]:
    found: list[int] = np.flatnonzero(chosen).tolist()
    return found
