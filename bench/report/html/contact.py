"""Where a path that the judge refused first comes too close to something."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from envs.collision.fcl_model import CollisionModel
from envs.problem import Array

_MOST_STEPS = 50_000
"""Beside something for miles, proofs go on in tiny steps. A picture needs no proof."""


@dataclass(frozen=True)
class Place:
    """A place on a path.

    Attributes:
        q: the configuration (d,).
        share: of the path's length before it, from 0 to 1.
        clearance: there, in workspace units; where negative, its size means nothing.
    """

    q: Array
    share: float
    clearance: float


def first_contact(model: CollisionModel, path: Array) -> Place:
    """The first place of a path (k, d) that is not proved free of collision: whose clearance is
    not above the model's tolerance. Of a path without any, the closest place that was looked at.

    It goes along the path by conservative advancement (see `envs.collision.continuous`), so that
    nothing thin slips between two places, but in steps of a `_MOST_STEPS`th of the path at least.
    """
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    whole = max(float(lengths.sum()), 1e-300)
    closest = Place(path[0], 0.0, model.clearance(path[0]))
    gone = 0.0
    for (a, b), length in zip(pairwise(path), lengths, strict=True):
        bound = model.robot.motion_bound(a, b)
        t = 0.0
        while t <= 1:
            q = a + t * (b - a)
            here = Place(q, (gone + t * float(length)) / whole, model.clearance(q))
            if here.clearance <= model.tolerance:
                return here
            closest = min(closest, here, key=_clearance)
            reach = max(
                (here.clearance - model.tolerance / 2) / max(bound, 1e-300),
                whole / _MOST_STEPS / max(float(length), 1e-300),
            )
            t = _next(t, reach)
        gone += float(length)
    return closest


def _next(t: float, reach: float) -> float:
    """Where to look after t: a reach (of t) farther, and at the end of the motion, too."""
    after = t + reach
    return 1.0 if t < 1 <= after else after


def _clearance(place: Place) -> float:
    return place.clearance
