"""Robots by Pinocchio, for checks of ours: it reads the URDF and moves the joints. Which of them
move, where the others stand and which links may touch is worked out here, from the same files."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio
import trimesh
from coal_shapes import ExactSolid, coal_geometry, coal_mesh, coal_pose
from exact_bodies import BodyMotion, pose_of
from exact_links import Links
from exact_scene import ExactScene, Joints
from exact_steps import Frames, carried_frames
from numpy.typing import NDArray

from envs.collision.shapes import PlacedShape
from envs.problem import Array

BASES = {"": 0, "planar": 3, "floating": 7}
"""Numbers of a configuration that place bases which stand still, drive or float."""

_ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""A base that is at the origin, and not turned."""

_ALWAYS = 2000
"""Configurations in which links are in contact that may be."""


@dataclass(frozen=True)
class RobotFiles:
    """A robot, and where it stands.

    Attributes:
        urdf, srdf: its files; the latter says which links may touch, if there is one.
        state: group states of the SRDF, in which the joints are that stand still.
        stands: x, y, z and a quaternion x, y, z, w, of its base, or of the frame in which it moves.
        drives: "planar" or "floating", if it moves.
    """

    urdf: Path
    srdf: Path | None = None
    state: str = ""
    stands: tuple[float, ...] = _ORIGIN
    drives: str = ""


