"""Forward kinematics of serial chains, for many configurations at once.

Frames: every link has one, as in URDF. Fixed joints are folded, so what moves as one is a `body`:
body 0 is the base, which stands still, and body i is what moving joint i - 1 carries. All poses
are in the frame of the base. Angles are in radians, lengths in metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.gjk import compose
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that moves.

    Attributes:
        name: for messages.
        origin: (4, 4), from the frame of the joint at 0 to that of the body before it.
        axis: (3,) of unit length, in the joint's frame.
        prismatic: whether it slides along the axis instead of turning about it.
        lower, upper: limits, in radians or metres.
        velocity: the limit of its velocity, in radians or metres a second; None if none is stated.
    """

    name: str
    origin: Array
    axis: Array
    prismatic: bool
    lower: float
    upper: float
    velocity: float | None = None


@dataclass(frozen=True, eq=False)
class Link:
    """A link, rigidly joined to a body.

    Attributes:
        name: as in URDF.
        body: its number.
        offset: (4, 4), from the link's frame to the body's.
        parent: the name of the link that a joint joins it to; of the base, none.
    """

    name: str
    body: int
    offset: Array
    parent: str = ""


@dataclass(frozen=True, eq=False)
class Chain:
    """A base and bodies, each joined to the one before.

    Attributes:
        joints: from the base on; joint i carries body i + 1.
        links: in the order of the chain.
    """

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]

    @property
    def dimension(self) -> int:
        """d, the number of joints that move."""
        return len(self.joints)

    @cached_property
    def arrays(self) -> ChainArrays:
        """What compiled code is given."""
        return ChainArrays(
            np.array([joint.origin[:3] for joint in self.joints]),
            np.array([joint.axis for joint in self.joints]),
            np.array([joint.prismatic for joint in self.joints]),
        )

    def forward(self, q: Array) -> Array:
        """Poses (n, links, 4, 4) of the links at configurations (n, d)."""
        configurations = np.ascontiguousarray(q, dtype=np.float64)
        if configurations.ndim != 2 or configurations.shape[1] != self.dimension:
            raise ValueError(
                f"configurations must be (n, {self.dimension}), not {configurations.shape}"
            )
        bodies, offsets = self._link_arrays
        poses = np.zeros((len(configurations), len(bodies), 4, 4))
        _forward(self.arrays, configurations, bodies, offsets, poses)
        return poses

    @cached_property
    def _link_arrays(self) -> tuple[NDArray[np.int64], Array]:
        bodies = np.array([link.body for link in self.links])
        return bodies, np.array([link.offset[:3] for link in self.links])


class ChainArrays(NamedTuple):
    """A chain's joints as compiled code sees them: origins (d, 3, 4), axes (d, 3), prismatic (d,).

    Poses in compiled code are (3, 4), the upper rows of homogeneous ones.
    """

    origins: Array
    axes: Array
    prismatic: NDArray[np.bool_]


@njit_hot
def body_poses(chain: Any, q: Any, poses: Any) -> None:
    """Writes the poses (1 + d, 3, 4) of the bodies at a configuration (d,)."""
    poses[0] = 0.0
    for i in range(3):
        poses[0, i, i] = 1.0
    for joint in range(len(q)):
        pose = poses[joint + 1]
        compose(poses[joint], chain.origins[joint], pose)
        if chain.prismatic[joint]:
            _slide(pose, chain.axes[joint], q[joint])
        else:
            _turn(pose, chain.axes[joint], q[joint])


@njit_hot
def _slide(pose: Any, axis: Any, value: float) -> None:
    """Moves a pose (3, 4) along an axis of its own."""
    for i in range(3):
        along = pose[i, 0] * axis[0] + pose[i, 1] * axis[1] + pose[i, 2] * axis[2]
        pose[i, 3] += value * along


@njit_hot
def _turn(pose: Any, axis: Any, angle: float) -> None:
    """Turns a pose (3, 4) about an axis of its own, by Rodrigues' formula for each of its rows r:
    the new one is r cos + (r x axis) sin + (r axis)(1 - cos) axis."""
    x, y, z = axis[0], axis[1], axis[2]
    c, s = math.cos(angle), math.sin(angle)
    for i in range(3):
        u, v, w = pose[i, 0], pose[i, 1], pose[i, 2]
        along = (u * x + v * y + w * z) * (1.0 - c)
        pose[i, 0] = u * c + (v * z - w * y) * s + along * x
        pose[i, 1] = v * c + (w * x - u * z) * s + along * y
        pose[i, 2] = w * c + (u * y - v * x) * s + along * z


@njit_cached
def _forward(chain: Any, q: Any, bodies: Any, offsets: Any, poses: Any) -> None:
    at_body = np.empty((1 + q.shape[1], 3, 4))
    for n in range(len(q)):
        body_poses(chain, q[n], at_body)
        for link in range(len(bodies)):
            compose(at_body[bodies[link]], offsets[link], poses[n, link])
            poses[n, link, 3, 3] = 1.0
