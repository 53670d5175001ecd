"""Robots and scenes as plain data: numbers and text, for planners that are other programs.

A planner that brings a collision model of its own, in an interpreter that may have nothing of ours
but NumPy, is told here what it has to know. Lengths are in workspace units (of arms metres), angles
in radians; poses are (4, 4), to the frame of the world.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array

_NO_VERTICES, _NO_TRIANGLES = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class PlainSolid:
    """A solid.

    Attributes:
        kind: "box", "sphere", "cylinder", "capsule" or "mesh"; each about the origin of its frame,
            rods along z. A capsule's length is between the centres of its balls.
        sizes: its lengths by the names that URDF has for them, as {"radius": (0.05,), "length":
            (0.4,)}; none of a mesh.
        pose: (4, 4).
        vertices, triangles: (n, 3) in its frame and (m, 3), of a mesh.
    """

    kind: str
    sizes: Mapping[str, tuple[float, ...]]
    pose: Array
    vertices: Array = field(default_factory=lambda: _NO_VERTICES)
    triangles: NDArray[np.int64] = field(default_factory=lambda: _NO_TRIANGLES)

    def moved(self, pose: Array) -> PlainSolid:
        """The same in the frame in which its own is at a pose (4, 4)."""
        return PlainSolid(self.kind, self.sizes, pose @ self.pose, self.vertices, self.triangles)

    def pieces(self) -> list[PlainSolid]:
        """The same as kinds that every program has: a capsule is a cylinder and two balls."""
        if self.kind != "capsule":
            return [self]
        found = [PlainSolid("cylinder", self.sizes, self.pose)]
        [length] = self.sizes["length"]
        for end in (-length / 2, length / 2):
            place = np.eye(4)
            place[2, 3] = end
            found.append(PlainSolid("sphere", {"radius": self.sizes["radius"]}, self.pose @ place))
        return found


@dataclass(frozen=True, eq=False)
class PlainLink:
    """A link, which moves as one.

    Attributes:
        name: unlike that of any other.
        solids: what of it collides, in its frame.
        touches: names of other links that it may touch.
        touches_obstacles: names of obstacles that it may touch, or be within.
    """

    name: str
    solids: tuple[PlainSolid, ...] = ()
    touches: tuple[str, ...] = ()
    touches_obstacles: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PlainJoint:
    """A joint that joins a link to another.

    Attributes:
        name: unlike that of any other.
        kind: "revolute", "continuous", which turns for ever, "prismatic", "spherical" or "fixed".
        parent, child: names of links; a link is the child of one joint at most.
        origin: (4, 4), from the frame of the child, with the joint at 0, to that of the parent.
        axis: (3,) of unit length, in the child's frame.
        lower, upper: limits, in radians or metres.
        velocity: its limit, in radians or metres a second; None if none is known.
        follows: "" if it has a number of its own in configurations; else the name of the joint
            that it follows, by `ratio` times its value plus `offset`.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float
    upper: float
    velocity: float | None = None
    follows: str = ""
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class PlainRobot:
    """A robot: links and joints, or a ball that translates.

    Attributes:
        name: of the robot, as its makers call it where that is known.
        links: the first one stands still, and its frame is that of the world.
        joints: each after the one that carries its parent; those that follow none are in the order
            of a configuration's numbers.
        radius: of a ball, whose configuration is its middle; None of others.
    """

    name: str
    links: tuple[PlainLink, ...] = ()
    joints: tuple[PlainJoint, ...] = ()
    radius: float | None = None


@dataclass(frozen=True, eq=False)
class PlainScene:
    """What a planner has to know of an environment.

    Attributes:
        fingerprint: of the environment, equal exactly if scenes are.
        lower, upper: (d,) bounds of configurations.
        wraps: (d,) of bool, which numbers turn for ever: their bounds are the same place.
        tolerance: that motions are to be proved to, in workspace units, by whoever can.
        robot: the moving body.
        obstacles, names: solids in the frame of the world, and what they are called, each unlike
            any other.

    Example:
        >>> import envs
        >>> scene = envs.make("arm6").plain_scene
        >>> [joint.name for joint in scene.robot.joints][:2]
        ['shoulder_pan', 'shoulder_lift']
        >>> data, numbers = scene.packed()
        >>> PlainScene.of(data, numbers).obstacles[0].kind
        'box'
    """

    fingerprint: str
    lower: Array
    upper: Array
    wraps: NDArray[np.bool_]
    tolerance: float
    robot: PlainRobot
    obstacles: tuple[PlainSolid, ...]
    names: tuple[str, ...]

    @property
    def named_obstacles(self) -> Iterator[tuple[str, PlainSolid]]:
        """Each obstacle with its name."""
        return zip(self.names, self.obstacles, strict=True)

    def packed(self) -> tuple[dict[str, Any], Array]:
        """JSON data, and all arrays' numbers (n,) one after the other."""
        arrays: list[Array] = []
        data = _packed(self, arrays)
        return data, np.concatenate(arrays)

    @staticmethod
    def of(data: Mapping[str, Any], numbers: Array) -> PlainScene:
        """That of what `packed` gives."""
        scene: PlainScene = _unpacked(data, numbers)
        return scene


_CLASSES: dict[str, type[Any]] = {
    cls.__name__: cls for cls in (PlainSolid, PlainLink, PlainJoint, PlainRobot, PlainScene)
}
_CLASS, _ARRAY = "class", "array"  # keys of what stands for an object, and for an array


def _packed(value: Any, arrays: list[Array]) -> Any:
    """JSON data of anything above. The numbers of arrays are put aside; where they begin there, the
    shape and the type stay."""
    if isinstance(value, np.ndarray):
        begin = sum(map(len, arrays))
        arrays.append(value.astype(np.float64).ravel())
        return {_ARRAY: [begin, list(value.shape), value.dtype.str]}
    if isinstance(value, tuple):
        return [_packed(one, arrays) for one in value]
    if isinstance(value, Mapping):
        return {key: _packed(one, arrays) for key, one in value.items()}
    if type(value).__name__ in _CLASSES:
        fields = {name: _packed(one, arrays) for name, one in vars(value).items()}
        return {_CLASS: type(value).__name__, **fields}
    return value


def _unpacked(data: Any, numbers: Array) -> Any:
    if isinstance(data, list):
        return tuple(_unpacked(one, numbers) for one in data)
    if not isinstance(data, Mapping):
        return data
    if _ARRAY in data:
        begin, shape, kind = data[_ARRAY]
        flat = numbers[begin : begin + int(np.prod(shape))]
        return flat.reshape(shape).astype(kind)
    made = {key: _unpacked(one, numbers) for key, one in data.items() if key != _CLASS}
    return _CLASSES[data[_CLASS]](**made) if _CLASS in data else made
