"""Motions of arms, for planners that are compiled themselves."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.motion_check import array_at, checks_motions, known_as
from envs.collision.separation import Shapes
from envs.compiled import njit_cached
from envs.robots.arm import RobotArrays
from envs.robots.motion_proof import prove
from envs.robots.pair_tables import PairTables
from envs.robots.rrt_connect import reached
from envs.robots.sphere_trees import SphereTrees


class ArmMotionCheck(NamedTuple):
    """An arm without spherical joints among obstacles.

    Attributes:
        arm: with the pairs of parts that have no tables.
        trees: of spheres that cover its parts.
        tables: of the other pairs.
        around: the obstacles.
        may_touch: which parts may touch which of them, see `contacts_array`.
        tolerance: in metres.
    """

    arm: RobotArrays
    trees: SphereTrees
    tables: PairTables
    around: Shapes
    may_touch: NDArray[np.bool_]
    tolerance: float


@checks_motions(ArmMotionCheck)
def _arm_motion_is_free(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "ArmMotionCheck")
    return bool(arm_motion_is_free(check, array_at(a, size), array_at(b, size)))


@njit_cached
def arm_motion_is_free(check: Any, a: Any, b: Any) -> bool:
    """See `motion_check.motion_is_free`. What is in the way of a motion is nearly always in the way
    at its end, too, which is asked first."""
    asked, kept = check.tolerance, check.tolerance / 2
    end = reached(check.arm.tree.wraps, a, b)
    rest = check.arm, check.trees, check.tables, check.around, check.may_touch
    if prove(*rest, end, end, asked, kept)[0] >= 0:
        return False
    return bool(prove(*rest, a, end, asked, kept)[0] < 0)
