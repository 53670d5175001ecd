"""What a network is told about an arm's configuration, besides the joints themselves, where an
environment has `link_geometry`.

Sines and cosines of the joints, where the bodies are, and how near to obstacles: a w-space
encoding through forward kinematics, computed instead of learned. It has its derivatives by the
joints.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from envs import Environment
from envs.collision.gjk import at
from envs.collision.part_scenes import PartScenes, scene_of
from envs.collision.primitive_sdf import NO_OBSTACLE, nearest, normal_at
from envs.compiled import njit_cached_quick
from envs.problem import Array
from envs.robots.arm import RobotArrays
from envs.robots.arm_clearance import part_clearances
from envs.robots.kinematic_tree import body_poses
from envs.speed_model import NormalizedSpeed
from planners.fields.computed_inputs import (
    PER_CLEARANCE,
    ComputedInputs,
    write_clearance_features,
    write_feature_slopes,
)
from planners.fields.laplacian_eigenmaps import ModeArrays
from planners.learning.normalizer import Normalizer


class ArmClearanceField(NamedTuple):
    """An arm and what is about it, as compiled code sees them.

    Configurations x are in the networks' space: joints are middle + extent x. Clearances are by
    d_max, see `envs.speed_model.SpeedModel`.

    Attributes:
        reach: d_max, in metres.
        speed: by clearance.
    """

    arm: RobotArrays
    scenes: PartScenes
    middle: Array
    extent: float
    reach: float
    speed: NormalizedSpeed

    @staticmethod
    def of(env: Environment) -> ArmClearanceField:
        """That of an environment.

        Raises:
            ValueError: it has no `link_geometry`.
        """
        if env.link_geometry is None:
            raise ValueError("this environment has no link_geometry")
        scale, model = Normalizer.of(env), env.speed_model
        arm, scenes = env.link_geometry
        return ArmClearanceField(
            arm, scenes, scale.middle, scale.extent, model.d_max, model.normalized
        )


class ArmInputs(ComputedInputs):
    """Inputs of a network: 2 d of the coordinates, then 3 and 3 for each of m bodies."""

    def __init__(self, env: Environment) -> None:
        super().__init__()
        self._field = ArmClearanceField.of(env)
        self.size = size_of_inputs(self._field.arm)

    @property
    def field(self) -> ArmClearanceField:
        return self._field

    @property
    def mode_arrays(self) -> ModeArrays:
        return ModeArrays.none()

    def at(self, x: Array, slopes: bool = True) -> Array:
        rows = np.zeros((len(x), 1 + x.shape[1], self.size))
        _all_inputs(self.field, x, rows)
        return rows


def size_of_inputs(arm: RobotArrays) -> int:
    """How many inputs there are of an arm."""
    joints, coordinates = len(arm.tree.parents), len(arm.tree.wraps)
    return 2 * coordinates + (3 + PER_CLEARANCE) * joints


@njit_cached_quick
def arm_inputs(field: Any, x: Any, rows: Any) -> None:
    """Writes the inputs at (d,), and their derivatives along each axis, (1 + d, size)."""
    d, m = len(x), len(field.arm.tree.parents)
    arm, extent = field.arm, field.extent
    q = field.middle + extent * x  # so that a derivative by x is `extent` times that by q
    bodies = np.empty((1 + m, 3, 4))
    body_poses(arm.tree, q, bodies)
    axes, origins = np.empty((m, 3)), np.empty((m, 3))
    joint_axes(arm, bodies, axes, origins)
    rows[:] = 0.0
    for i in range(d):
        rows[0, i], rows[0, d + i] = math.sin(q[i]), math.cos(q[i])
        rows[1 + i, i], rows[1 + i, d + i] = extent * rows[0, d + i], -extent * rows[0, i]
    slope, point, normal = np.zeros(d), np.empty(3), np.zeros(3)
    for body in range(1, 1 + m):
        at_point = 2 * d + 3 * (body - 1)
        at_clearance = 2 * d + 3 * m + PER_CLEARANCE * (body - 1)
        point[0], point[1], point[2] = at(bodies[body], _tip(arm, body))
        for i in range(3):
            rows[0, at_point + i] = point[i]
            for k in range(3):
                normal[k] = 1.0 if k == i else 0.0
            # A coordinate of a point changes as the point moves along that axis; a clearance, as
            # it moves along the direction from the nearest obstacle.
            _moved_along(arm, axes, origins, body, point, normal, slope)
            for k in range(d):
                rows[1 + k, at_point + i] = extent * slope[k]
        clearance, part, which = _nearest_ball(field, bodies, body, point)
        if which == NO_OBSTACLE:
            slope[:] = 0.0
        else:
            scene = scene_of(field.scenes, part)
            normal_at(scene, which, point[0], point[1], point[2], normal)
            _moved_along(arm, axes, origins, body, point, normal, slope)
        clearance /= field.reach
        counts = min(max(clearance, -0.5), 1.5)
        root, bounded = write_clearance_features(counts, rows, at_clearance)
        if counts == clearance:  # else it does not change there
            scale = extent / field.reach
            write_feature_slopes(clearance, root, bounded, slope, scale, rows, at_clearance)


@njit_cached_quick
def joint_axes(arm: Any, bodies: Any, axes: Any, origins: Any) -> None:
    """Writes the axes (m, 3) of the joints and a point (m, 3) of each, from the bodies' poses."""
    for i in range(len(axes)):
        pose, axis = bodies[i + 1], arm.tree.axes[i]
        for k in range(3):
            axes[i, k] = pose[k, 0] * axis[0] + pose[k, 1] * axis[1] + pose[k, 2] * axis[2]
            origins[i, k] = pose[k, 3]