class ExactArm(ExactScene):
    """A kinematic tree among obstacles, on a base that may drive or float: two joints more, of
    which the first slides.

    Args:
        files: of the robot.
        coordinates: names of the joints that move and mimic no other, in the order in which
            configurations have them, after the numbers of the base.
        obstacles: what is about it; what does not move may touch them.
        contacts: links that may touch obstacles as well: their names, and the obstacles' numbers.
    """

    def __init__(
        self,
        files: RobotFiles,
        coordinates: Sequence[str],
        obstacles: Sequence[PlacedShape],
        contacts: Collection[tuple[str, int]] = (),
    ) -> None:
        file = _for_urdfdom(files.urdf)
        self._links = Links(file, coordinates, files.srdf)
        self._contacts = frozenset(contacts)
        self._model = pinocchio.buildModelFromUrdf(str(file))
        self._data = self._model.createData()
        self._neutral = pinocchio.neutral(self._model)
        for name, value in self._links.still(list(self._model.names)[1:], files.state):
            _put(self._neutral, self._model.joints[self._model.getJointId(name)], value)
        names = list(self._model.names)
        self._moving = [n for n, name in enumerate(names) if name in self._links.followed]
        joints = [self._model.joints[n] for n in self._moving]
        self._values_at = np.array([joint.idx_q for joint in joints])
        self._columns_at = np.array([joint.idx_v for joint in joints])
        self._circles = [n for n, joint in enumerate(joints) if joint.nq == 2]
        follows = [self._links.followed[names[n]] for n in self._moving]
        self._follows = [one.coordinate for one in follows]
        self._ratios, self._offsets = np.array([one[1:] for one in follows]).T
        self.limits = self._limits(coordinates)
        self._stands = pinocchio.XYZQUATToSE3(np.array(files.stands))
        self.base = BASES[files.drives]
        geometries = list(_shapes(self._model, file).geometryObjects)
        self.links = [self._model.frames[one.parentFrame].name for one in geometries]
        solids = [ExactSolid(one.geometry) for one in geometries]
        solids += [ExactSolid(coal_geometry(obstacle.solid)) for obstacle in obstacles]
        pinocchio.computeJointJacobians(self._model, self._data, self._neutral)
        ways = [self._way_to(one.parentJoint) for one in geometries]
        bodies = [2 + way[-1] if way else 1 for way in ways] + [0] * len(obstacles)
        placed = map(self._offset, geometries, ways)
        offsets = np.array([*placed, *map(coal_pose, obstacles)])
        joints = self._joints(ways, offsets, solids)
        super().__init__(solids, bodies, offsets, joints, list(self._forbidden(joints)))

    def _limits(self, coordinates: Sequence[str]) -> Array:
        """Of the coordinates, (2, d); those of joints that turn for ever are -pi and pi."""
        joints = [self._model.joints[self._model.getJointId(name)] for name in coordinates]
        lower, upper = self._model.lowerPositionLimit, self._model.upperPositionLimit
        ends = [
            (-math.pi, math.pi) if joint.nq == 2 else (lower[joint.idx_q], upper[joint.idx_q])
            for joint in joints
        ]
        return np.array(ends).T

    def _way_to(self, joint: int) -> list[int]:
        """The joints that move between the base and a joint, as numbers of those that move; the
        last carries the body that moves with the joint."""
        return [self._moving.index(n) for n in self._model.supports[joint] if n in self._moving]

    def _offset(self, shape: Any, way: Sequence[int]) -> Array:
        """From a geometry's frame to its body's, (4, 4)."""
        there = self._data.oMi[shape.parentJoint] * shape.placement
        carried = self._data.oMi[self._moving[way[-1]]].inverse() * there if way else there
        offset: Array = carried.homogeneous
        return offset

    def _joints(
        self, ways: Sequence[list[int]], offsets: Array, solids: Sequence[ExactSolid]
    ) -> Joints:
        """Those of the base, and those that move on it.

        Args:
            ways: to the links' solids, which come first.
        """
        turns = np.linalg.norm(self._columns()[3:], axis=0) > 0.5
        ends = self._ratios * self.limits[:, self._follows] + self._offsets
        slides = np.where(turns, 0.0, np.abs(ends).max(axis=0))
        begins = [self._data.oMi[n].translation for n in self._moving]  # where none has slid
        moves = np.zeros((len(solids), 2 + len(turns)), dtype=np.bool_)
        reaches = np.zeros((2 + len(turns), len(solids)))
        for n, way in enumerate(ways):
            moves[n, :2] = self.base > 0
            moves[n, 2:][way] = True
            middle = offsets[n, :3, :3] @ solids[n].middle + offsets[n, :3, 3]
            reach = float(np.linalg.norm(middle)) + solids[n].radius
            for inner, joint in zip([None, *way][-2::-1], way[::-1], strict=True):
                reaches[2 + joint, n] = reach
                hop = begins[joint] - (0 if inner is None else begins[inner])
                reach += float(np.linalg.norm(hop)) + slides[joint]
            reaches[1, n] = reach
        return Joints(moves, np.array([False, True, *turns]), reaches)

    def _columns(self) -> Array:
        """What moves with the joints that move does at a unit speed of each, (6, m)."""
        found: Array = np.ascontiguousarray(self._data.J[:, self._columns_at])
        return found

    def _forbidden(self, joints: Joints) -> Iterator[tuple[int, int]]:
        """Pairs that must not touch: links and obstacles, and links that no joint joins, that are
        not told to be allowed to; but for those that do not move as seen from each other."""
        count = len(self.links)
        for i, j in zip(*np.triu_indices(len(joints.moves), 1), strict=True):
            if (joints.moves[i] == joints.moves[j]).all():
                continue
            if j >= count:
                may = (self.links[i], j - count) in self._contacts
            else:
                may = self._links.may_touch(self.links[i], self.links[j])
            if not may:
                yield int(i), int(j)

    def names(self, pairs: NDArray[np.int64]) -> list[frozenset[str]]:
        """What pairs (n, 2) of links' solids are called, see `numbered`."""
        named = numbered(self.links)
        return [frozenset((named[i], named[j])) for i, j in pairs]

    def leave_out_all_but(self, asked: Collection[frozenset[str]]) -> list[frozenset[str]]:
        """Asks only of pairs of links' solids that somebody else asks of, by their names.

        Returns:
            The pairs of which one of the two must not ask: such as the rules allow to touch, and
            such as may touch for being always in contact, but are not.
        """
        among = (self.pairs < len(self.links)).all(axis=1)
        named = self.names(self.pairs[among])
        left_out = self.pairs[among][[name not in asked for name in named]]
        found = [name for name in asked if name not in named]
        found += self.names(np.array(self._apart_at_times(left_out), dtype=np.int64).reshape(-1, 2))
        kept = [name in asked for name in named]
        self.ask_of([*map(tuple, self.pairs[among][kept]), *map(tuple, self.pairs[~among])])
        return found

    def _apart_at_times(self, pairs: NDArray[np.int64]) -> list[tuple[int, int]]:
        """Those (n, 2) that are not in contact in all of some thousand configurations."""
        every = [(int(i), int(j)) for i, j in pairs]
        always, whole = every, self.pairs
        self.ask_of(always)
        rng = np.random.default_rng(1)
        for q in rng.uniform(*self.limits, (_ALWAYS if always else 0, self.limits.shape[1])):
            touching = list(self.touching(self.frames(np.array([*_ORIGIN[: self.base], *q]))))
            if touching != always:
                always = touching
                self.ask_of(always)
        self.ask_of(list(map(tuple, whole)))
        return [pair for pair in every if pair not in always]

    def frames(self, q: Array) -> Frames:
        """At a configuration (d,), where nothing moves."""
        return ExactMotion(self, q, q).at(0.0)

    def motion(self, a: Array, b: Array) -> ExactMotion:
        """Between configurations (d,), by the shorter way where a joint turns for ever."""
        return ExactMotion(self, a, b)

    def base_pose(self, q: Array) -> Any:
        """Where the base is at a configuration (d,), as a `pinocchio.SE3`."""
        if not self.base:
            return self._stands
        return self._stands * pose_of(q[: self.base], 0.0 if self.base == BASES["planar"] else None)

    def frames_on(self, base: Frames, values: Array, rates: Array) -> Frames:
        """Where joints on a base have values (m,), and change at rates (m,)."""
        q = self._neutral.copy()
        q[self._values_at] = values
        for n in self._circles:  # in the order of cosine and sine
            place = self._values_at[n]
            q[place], q[place + 1] = math.cos(values[n]), math.sin(values[n])
        pinocchio.computeJointJacobians(self._model, self._data, q)
        turns, shifts = np.empty((len(values), 3, 3)), np.empty((len(values), 3))
        for n, joint in enumerate(self._moving):
            placed = self._data.oMi[joint]
            turns[n], shifts[n] = placed.rotation, placed.translation
        frames: Frames = carried_frames(base, turns, shifts, self._columns(), rates)
        return frames

    def values(self, q: Array) -> Array:
        """Of all joints that move on the base, (m,), where the coordinates have values (d,)."""
        found: Array = self._ratios * q[self._follows] + self._offsets
        return found

    def rates(self, a: Array, b: Array) -> Array:
        """How fast all joints that move on the base do so, (m,), from values (d,) of the
        coordinates to others."""
        ways = [math.remainder(d, 2 * math.pi) for d in b - a]
        found: Array = self._ratios * np.where(self._links.wraps, ways, b - a)[self._follows]
        return found


