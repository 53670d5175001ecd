"""Certified checks of many paths at once, by batched clearances.

The clearance falls by no more than the robot moves. So if the clearances at both ends of a motion
add up to more than the robot moves between, all of it is free; otherwise its middle is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from envs.collision.fcl_model import DEFAULT_TOLERANCE
from envs.problem import Array


def paths_are_free(
    clearance: Callable[[Array], Array],
    rate_bound: float,
    paths: Sequence[Array],
    tolerance: float = DEFAULT_TOLERANCE,
) -> NDArray[np.bool_]:
    """Which paths are proved free of collision, (n,) of bool.

    True is a proof that the clearance exceeds tolerance / 2 all along the path. False means that
    it is <= tolerance somewhere.

    Args:
        clearance: (n, d) -> (n,), in workspace units; never more than the true one.
        rate_bound: how far any point of the robot moves per unit of configuration distance.
        paths: each (k, d).
    """
    free = np.ones(len(paths), dtype=bool)
    if not paths:
        return free
    owner = np.repeat(np.arange(len(paths)), [len(path) for path in paths])
    points = np.concatenate(paths)
    known = clearance(points)
    free[owner[known <= tolerance]] = False
    inner = owner[:-1] == owner[1:]
    owner = owner[:-1][inner]
    a, b = points[:-1][inner], points[1:][inner]
    at_a, at_b = known[:-1][inner], known[1:][inner]
    while True:
        moved = rate_bound * np.linalg.norm(b - a, axis=1)
        uncertain = (at_a + at_b - tolerance < moved) & free[owner]
        if not uncertain.any():
            return free
        owner, a, b, at_a, at_b = (x[uncertain] for x in (owner, a, b, at_a, at_b))
        middle = (a + b) / 2
        at_middle = clearance(middle)
        free[owner[at_middle <= tolerance]] = False
        owner = np.concatenate([owner, owner])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        at_a, at_b = np.concatenate([at_a, at_middle]), np.concatenate([at_middle, at_b])