@njit_cached_quick
def _moved_along(
    arm: Any, axes: Any, origins: Any, body: int, point: Any, normal: Any, slope: Any
) -> None:
    """Writes how fast a point (3,) of a body moves along `normal` (3,) by each coordinate, (d,)."""
    slope[:] = 0.0
    while body > 0:
        i = body - 1
        u, k, ratio = axes[i], arm.tree.coordinates[i], arm.tree.ratios[i]
        body = arm.tree.parents[i]
        if arm.tree.prismatic[i]:
            slope[k] += ratio * (u[0] * normal[0] + u[1] * normal[1] + u[2] * normal[2])
            continue
        x, y, z = point[0] - origins[i, 0], point[1] - origins[i, 1], point[2] - origins[i, 2]
        slope[k] += ratio * (
            normal[0] * (u[1] * z - u[2] * y)
            + normal[1] * (u[2] * x - u[0] * z)
            + normal[2] * (u[0] * y - u[1] * x)
        )


@njit_cached_quick
def _tip(arm: Any, body: int) -> Any:
    """Where, in a body's frame (3,), the first joint on it is, or the middle of its last part; of
    a body with neither, whatever it carries along."""
    for joint in range(body, len(arm.tree.parents)):
        if arm.tree.parents[joint] == body:
            return arm.tree.origins[joint][:, 3].copy()
    tip = arm.moving - 1
    for part in range(arm.moving):
        if arm.bodies[part] == body:
            tip = part
    return arm.middles[tip].copy()


@njit_cached_quick
def _nearest_ball(field: Any, bodies: Any, body: int, center: Any) -> tuple[float, int, int]:
    """The distance of a body's spheres from obstacles, the part that the nearest sphere is of, and
    the number of the obstacle in that part's scene. The centre (3,) of the sphere is written."""
    arm = field.arm
    least, nearest_part, which = np.inf, 0, NO_OBSTACLE
    pose = bodies[body]
    for part in range(arm.moving):
        if arm.bodies[part] != body:
            continue
        scene = scene_of(field.scenes, part)
        for ball in range(arm.first_balls[part], arm.first_balls[part + 1]):
            x, y, z = at(pose, arm.balls[ball])
            radius = arm.balls[ball, 3]
            distance, obstacle = nearest(scene, x, y, z, least + radius)
            if obstacle != NO_OBSTACLE:
                least, nearest_part, which = distance - radius, part, obstacle
                center[0], center[1], center[2] = x, y, z
    return least, nearest_part, which


@njit_cached_quick
def arm_clearance_at(field: Any, x: Any) -> float:
    """The clearance at (d,), by d_max."""
    parts = np.empty(field.arm.moving)
    q = field.middle + field.extent * x.astype(np.float64)
    clearance: float = part_clearances(field.arm, field.scenes, q, parts, np.inf) / field.reach
    return clearance


@njit_cached_quick
def arm_outward(field: Any, x: Any, missing: float, step: Any) -> None:
    """Writes a step (d,) from (d,) along the gradient of the clearance from obstacles, by which
    that grows by about `missing`; no longer than `_LONGEST_PUSH`."""
    m = len(field.arm.tree.parents)
    bodies = np.empty((1 + m, 3, 4))
    body_poses(field.arm.tree, field.middle + field.extent * x.astype(np.float64), bodies)
    axes, origins = np.empty((m, 3)), np.empty((m, 3))
    joint_axes(field.arm, bodies, axes, origins)
    least, nearest_body, nearest_part, obstacle = np.inf, 0, 0, NO_OBSTACLE
    center, point, normal = np.zeros(3), np.zeros(3), np.zeros(3)
    for body in range(1, 1 + m):
        distance, part, which = _nearest_ball(field, bodies, body, point)
        if distance < least:
            least, nearest_body, nearest_part, obstacle = distance, body, part, which
            center[:] = point
    step[:] = 0.0
    if obstacle == NO_OBSTACLE:
        return
    scene = scene_of(field.scenes, nearest_part)
    normal_at(scene, obstacle, center[0], center[1], center[2], normal)
    _moved_along(field.arm, axes, origins, nearest_body, center, normal, step)
    per_length = math.sqrt((step**2).sum()) * field.extent / field.reach
    if per_length > 0:
        length = min(missing / per_length, _LONGEST_PUSH)
        step *= length / math.sqrt((step**2).sum())


_LONGEST_PUSH = 0.02
"""In the networks' space."""


@njit_cached_quick
def _all_inputs(field: Any, x: Any, rows: Any) -> None:
    for n in range(len(x)):
        arm_inputs(field, x[n], rows[n])
