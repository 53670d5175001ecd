"""Forward kinematics of kinematic trees, for many configurations at once.

Frames: every link has one, as in URDF. Fixed and locked joints are folded, so what moves as one is
a `body`: body 0 is the base, which stands still, and body i is what moving joint i - 1 carries. A
body has a greater number than the one that it is joined to. All poses are in the frame of the base.
Angles are in radians, lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from envs.collision.gjk import compose
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array
from envs.spaces import Coordinates, Part, Rotations, Space


class Mimic(NamedTuple):
    """How a joint follows another: its value is ratio times the other's, plus offset.

    Attributes:
        joint: the number of the other one, which follows none.
        ratio, offset: in radians or metres, as either turns or slides.
    """

    joint: int
    ratio: float
    offset: float


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that moves.

    Attributes:
        name: for messages.
        origin: (4, 4), from the frame of the joint at 0 to that of the body before it.
        axis: (3,) of unit length, in the joint's frame; 0 of a spherical one.
        prismatic: whether it slides along the axis instead of turning about it.
        lower, upper: limits, in radians or metres; of one that follows another, the least and
            greatest value that it comes to so.
        velocity: the limit of its velocity, in radians or metres a second; None if none is stated.
        wraps: whether it turns for ever: its limits are a turn apart, and the same place.
        mimic: how it follows another joint, if it does.
        spherical: whether it turns any way. Its value is a unit quaternion x, y, z, w, from the
            frame of what it carries; it follows none.
    """

    name: str
    origin: Array
    axis: Array
    prismatic: bool
    lower: float
    upper: float
    velocity: float | None = None
    wraps: bool = False
    mimic: Mimic | None = None
    spherical: bool = False

    @property
    def numbers(self) -> int:
        """How many numbers a configuration has for it, if it follows none."""
        return 4 if self.spherical else 1

    @property
    def slide(self) -> float:
        """How far, in metres, it moves along its axis at most."""
        return max(abs(self.lower), abs(self.upper)) if self.prismatic else 0.0


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
class KinematicTree:
    """A base, and bodies that joints join to it and to each other.

    A configuration has a number for each joint that follows no other, and of a spherical one four.

    Attributes:
        joints: joint i carries body i + 1.
        links: depth first from the base.
        parents: of each joint, the number of the body that it is joined to, no greater than its
            own number.
    """

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    parents: tuple[int, ...]

    @classmethod
    def serial(cls, joints: tuple[Joint, ...], links: tuple[Link, ...]) -> KinematicTree:
        """A chain, each joint on the body that the one before carries."""
        return cls(joints, links, tuple(range(len(joints))))

    @property
    def is_serial(self) -> bool:
        """Whether each body is joined to the one before, and no joint follows another."""
        in_line = self.parents == tuple(range(len(self.joints)))
        return in_line and len(self.coordinates) == len(self.joints)

    @cached_property
    def coordinates(self) -> tuple[Joint, ...]:
        """The joints that follow no other."""
        return tuple(joint for joint in self.joints if joint.mimic is None)

    @property
    def dimension(self) -> int:
        """The degrees of freedom."""
        return self.space.dimension

    @property
    def lower(self) -> Array:
        """Of configurations, (d,)."""
        return self.space.lower

    @property
    def upper(self) -> Array:
        """Of configurations, (d,)."""
        return self.space.upper

    @cached_property
    def space(self) -> Space:
        """Of its configurations, in which joints that turn for ever wrap. Spherical joints are
        parts of their own, in which a radian counts as it does of others."""
        runs = groupby(self.coordinates, lambda joint: joint.spherical)
        parts = [self._parts(list(joints), spherical) for spherical, joints in runs]
        return Space([part for some in parts for part in some])

    @staticmethod
    def _parts(joints: Sequence[Joint], spherical: bool) -> list[Part]:
        """Of joints one after another that are all spherical, or none of them."""
        if spherical:
            return [Rotations() for _ in joints]
        ends = ([joint.lower for joint in joints], [joint.upper for joint in joints])
        return [Coordinates(*ends, [joint.wraps for joint in joints])]

    def joints_to(self, body: int) -> Iterator[int]:
        """The numbers of the joints between a body and the base, from the body on."""
        while body > 0:
            yield body - 1
            body = self.parents[body - 1]

    def branch(self, body: int, other: int) -> int:
        """The number of the body on which two bodies branch: the last on the ways to both; if one
        of them is on the way to the other, that one."""
        on_way = {0, *(joint + 1 for joint in self.joints_to(body))}
        return max(on_way & {0, *(joint + 1 for joint in self.joints_to(other))})

    @cached_property
    def arrays(self) -> TreeArrays:
        """What compiled code is given."""
        numbers = [0 if joint.mimic else joint.numbers for joint in self.joints]
        places = np.cumsum([0, *numbers[:-1]])
        follows = [joint.mimic or Mimic(n, 1.0, 0.0) for n, joint in enumerate(self.joints)]
        return TreeArrays(
            np.array(self.parents),
            np.array([joint.origin[:3] for joint in self.joints]),
            np.array([joint.axis for joint in self.joints]),
            np.array([joint.prismatic for joint in self.joints]),
            places[[one.joint for one in follows]],
            np.array([one.ratio for one in follows]),
            np.array([one.offset for one in follows]),
            self.space.wraps,
            np.array([joint.spherical for joint in self.joints]),
        )

    def motions(self, path: Array) -> Iterator[tuple[TreeArrays, Array]]:
        """A path of waypoints (k, d), k >= 1, for compiled code, which takes numbers to change
        evenly: in one piece, but where there are spherical joints motion by motion.

        Yields:
            The tree as it is on some of the path, and that as waypoints (j, d) of numbers: beyond
            the bounds where they wrap, and of a spherical joint the angle about a fixed axis.
        """
        if not self.arrays.spherical.any():
            yield self.arrays, self.space.unwrapped(path)
            return
        for a, b in pairwise(path if len(path) > 1 else path.repeat(2, axis=0)):
            yield self._motion(a, b)

    def _motion(self, a: Array, b: Array) -> tuple[TreeArrays, Array]:
        """On its shortest way a spherical joint turns evenly about one axis, as others do, from
        where it is at the beginning."""
        origins, axes = self.arrays.origins.copy(), self.arrays.axes.copy()
        ends = np.array([a, b])
        for part, at in zip(self.space.parts, self.space.places, strict=True):
            step = part.difference(a[at], b[at])
            if len(step) == part.size:
                ends[1, at] = a[at] + step
                continue
            [joint] = np.flatnonzero(self.arrays.coordinates == at.start)
            angle = float(np.linalg.norm(step))
            axes[joint] = step / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
            origins[joint, :, :3] @= Rotation.from_quat(a[at]).as_matrix()
            ends[:, at] = 0.0
            ends[1, at.start] = angle
        none = np.zeros_like(self.arrays.spherical)
        return self.arrays._replace(origins=origins, axes=axes, spherical=none), ends

    def definition(self) -> list[list[float]]:
        """Of each joint what it is joined to and which coordinate it follows, with ratio and
        offset, as JSON data."""
        arrays = self.arrays
        columns = arrays.parents, arrays.coordinates, arrays.ratios, arrays.offsets
        return [list(row) for row in zip(*(column.tolist() for column in columns), strict=True)]

    def forward(self, q: Array) -> Array:
        """Poses (n, links, 4, 4) of the links at configurations (n, d)."""
        configurations = np.ascontiguousarray(q, dtype=np.float64)
        if configurations.ndim != 2 or configurations.shape[1] != self.space.size:
            raise ValueError(
                f"configurations must be (n, {self.space.size}), not {configurations.shape}"
            )
        bodies, offsets = self._link_arrays
        poses = np.zeros((len(configurations), len(bodies), 4, 4))
        _forward(self.arrays, configurations, bodies, offsets, poses)
        return poses

    @cached_property
    def _link_arrays(self) -> tuple[NDArray[np.int64], Array]:
        bodies = np.array([link.body for link in self.links])
        return bodies, np.array([link.offset[:3] for link in self.links])