class ExactMotion:
    """Of an arm, see `exact_scene.Motion`."""

    def __init__(self, arm: ExactArm, a: Array, b: Array) -> None:
        self._arm = arm
        self._base = BodyMotion(arm.base_pose(a), arm.base_pose(b))
        a, b = a[arm.base :], b[arm.base :]
        self._begin, self._rates = arm.values(a), arm.rates(a, b)
        self.speeds = np.concatenate([self._base.speeds, np.abs(self._rates)])

    def at(self, t: float) -> Frames:
        values = self._begin + t * self._rates
        return self._arm.frames_on(self._base.at(t), values, self._rates)


def numbered(links: Sequence[str]) -> list[str]:
    """Names for links' solids: of a link's the name, and their numbers among its."""
    return [f"{link} {links[:n].count(link)}" for n, link in enumerate(links)]


def _put(q: Array, joint: Any, value: float) -> None:
    ends = [math.cos(value), math.sin(value)] if joint.nq == 2 else [value]
    q[joint.idx_q : joint.idx_q + joint.nq] = ends


def _shapes(model: Any, file: Path) -> Any:
    """The collision geometries of a URDF, sought in packages in all folders above it."""
    kind = pinocchio.GeometryType.COLLISION
    folders = [str(folder) for folder in file.resolve().parents]
    shapes = pinocchio.buildGeomFromUrdf(model, str(file), kind, package_dirs=folders)
    for shape in shapes.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase) and shape.meshPath.lower()[-4:] != ".dae":
            shape.geometry = _read(shape.meshPath, np.array(shape.meshScale))
    return shapes


def _for_urdfdom(file: Path) -> Path:
    """A copy, if need be, in which capsules are cylinders that Pinocchio is told to take for
    capsules: only the latest urdfdom reads them."""
    tree = ElementTree.parse(file)
    found = False
    for link in tree.getroot().findall("link"):
        told = ElementTree.SubElement(link, "collision_checking")  # of which only one is read
        for number, solid in enumerate(link.findall("collision")):
            capsule = solid.find("geometry/capsule")
            if capsule is not None:
                found, capsule.tag = True, "cylinder"
                name = solid.attrib["name"] = f"{link.attrib['name']}_{number}"
                ElementTree.SubElement(told, "capsule", name=name)
    if not found:
        return file
    copy = file.with_name("pinocchio.urdf")
    tree.write(copy)
    return copy


def _read(file: str, scale: Array) -> Any:
    """A mesh by trimesh. coal's own reader moves corners of OBJ files with several materials: a
    Panda's sixth link comes out up to 1 cm smaller."""
    mesh = trimesh.load_mesh(file, process=False)
    return coal_mesh(mesh.vertices * scale, mesh.faces)
