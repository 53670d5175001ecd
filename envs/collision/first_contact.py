"""Where along a path a robot first touches something."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

from envs.collision.continuous import Between, straight
from envs.problem import Array

ENOUGH_STEPS = 50_000
"""For pictures and messages, which need no proof."""


@dataclass(frozen=True)
class Place:
    """A place on a path.

    Attributes:
        q: the configuration (d,).
        share: of the path's length before it, from 0 to 1.
        waypoint: the number of the last waypoint before it, or at which it is.
        clearance: there, in workspace units; where negative, its size means nothing.
    """

    q: Array
    share: float
    waypoint: int
    clearance: float


def first_contact(
    clearance: Callable[[Array], float],
    waypoints: Array,
    lengths: Array,
    bounds: Iterable[float],
    tolerance: float,
    most_steps: int,
    between: Between = straight,
) -> Place:
    """The first place of a path of waypoints (k, d) that is not proved free of collision: whose
    clearance is not above the tolerance. Of a path without any, the closest place that was asked.

    It goes along the path by conservative advancement (see `envs.collision.continuous`), so that
    nothing thin slips between two places, but in steps of a `most_steps`th of the path at least:
    beside something for miles, proofs go on in tiny steps.

    Args:
        clearance: (d,) -> signed distance to the obstacles, in workspace units.
        lengths: (k - 1,) of the motions from each waypoint to the next.
        bounds: k - 1 bounds on the speed of any point of the robot, one a segment, in workspace
            units per unit of t.
        tolerance: in workspace units.
        between: these motions.
    """
    whole = max(float(lengths.sum()), 1e-300)
    closest = Place(waypoints[0], 0.0, 0, clearance(waypoints[0]))
    gone = 0.0
    motions = zip(pairwise(waypoints), lengths, bounds, strict=True)
    for number, ((a, b), length, bound) in enumerate(motions):
        t = 0.0
        while t <= 1:
            q = between(a, b, t)
            share = (gone + t * float(length)) / whole
            here = Place(q, share, number if t < 1 else number + 1, clearance(q))
            if here.clearance <= tolerance:
                return here
            closest = min(closest, here, key=_clearance)
            # As far as nothing can come nearer than half the tolerance, or the least step.
            reach = max(
                (here.clearance - tolerance / 2) / max(bound, 1e-300),
                whole / most_steps / max(float(length), 1e-300),
            )
            t = _next(t, reach)
        gone += float(length)
    return closest


def _next(t: float, reach: float) -> float:
    """Where to ask after t: a reach (of t) farther, and at the end of the motion, too."""
    after = t + reach
    return 1.0 if t < 1 <= after else after


def _clearance(place: Place) -> float:
    return place.clearance