class TreeArrays(NamedTuple):
    """A tree's m joints as compiled code sees them.

    Poses in compiled code are (3, 4), the upper rows of homogeneous ones.

    Attributes:
        parents: (m,) bodies that they are joined to.
        origins, axes, prismatic: (m, 3, 4), (m, 3), (m,).
        coordinates, ratios, offsets: (m,) which number of a configuration each follows, of a
            spherical one the first of four, and how.
        wraps: (d,) which numbers wrap.
        spherical: (m,) which turn any way.
    """

    parents: NDArray[np.int64]
    origins: Array
    axes: Array
    prismatic: NDArray[np.bool_]
    coordinates: NDArray[np.int64]
    ratios: Array
    offsets: Array
    wraps: NDArray[np.bool_]
    spherical: NDArray[np.bool_]


@njit_hot
def body_poses(tree: Any, q: Any, poses: Any) -> None:
    """Writes the poses (1 + m, 3, 4) of the bodies at a configuration (d,)."""
    poses[0] = 0.0
    for i in range(3):
        poses[0, i, i] = 1.0
    for joint in range(len(tree.parents)):
        pose = poses[joint + 1]
        compose(poses[tree.parents[joint]], tree.origins[joint], pose)
        if tree.spherical[joint]:
            _rotate(pose, q, tree.coordinates[joint])
            continue
        value = joint_value(tree, joint, q)
        if tree.prismatic[joint]:
            _slide(pose, tree.axes[joint], value)
        else:
            _turn(pose, tree.axes[joint], value)


