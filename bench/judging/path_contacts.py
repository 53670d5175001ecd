"""How much of a path is in contact, and how deep: of paths that the judge refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.judging.path_numbers import pieces
from bench.judging.touching_pairs import touching_pairs
from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array

_PIECES_OF_EXTENT = 2000
"""A path is looked at in pieces no longer than this part of the space's extent."""

_LOOKED_AT = 24
"""Places of which the depth is asked, evenly among those in contact, and as many again about the
deepest."""


@dataclass(frozen=True)
class PathContacts:
    """What a path goes through.

    Attributes:
        share: of the path's length that is in contact, from 0 to 1, by the middles of pieces.
        depth: how deep the robot is in something where it is deepest, in workspace units: of point
            robots minus the clearance, of others by `penetration_depth` of the pairs that touch.
        configuration: (d,) where.
        between: the two that touch there; None of point robots.
    """

    share: float
    depth: float
    configuration: Array
    between: tuple[str, str] | None


def path_contacts(env: Environment, model: CollisionModel, path: Array) -> PathContacts:
    """What a path of waypoints (k, d) that a collision model of `env` refuses goes through. Where
    no middle of a piece is in contact, it is looked at at its first contact alone, and the share is
    0."""
    space = env.space
    middles, lengths = pieces(space, path, space.extent / _PIECES_OF_EXTENT)
    touching = ~np.array([model.is_valid(q) for q in middles], dtype=np.bool_)
    if touching.any():
        whole = lengths.sum()
        share = float(lengths[touching].sum() / whole) if whole > 0 else 1.0
        places = middles[touching]
    else:
        share, places = 0.0, model.first_contact(path).q[None]
    depth, at = _deepest(env, places)
    return PathContacts(share, depth, places[at], _between(env, places[at], model.tolerance))


def _deepest(env: Environment, places: Array) -> tuple[float, int]:
    """The greatest depth at some places (n, d), and at which."""
    if env.is_point_robot:
        depths = -env.clearance(places)
        at = int(depths.argmax())
        return max(float(depths[at]), 0.0), at

    def depth(n: int) -> float:
        return max((pair.depth for pair in touching_pairs(env, places[n], 0.0)), default=0.0)

    return _greatest(depth, len(places))


def _greatest(depth: Callable[[int], float], count: int) -> tuple[float, int]:
    """Of so many in a row: by some of them, then by those about the greatest of these."""
    coarse = _evenly(0, count - 1)
    known = {n: depth(n) for n in coarse.tolist()}
    best = max(known, key=lambda n: known[n])
    step = int(np.diff(coarse).max(initial=1))
    fine = _evenly(max(0, best - step), min(count - 1, best + step))
    known |= {n: depth(n) for n in fine.tolist() if n not in known}
    best = max(known, key=lambda n: known[n])
    return known[best], best


def _evenly(first: int, last: int) -> NDArray[np.int64]:
    """At most `_LOOKED_AT` numbers from the first to the last."""
    return np.unique(np.linspace(first, last, min(_LOOKED_AT, last - first + 1)).round()).astype(
        np.int64
    )


def _between(env: Environment, q: Array, tolerance: float) -> tuple[str, str] | None:
    if env.is_point_robot:
        return None
    deepest = max(touching_pairs(env, q, tolerance), key=lambda pair: pair.depth, default=None)
    return None if deepest is None else deepest.names
