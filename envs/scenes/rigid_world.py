"""Rigid bodies that move, and turn, in the scenes of point robots."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

import envs
from envs.collision.shapes import Mesh
from envs.environment import Environment
from envs.errors import InputError, suggestion
from envs.problem import Array, Problem
from envs.registry.arguments import argument_text
from envs.robots.bodies import body as body_of
from envs.robots.point import PointRobot
from envs.robots.rigid_body import (
    SLACK,
    InSpace,
    InThePlane,
    Placement,
    RigidBody,
    Translation,
    radius_of,
)
from envs.scenes.rigid_body_world import DRAWS, SEARCH, RigidBodyWorld
from envs.seeding import derived_seed

SPACES = ("se3", "se2", "r3")


class RigidWorld(RigidBodyWorld):
    """A rigid body in the scene of a point robot.

    Configurations are x, y, z and the unit quaternion x, y, z, w of SE(3); or x, y and the heading
    of SE(2), in the plane at `z`; or x, y, z of translations. A length is that of the positions and
    what the body's farthest point travels by turning, unless `weight` says otherwise.

    The ends of problems are uniform in free space, keep a hundredth of the world's longest side
    clear, or less if its own problems do, have positions a fifth of it apart, and are joined by a
    long search.

    Args:
        body: "box", "l", "cross", "piano" (boxes), or a mesh file with a closed surface.
        space: "se3", "se2" or "r3".
        world: any environment of a point robot in space; arguments that are not of this list are
            its, as `scene` of "c3d" or `file` of "mesh".
        size: the body's longest side, in world units; 0 for that of the file.
        z: of the plane of SE(2).
        weight: of a radian of turning in distances, in world units; 0 for the body's radius.

    Raises:
        InputError: an argument is out of range, or the world's are.
    """

    advice = "make the body smaller, as in size=1, or take another scene"

    def __init__(
        self,
        body: str = "piano",
        space: str = "se3",
        world: str = "c3d",
        size: float = 2.0,
        z: float = 0.0,
        weight: float = 0.0,
        **of_world: str,
    ) -> None:
        if space not in SPACES:
            raise InputError(f"rigid: no space is called {space!r}; {suggestion(space, SPACES)}")
        if not 0 <= weight <= 1000:
            raise InputError(f"rigid: weight must be between 0 and 1000, not {weight}")
        point_world, point_radius = _world(world, of_world)
        lower, upper = point_world.lower, point_world.upper
        longest = float((upper - lower).max())
        if not (size == 0 or 1e-3 * longest <= size <= longest):
            least = 1e-3 * longest
            raise InputError(f"rigid: size must be between {least:g} and {longest:g}, not {size}")
        if not lower[2] <= z <= upper[2]:
            raise InputError(f"rigid: z must be between {lower[2]:g} and {upper[2]:g}, not {z}")
        parts = body_of(body, size)
        radius = radius_of(parts)
        if not radius <= longest:
            raise InputError(f"rigid: {body} is larger than the world; say its size, as in size=2")
        self._z = z
        placement = _placement(space, lower, upper, z, weight or round(radius, 6))
        encloses = any(isinstance(part.solid, Mesh) for part in parts)
        super().__init__(RigidBody(parts, placement), point_world, point_radius, encloses)
        self.min_separation, self.search_step = longest / 5, longest / 10
        self.end_clearance = self.min_clearance = min(point_world.min_clearance, longest / 100)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        made = self.sampled_ends(n, seed)
        return [
            Problem(start, goal, index, derived_seed("rigid planner", seed, index))
            for index, (start, goal) in enumerate(made.pairs)
        ]

    def definition(self) -> dict[str, Any]:
        return {
            "class": "RigidWorld",
            "version": 1,
            "parts": [part.definition() for part in self.robot.parts],
            "space": self.space.definition(),
            "z": self._z,
            "world": self.world.definition(),
            "problems": [
                self.min_clearance,
                self.min_separation,
                SEARCH,
                DRAWS,
                self.search_step,
                SLACK,
            ],
        }


def _placement(space: str, lower: Array, upper: Array, z: float, weight: float) -> Placement:
    if space == "r3":
        return Translation(lower, upper)
    if space == "se2":
        return InThePlane(lower, upper, z, weight)
    return InSpace(lower, upper, weight)


def _world(name: str, arguments: Mapping[str, str]) -> tuple[Environment, float]:
    """The environment of a point robot that a name, with or without arguments, names, and the
    radius of that robot."""
    head, _, rest = name.partition(":")
    text = ",".join(filter(None, (rest, argument_text(arguments))))
    try:
        made = envs.make(f"{head}:{text}" if text else head)
    except InputError as error:
        raise InputError(
            f"rigid: {error} (of its world; its own are {', '.join(_own())})"
        ) from None
    if not isinstance(made.robot, PointRobot):
        raise InputError(
            f"rigid: world={head} has a robot of its own, which moves otherwise; name one of a "
            "point robot, such as c3d, mesh or gibson-generated"
        )
    if made.dimension != 3:
        raise InputError(
            f"rigid: world={head} is a plane, and bodies are in space; name a world in space, as a "
            "grid of three dimensions"
        )
    return made, made.robot.radius


def _own() -> list[str]:
    """The names of the arguments of `RigidWorld`."""
    parameters = inspect.signature(RigidWorld.__init__).parameters.values()
    return [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD][1:]