@njit_hot
def body_motions(tree: Any, q: Any, speeds: Any, poses: Any, shifts: Any, spins: Any) -> None:
    """Writes the poses (1 + m, 3, 4) of the bodies at a configuration (d,), the velocities
    (1 + m, 3) of their origins, and their angular velocities (1 + m, 3), while joints, none of them
    spherical, change by speeds (m,)."""
    body_poses(tree, q, poses)
    shifts[0] = 0.0
    spins[0] = 0.0
    for joint in range(len(tree.parents)):
        body, parent = joint + 1, tree.parents[joint]
        pose, axis, speed = poses[body], tree.axes[joint], speeds[joint]
        here, there, spin = poses[parent], pose, spins[parent]
        x, y, z = there[0, 3] - here[0, 3], there[1, 3] - here[1, 3], there[2, 3] - here[2, 3]
        u, v, w = spin[0], spin[1], spin[2]
        shifts[body, 0] = shifts[parent, 0] + v * z - w * y
        shifts[body, 1] = shifts[parent, 1] + w * x - u * z
        shifts[body, 2] = shifts[parent, 2] + u * y - v * x
        for i in range(3):
            along = speed * (pose[i, 0] * axis[0] + pose[i, 1] * axis[1] + pose[i, 2] * axis[2])
            spins[body, i] = spins[parent, i]
            if tree.prismatic[joint]:
                shifts[body, i] += along
            else:
                spins[body, i] += along


@njit_hot
def joint_value(tree: Any, joint: int, q: Any) -> float:
    """Of a joint at a configuration (d,)."""
    value: float = tree.ratios[joint] * q[tree.coordinates[joint]] + tree.offsets[joint]
    return value


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


@njit_hot
def _rotate(pose: Any, q: Any, at: int) -> None:
    """Turns a pose (3, 4) by a quaternion x, y, z, w, whose numbers begin at a place of q, and
    whose length is made 1: those of judged paths may be off by 1e-6. As `_turn` does, where (x, y,
    z) is sin(angle / 2) axis, and w is cos(angle / 2)."""
    x, y, z, w = q[at], q[at + 1], q[at + 2], q[at + 3]
    double = 2.0 / (x * x + y * y + z * z + w * w)
    c = double * w * w - 1.0
    for i in range(3):
        u, v, t = pose[i, 0], pose[i, 1], pose[i, 2]
        along = double * (u * x + v * y + t * z)
        pose[i, 0] = u * c + double * w * (v * z - t * y) + along * x
        pose[i, 1] = v * c + double * w * (t * x - u * z) + along * y
        pose[i, 2] = t * c + double * w * (u * y - v * x) + along * z


@njit_cached
def _forward(tree: Any, q: Any, bodies: Any, offsets: Any, poses: Any) -> None:
    at_body = np.empty((1 + len(tree.parents), 3, 4))
    for n in range(len(q)):
        body_poses(tree, q[n], at_body)
        for link in range(len(bodies)):
            compose(at_body[bodies[link]], offsets[link], poses[n, link])
            poses[n, link, 3, 3] = 1.0
