"""Where a refused path first collides, and what with."""

from __future__ import annotations

from dataclasses import dataclass

from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.collision.first_contact import Place
from envs.problem import Array


@dataclass(frozen=True, eq=False)
class Contact:
    """The first place of a path that is not proved free of collision.

    Attributes:
        configuration: float64 (d,).
        share: of the path's length before it, from 0 to 1.
        waypoint: the number of the last waypoint before it, or at which it is, from 0.
        between: the names of the two that touch there or are nearest to each other, as in
            `("link 'fore'", "obstacle 1 (a box)")`: links, or a link and an obstacle, by
            `Environment.shape_names` and `obstacle_names`. None where nothing is near, but the
            robot may not be, as within a closed mesh.
        distance: of the two, in workspace units, never more than it is; 0 where they touch.
        text: what collides, in words.
    """

    configuration: Array
    share: float
    waypoint: int
    between: tuple[str, str] | None
    distance: float
    text: str

    @property
    def where(self) -> str:
        """Of the path, in words."""
        return f"{self.share:.1%} along the path, at or after waypoint {self.waypoint}"

    def __str__(self) -> str:
        return f"{self.text}, {self.where}"


def first_contact(env: Environment, model: CollisionModel, path: Array) -> Contact:
    """The first contact of a path of waypoints (k, d) that a collision model of `env` refuses."""
    place = model.first_contact(path)
    pair, distance = env.checked_pairs().nearest(place.q)
    at = place.q, place.share, place.waypoint
    if pair is None or (distance > model.tolerance and not _is_allowed(env, place)):
        return Contact(*at, None, distance, f"the robot touches nothing, but is {env.not_allowed}")
    names = [*env.shape_names, *env.obstacle_names]
    one, other = names[pair[0]], names[pair[1]]
    unit = env.units["workspace"]
    meets = "touches" if distance <= 0 else f"comes within {distance:.2g} {unit} of"
    return Contact(*at, (one, other), distance, f"{one} {meets} {other}")


def _is_allowed(env: Environment, place: Place) -> bool:
    return env.allowed is None or bool(env.allowed(place.q[None])[0])
